//! [`Observer`]: what a run tells while it is in progress.

/// Receives the progress and the messages of runs. Its methods are called from any thread; by default they do nothing.
pub trait Observer: Send + Sync {
    /// A message that needs no answer, such as a warning.
    fn notice(&self, message: &str) {
        let _ = message;
    }

    /// A list of `total` jobs begins; `what` names it.
    fn begin(&self, total: usize, what: &str) {
        let _ = (total, what);
    }

    /// A job of the list has ended, with one line about its result.
    fn advance(&self, line: &str) {
        let _ = line;
    }

    /// The list has ended.
    fn end(&self) {}
}

/// Tells nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {}
