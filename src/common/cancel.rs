//! Process-wide cancellation flag, set by the signal handler and polled by long-running loops.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set once; never cleared.
pub static FLAG: AtomicBool = AtomicBool::new(false);

/// Requests cancellation. Returns true if it had been requested before.
pub fn request() -> bool {
    FLAG.swap(true, Ordering::Relaxed)
}

/// True once cancellation has been requested.
pub fn requested() -> bool {
    FLAG.load(Ordering::Relaxed)
}
