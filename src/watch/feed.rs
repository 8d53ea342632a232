//! The messages of the present episode, which every page receives from the first on.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

/// Longest wait for a message before a page looks whether the program ends.
const WAIT: Duration = Duration::from_millis(200);

/// Messages in their order. A new episode replaces those of the one before.
#[derive(Debug, Default)]
pub(crate) struct Feed {
    content: Mutex<Content>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Content {
    /// Number of the episode.
    generation: u64,
    messages: Vec<Arc<Vec<u8>>>,
}

/// How far a page has read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place {
    generation: u64,
    count: usize,
}

impl Feed {
    fn lock(&self) -> MutexGuard<'_, Content> {
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins an episode with a first message.
    pub(crate) fn begin(&self, message: Vec<u8>) {
        let mut content = self.lock();
        content.generation += 1;
        content.messages = vec![Arc::new(message)];
        self.changed.notify_all();
    }

    /// Appends a message.
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
}
