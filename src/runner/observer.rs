//! [`Observer`]: what a run tells while it is in progress.

use std::ops::Deref;

use softvt_evaluation::category::EpisodeCategory;

/// Receives the progress and the messages of runs. Its methods are called from any thread; by default they do nothing.
pub trait Observer: Send + Sync {
    /// A message that needs no answer, such as a warning.
    fn notice(&self, _message: &str) {}

    /// Work begins that can take seconds and has no results of its own, such as `checking the scenes`. It ends with the
    /// next call of `begin`, `end` or this function.
    fn work(&self, _what: &str) {}

    /// A list of jobs begins; `what` names it.
    fn begin(&self, _what: &str) {}

    /// The list has `count` more jobs.
    fn expect(&self, _count: usize) {}

    /// A job of the list has ended, with one line about its result.
    fn advance(&self, _line: &str) {}

    /// An episode of the list has been judged; [`Self::advance`] follows.
    fn judged(&self, _category: EpisodeCategory) {}

    /// The list, or the work, has ended.
    fn end(&self) {}
}

#[derive(Clone, Copy, Debug, Default)]
pub struct SilentObserver;

impl Observer for SilentObserver {}

/// An open list of jobs, which ends when this is dropped.
pub(crate) struct JobList<'a>(&'a dyn Observer);

impl<'a> JobList<'a> {
    pub(crate) fn begin(observer: &'a dyn Observer, what: &str) -> Self {
        observer.begin(what);
        Self(observer)
    }
}

impl<'a> Deref for JobList<'a> {
    type Target = dyn Observer + 'a;

    fn deref(&self) -> &Self::Target {
        self.0
    }
}

impl Drop for JobList<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}
