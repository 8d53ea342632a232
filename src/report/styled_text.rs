//! Text for a terminal, with colours where the terminal has them.

use std::fmt::{Display, Write};

use anstyle::{Ansi256Color, AnsiColor, Style};

use softvt_common::text::{escape_control, shortened};
use softvt_evaluation::category::EpisodeCategory;

/// Layout of tables for a terminal.
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

    pub fn with_details(self) -> Self {
        Self { has_details: true, ..self }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emphasis {
    None,
    Bold,
    Faint,
    Category(EpisodeCategory),
}

impl Emphasis {
    /// Colours that are legible on light and on dark terminals, near the colours of the pages.
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
    pub(crate) format: TerminalFormat,
}

impl StyledText {
    pub(crate) fn new(format: TerminalFormat) -> Self {
        Self { text: String::new(), format }
    }

    /// Longest line, characters.
    pub(crate) fn width(&self) -> usize {
        self.format.width - 1
    }

    pub(crate) fn push(&mut self, emphasis: Emphasis, part: impl Display) -> &mut Self {
        let (style, part) = (emphasis.style(), part.to_string());
        let part = escape_control(&part);
        // Writing to memory does not fail.
        let _ = match self.format.is_coloured {
            true => write!(self.text, "{style}{part}{style:#}"),
            false => self.text.write_str(&part),
        };
        self
    }

    /// Ends the line, without spaces at its end.
    pub(crate) fn end(&mut self) {
        self.text.truncate(self.text.trim_end_matches(' ').len());
        self.text.push('\n');
    }

    pub(crate) fn line(&mut self, emphasis: Emphasis, text: impl Display) {
        self.push(emphasis, text).end();
    }

    /// Appends a bold line, cut to the width.
    pub(crate) fn title(&mut self, text: impl Display) {
        self.line(Emphasis::Bold, shortened(&text.to_string(), self.width()));
    }

    /// Appends whole lines without emphasis.
    pub(crate) fn plain(&mut self, lines: impl Display) {
        lines.to_string().lines().for_each(|line| self.line(Emphasis::None, line));
    }

    /// Appends a sentence in lines within the width, which break at spaces.
    pub(crate) fn note(&mut self, sentence: impl Display) {
        let sentence = sentence.to_string();
        let indent = " ".repeat(sentence.len() - sentence.trim_start().len());
        let mut line = indent.clone();
        for word in sentence.split_whitespace() {
            let is_first = line.len() == indent.len();
            if !is_first && line.chars().count() + 1 + word.chars().count() > self.width() {
                self.line(Emphasis::None, &line);
                line = indent.clone() + "  " + word;
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
