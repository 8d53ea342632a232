//! Standard output and progress.

use std::io::{self, IsTerminal, Write};

use indicatif::{ProgressBar, ProgressStyle};

use crate::error::CliError;
use softvt_common::text;

/// Prints to standard output with control characters escaped. A closed pipe (`| head -1`) is no error: the reader has
/// what it wants.
///
/// # Errors
/// The text cannot be written, for example to a full disk.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let mut out = io::stdout().lock();
    match out.write_all(text::escape_control(text).as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(CliError::input(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Prints a value as indented JSON.
///
/// # Errors
/// As [`print`].
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), CliError> {
    print(&format!("{:#}\n", serde_json::json!(value)))
}

/// Formats rows of equal length in columns that are two spaces apart and as wide as their longest cell.
pub(crate) fn text_columns(rows: &[Vec<String>], is_right_aligned: impl Fn(usize) -> bool) -> String {
    let mut lines = vec![String::new(); rows.len()];
    for column in 0..rows.first().map_or(0, Vec::len) {
        let width = rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        for (line, row) in lines.iter_mut().zip(rows) {
            let (gap, cell) = (if column > 0 { "  " } else { "" }, &row[column]);
            *line += gap;
            *line +=
                &if is_right_aligned(column) { format!("{cell:>width$}") } else { format!("{cell:width$}") };
        }
    }
    lines.iter().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// Prints a message of the program to standard error, after `softvt: `.
pub(crate) fn eprint_notice(message: impl std::fmt::Display) {
    text::eprint_line(&format!("softvt: {message}"));
}

/// Progress of a list of jobs on standard error: a bar on a terminal, which disappears
/// when this is dropped, and one line per job elsewhere.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    total: usize,
    done: usize,
}

impl Progress {
    pub(crate) fn new(total: usize, what: &str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total as u64);
            let template =
                format!("{what} {{bar:32}} {{pos}}/{{len}}  {{elapsed}} elapsed, {{eta}} left  {{msg}}");
            if let Ok(style) = ProgressStyle::with_template(&template) {
                bar.set_style(style);
            }
            bar
        });
        Self { bar, total, done: 0 }
    }

    /// Reports the end of one job.
    pub(crate) fn tick(&mut self, message: &str) {
        self.done += 1;
        let message = text::escape_control(message);
        match &self.bar {
            Some(bar) => {
                bar.set_message(message.into_owned());
                bar.inc(1);
            }
            None => text::eprint_line(&format!("[{}/{}] {message}", self.done, self.total)),
        }
    }
}
