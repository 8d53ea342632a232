//! Text for a terminal, with colours where the terminal has them.

use anstyle::{Ansi256Color, AnsiColor, Style};

use softvt_common::text::escape_control;
use softvt_evaluation::category::EpisodeCategory;

/// How a table for a terminal is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TerminalFormat {
    /// Width of the terminal, columns.
    pub width: usize,
    /// True for colours and bold text.
    pub is_coloured: bool,
    /// True for all rows and figures, not the main ones only.
    pub has_details: bool,
}

impl TerminalFormat {
    /// Width that is assumed where it is not known.
    pub const DEFAULT_WIDTH: usize = 80;

    /// A pipe: no colours, [`Self::DEFAULT_WIDTH`] columns.
    pub const PLAIN: Self = Self { width: Self::DEFAULT_WIDTH, is_coloured: false, has_details: false };

    /// With all rows and figures.
    pub fn with_details(self) -> Self {
        Self { has_details: true, ..self }
    }
}

/// Emphasis of a part of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emphasis {
    None,
    Bold,
    Faint,
    Category(EpisodeCategory),
}

impl Emphasis {
    /// Colours that are legible on light and on dark terminals, near those of the pages.
    fn style(self) -> Style {
        let coloured = |number: u8| Style::new().fg_color(Some(Ansi256Color(number).into()));
        match self {
            Self::None | Self::Category(EpisodeCategory::GoalMissed) => Style::new(),
            Self::Bold => Style::new().bold(),
            Self::Faint => Style::new().dimmed(),
            Self::Category(EpisodeCategory::Safe) => coloured(32),
            Self::Category(EpisodeCategory::OverLimit) => coloured(166).bold(),
            Self::Category(EpisodeCategory::Dropped | EpisodeCategory::Slipped) => coloured(168),
            Self::Category(EpisodeCategory::NotJudged | EpisodeCategory::Invalid) => {
                Style::new().fg_color(Some(AnsiColor::BrightBlack.into()))
            }
        }
    }
}

/// Text in parts, each with its emphasis. Control characters of the parts are escaped.
#[derive(Clone, Debug)]
pub(crate) struct StyledText {
    text: String,
    is_coloured: bool,
}

impl StyledText {
    pub(crate) fn new(format: TerminalFormat) -> Self {
        Self { text: String::new(), is_coloured: format.is_coloured }
    }

    /// Appends a part of a line.
    pub(crate) fn push(&mut self, emphasis: Emphasis, part: impl AsRef<str>) -> &mut Self {
        let (style, part) = (emphasis.style(), escape_control(part.as_ref()).into_owned());
        self.text += &if self.is_coloured { format!("{style}{part}{style:#}") } else { part };
        self
    }

    /// Ends the line, without spaces at its end.
    pub(crate) fn end(&mut self) {
        self.text.truncate(self.text.trim_end_matches(' ').len());
        self.text.push('\n');
    }

    /// Appends a line.
    pub(crate) fn line(&mut self, emphasis: Emphasis, text: impl AsRef<str>) {
        self.push(emphasis, text).end();
    }

    /// Appends whole lines without emphasis.
    pub(crate) fn plain(&mut self, lines: &str) {
        lines.lines().for_each(|line| self.line(Emphasis::None, line));
    }

    /// Appends a sentence in lines of at most `width` characters, which break at spaces.
    pub(crate) fn wrapped(&mut self, sentence: &str, width: usize) {
        let indent = " ".repeat(sentence.len() - sentence.trim_start().len());
        let mut line = indent.clone();
        for word in sentence.split_whitespace() {
            let is_first = line.len() == indent.len();
            if !is_first && line.chars().count() + 1 + word.chars().count() > width {
                self.line(Emphasis::None, &line);
                line = format!("{indent}  {word}");
            } else {
                line += if is_first { "" } else { " " };
                line += word;
            }
        }
        self.line(Emphasis::None, &line);
    }

    /// The text, with escape sequences for its colours if it has any.
    pub(crate) fn into_text(self) -> String {
        self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_surround_parts_and_control_characters_of_names_are_escaped() {
        let text = |is_coloured: bool| {
            let mut text = StyledText::new(TerminalFormat { is_coloured, ..TerminalFormat::PLAIN });
            text.push(Emphasis::Category(EpisodeCategory::OverLimit), "✗ 2")
                .push(Emphasis::None, " a\u{1b}[2Jb  ");
            text.end();
            text.into_text()
        };
        assert_eq!(text(false), "✗ 2 a\\u{1b}[2Jb\n");
        assert_eq!(text(true), "\u{1b}[1m\u{1b}[38;5;166m✗ 2\u{1b}[0m a\\u{1b}[2Jb\n");
    }
}
