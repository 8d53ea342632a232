//! The messages of the present episode, which every page receives from the first on.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

/// Longest wait for a message before a page looks whether the program ends.
const WAIT: Duration = Duration::from_millis(200);
/// Time without an open page after which the pages count as closed: one that is loaded again is back before.
const RETURN: Duration = Duration::from_secs(3);

/// Messages in their order. A new episode replaces those of the one before.
#[derive(Debug, Default)]
pub(crate) struct Feed {
    content: Mutex<Content>,
    changed: Condvar,
    viewers: Mutex<Viewers>,
}

#[derive(Debug, Default)]
struct Viewers {
    count: usize,
    /// When the last one closed.
    left: Option<Instant>,
}

/// An open page. It counts as closed when this is dropped.
#[derive(Debug)]
pub(crate) struct Viewer<'a>(&'a Feed);

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        let mut viewers = self.0.viewers();
        viewers.count -= 1;
        viewers.left = Some(Instant::now());
    }
}

#[derive(Debug, Default)]
struct Content {
    generation: u64,
    messages: Vec<Arc<Vec<u8>>>,
}

/// Place of a page in the feed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place {
    generation: u64,
    count: usize,
}

impl Feed {
    fn lock(&self) -> MutexGuard<'_, Content> {
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn viewers(&self) -> MutexGuard<'_, Viewers> {
        self.viewers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a page that opens.
    pub(crate) fn enter(&self) -> Viewer<'_> {
        self.viewers().count += 1;
        Viewer(self)
    }

    pub(crate) fn is_unwatched(&self) -> bool {
        self.viewers().count == 0
    }

    /// True if no page has been open for 3 s, or ever.
    pub(crate) fn is_abandoned(&self) -> bool {
        let viewers = self.viewers();
        viewers.count == 0 && viewers.left.is_none_or(|left| left.elapsed() > RETURN)
    }

    pub(crate) fn begin(&self, message: Vec<u8>) {
        let mut content = self.lock();
        content.generation += 1;
        content.messages = vec![Arc::new(message)];
        self.changed.notify_all();
    }

    pub(crate) fn push(&self, message: Vec<u8>) {
        self.lock().messages.push(Arc::new(message));
        self.changed.notify_all();
    }

    /// The next message for a page, and its place after it. `None` if none comes within a fifth of a second.
    pub(crate) fn next(&self, place: Place) -> Option<(Arc<Vec<u8>>, Place)> {
        let is_waiting = |content: &mut Content| {
            content.messages.is_empty()
                || content.generation == place.generation && content.messages.len() <= place.count
        };
        let waited = self.changed.wait_timeout_while(self.lock(), WAIT, is_waiting);
        let (content, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        if timeout.timed_out() {
            return None;
        }
        let at = if content.generation == place.generation { place.count } else { 0 };
        Some((content.messages.get(at)?.clone(), Place { generation: content.generation, count: at + 1 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_reads_an_episode_from_its_start_and_goes_on_with_the_next_one() {
        let feed = Feed::default();
        assert!(feed.next(Place::default()).is_none());
        feed.begin(vec![1]);
        feed.push(vec![2]);
        let (first, place) = feed.next(Place::default()).unwrap();
        let (second, place) = feed.next(place).unwrap();
        assert_eq!((first[0], second[0]), (1, 2));
        assert!(feed.next(place).is_none());
        feed.begin(vec![3]);
        let (third, place) = feed.next(place).unwrap();
        assert_eq!((third[0], feed.next(place)), (3, None));
    }

    #[test]
    fn a_feed_is_abandoned_some_time_after_its_last_page_has_closed() {
        let feed = Feed::default();
        assert!(feed.is_abandoned(), "no page was ever open");
        let (first, second) = (feed.enter(), feed.enter());
        drop(first);
        assert!(!feed.is_unwatched() && !feed.is_abandoned());
        drop(second);
        assert!(feed.is_unwatched() && !feed.is_abandoned(), "the page may be loaded again");
        feed.viewers().left = Instant::now().checked_sub(RETURN + WAIT);
        assert!(feed.is_abandoned());
        let _third = feed.enter();
        assert!(!feed.is_abandoned());
    }
}
