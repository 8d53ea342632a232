//! Things made once and shared by all episodes and threads.

use std::sync::{Arc, Mutex};

/// Values by key, a few of them.
#[derive(Debug)]
pub(super) struct Made<K, V>(Arc<Mutex<Vec<(K, V)>>>);

impl<K, V> Clone for Made<K, V> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<K, V> Default for Made<K, V> {
    fn default() -> Self {
        Self(Arc::default())
    }
}

impl<K, V: Clone> Made<K, V> {
    /// The value of a key for which `is` holds, else what `make` makes. Others wait meanwhile, so that two workers never
    /// make the same.
    pub fn get<E>(&self, is: impl Fn(&K) -> bool, make: impl FnOnce() -> Result<(K, V), E>) -> Result<V, E> {
        let mut made = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some((_, value)) = made.iter().find(|(key, _)| is(key)) {
            return Ok(value.clone());
        }
        let (key, value) = make()?;
        made.push((key, value.clone()));
        Ok(value)
    }
}
