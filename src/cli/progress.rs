//! Progress for people, on the standard error: a bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressStyle};

use crate::text;

/// Progress of a batch of jobs.
pub(super) struct Progress {
    bar: Option<ProgressBar>,
    total: usize,
    done: usize,
}

impl Progress {
    /// For `total` jobs.
    pub(super) fn new(total: usize, what: &str) -> Self {
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

    /// One job has ended.
    pub(super) fn tick(&mut self, message: &str) {
        self.done += 1;
        match &self.bar {
            Some(bar) => {
                bar.set_message(text::escape_control(message).into_owned());
                bar.inc(1);
            }
            None => crate::text::eprint_line(&format!(
                "[{}/{}] {}",
                self.done,
                self.total,
                text::escape_control(message)
            )),
        }
    }

    /// No more jobs.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
