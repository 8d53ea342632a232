//! Things made once and shared by all episodes and threads, as long as they are in use.

use std::sync::{Arc, Mutex, MutexGuard};

/// How many things are kept. A suite has a few dozen assets; a layout that draws its looks at random would otherwise keep
/// those of every episode, megabytes each.
const MOST: usize = 64;

/// The place of one value: empty until it is made.
type Cell<V> = Arc<Mutex<Option<V>>>;

/// Places by key, the ones used last at the end.
type Kept<K, V> = Vec<(K, Cell<V>)>;

/// Values by key: the ones used last.
#[derive(Debug)]
pub(super) struct SharedCache<K, V>(Arc<Mutex<Kept<K, V>>>);

impl<K, V> Clone for SharedCache<K, V> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<K, V> Default for SharedCache<K, V> {
    fn default() -> Self {
        Self(Arc::default())
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl<K: Clone, V: Clone> SharedCache<K, V> {
    /// The value of a kept key that is the `same`, else what `make` makes, kept under `key`. Who wants the same meanwhile
    /// waits, so that two workers never make it both; others go on. What was not used for longest gives way: a value is a
    /// function of its key, so it can only have to be made again.
    ///
    /// # Errors
    /// Those of `make`; the next one tries again.
    pub(super) fn get<E>(
        &self,
        key: &K,
        same: impl Fn(&K) -> bool,
        make: impl FnOnce() -> Result<V, E>,
    ) -> Result<V, E> {
        let cell = self.cell(key, same);
        let mut place = locked(&cell);
        if let Some(value) = &*place {
            return Ok(value.clone());
        }
        let value = make()?;
        *place = Some(value.clone());
        Ok(value)
    }

    /// The place of a key, moved to the end of those that were used last.
    fn cell(&self, key: &K, same: impl Fn(&K) -> bool) -> Cell<V> {
        let mut kept = locked(&self.0);
        let entry = match kept.iter().position(|(known, _)| same(known)) {
            Some(at) => kept.remove(at),
            None => (key.clone(), Cell::default()),
        };
        if kept.len() == MOST {
            kept.remove(0);
        }
        let cell = entry.1.clone();
        kept.push(entry);
        cell
    }
}

#[cfg(test)]
mod tests {
    use std::{
        convert::Infallible,
        sync::{
            atomic::{AtomicUsize, Ordering},
            mpsc,
        },
    };

    use super::*;

    fn double(made: &SharedCache<usize, usize>, key: usize, count: &AtomicUsize) -> usize {
        let value: Result<_, Infallible> = made.get(
            &key,
            |known| *known == key,
            || {
                count.fetch_add(1, Ordering::Relaxed);
                Ok(2 * key)
            },
        );
        value.unwrap_or_else(|never| match never {})
    }

    #[test]
    fn what_was_used_last_is_kept_and_no_more_than_so_much() {
        let (made, count) = (SharedCache::default(), AtomicUsize::new(0));
        for key in 0..10 * MOST {
            assert_eq!(double(&made, key, &count), 2 * key);
            assert_eq!(double(&made, 0, &count), 0, "in use all the time");
        }
        assert_eq!(count.load(Ordering::Relaxed), 10 * MOST);
        assert_eq!(locked(&made.0).len(), MOST);
        double(&made, 1, &count);
        assert_eq!(count.load(Ordering::Relaxed), 10 * MOST + 1, "what gave way is made again");
    }

    #[test]
    fn others_are_made_while_one_is_being_made_and_the_same_is_waited_for() {
        let (made, count) = (SharedCache::<usize, usize>::default(), AtomicUsize::new(0));
        let (started, begun) = mpsc::channel();
        let (go, wait) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            let slow = scope.spawn(|| {
                made.get(
                    &7,
                    |known| *known == 7,
                    move || {
                        started.send(()).expect("heard");
                        wait.recv().map(|()| 70)
                    },
                )
            });
            begun.recv().expect("begun");
            assert_eq!(double(&made, 1, &count), 2, "another is not held up");
            let same = scope.spawn(|| double(&made, 7, &count));
            go.send(()).expect("heard");
            assert_eq!(slow.join().expect("no panic"), Ok(70));
            assert_eq!(same.join().expect("no panic"), 70);
        });
        assert_eq!(count.load(Ordering::Relaxed), 1, "the slow one was made once");
    }

    #[test]
    fn what_failed_is_tried_again() {
        let made = SharedCache::<(), u8>::default();
        assert_eq!(made.get(&(), |()| true, || Err("no")), Err("no"));
        assert_eq!(made.get(&(), |()| true, || Ok::<_, &str>(3)), Ok(3));
    }
}
