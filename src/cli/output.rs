//! Standard output and progress.

use std::io::{IsTerminal, Write};

use indicatif::{ProgressBar, ProgressStyle};

use crate::text;

/// Prints to standard output with control characters escaped. Ignores write errors: a closed pipe does
/// not end a command.
pub(crate) fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text::escape_control(text).as_bytes()).and_then(|()| out.flush());
}

/// Prints a value as indented JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) {
    print(&format!("{:#}\n", serde_json::json!(value)));
}

/// Prints a message of the program to standard error, after `softvt: `.
pub(crate) fn eprint_notice(message: impl std::fmt::Display) {
    text::eprint_line(&format!("softvt: {message}"));
}

/// Progress of a list of jobs on standard error: a bar on a terminal, one line per job elsewhere.
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

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
