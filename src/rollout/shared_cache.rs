//! A cache whose values are computed once and shared by all threads.
//!
//! Written here because the keys hold floating-point numbers and so have no `Hash`, which the cache crates require; the
//! hash of all their bytes that names an entry on disk would be computed at every use. The number of entries is small,
//! so that a linear search is fast.

use std::sync::{Arc, Mutex};

use softvt_common::parallel::lock;

/// The slot of a value: empty until the value is computed.
type CacheSlot<V> = Arc<Mutex<Option<V>>>;

/// Slots by key, the most recently used last.
type Entries<K, V> = Vec<(K, CacheSlot<V>)>;

/// Values by key. Least recently used entries are evicted.
#[derive(Debug)]
pub(super) struct SharedCache<K, V> {
    entries: Mutex<Entries<K, V>>,
    most: usize,
}

impl<K: Clone, V: Clone> SharedCache<K, V> {
    /// A cache of at most `most` entries.
    pub(super) fn new(most: usize) -> Self {
        Self { entries: Mutex::new(Vec::new()), most }
    }

    /// Returns the value whose key satisfies `is_same`, or computes and stores the value of `key`. Concurrent callers
    /// with an equal key block until the first has computed it (single flight); callers with other keys proceed.
    pub(super) fn get<E>(
        &self,
        key: &K,
        is_same: impl Fn(&K) -> bool,
        compute: impl FnOnce() -> Result<V, E>,
    ) -> Result<V, E> {
        let cell = self.cell(key, is_same);
        let mut slot = lock(&cell);
        if let Some(value) = &*slot {
            return Ok(value.clone());
        }
        let value = compute()?;
        *slot = Some(value.clone());
        Ok(value)
    }

    /// The slot of a key, which becomes the most recently used one.
    fn cell(&self, key: &K, is_same: impl Fn(&K) -> bool) -> CacheSlot<V> {
        let mut entries = lock(&self.entries);
        let entry = match entries.iter().position(|(known, _)| is_same(known)) {
            Some(at) => entries.remove(at),
            None => (key.clone(), CacheSlot::default()),
        };
        if entries.len() >= self.most {
            entries.remove(0);
        }
        let cell = entry.1.clone();
        entries.push(entry);
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

    const MOST: usize = 64;

    fn double(cache: &SharedCache<usize, usize>, key: usize, count: &AtomicUsize) -> usize {
        let value: Result<_, Infallible> = cache.get(
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
    fn recently_used_values_are_kept_up_to_the_limit() {
        let (cache, count) = (SharedCache::new(MOST), AtomicUsize::new(0));
        for key in 0..10 * MOST {
            assert_eq!(double(&cache, key, &count), 2 * key);
            assert_eq!(double(&cache, 0, &count), 0, "in use all the time");
        }
        assert_eq!(count.load(Ordering::Relaxed), 10 * MOST);
        assert_eq!(lock(&cache.entries).len(), MOST);
        double(&cache, 1, &count);
        assert_eq!(count.load(Ordering::Relaxed), 10 * MOST + 1, "an evicted value is computed again");
    }

    #[test]
    fn other_values_are_computed_meanwhile_and_an_equal_key_waits() {
        let (cache, count) = (SharedCache::<usize, usize>::new(MOST), AtomicUsize::new(0));
        let (started, begun) = mpsc::channel();
        let (go, wait) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            let slow = scope.spawn(|| {
                cache.get(
                    &7,
                    |known| *known == 7,
                    move || {
                        started.send(()).expect("heard");
                        wait.recv().map(|()| 70)
                    },
                )
            });
            begun.recv().expect("begun");
            assert_eq!(double(&cache, 1, &count), 2, "another key does not wait");
            let same = scope.spawn(|| double(&cache, 7, &count));
            go.send(()).expect("heard");
            assert_eq!(slow.join().expect("no panic"), Ok(70));
            assert_eq!(same.join().expect("no panic"), 70);
        });
        assert_eq!(count.load(Ordering::Relaxed), 1, "the slow value was computed once");
    }

    #[test]
    fn a_failed_computation_is_repeated() {
        let cache = SharedCache::<(), u8>::new(1);
        assert_eq!(cache.get(&(), |()| true, || Err("no")), Err("no"));
        assert_eq!(cache.get(&(), |()| true, || Ok::<_, &str>(3)), Ok(3));
    }
}
