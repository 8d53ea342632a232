//! The wish to end: one flag for the process, since signals are the process's. Whatever takes long looks at it.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set once; never cleared.
pub static FLAG: AtomicBool = AtomicBool::new(false);

/// Asks everything to end; says whether it had been asked before.
pub fn request() -> bool {
    FLAG.swap(true, Ordering::Relaxed)
}

/// Whether the end was asked for.
pub fn requested() -> bool {
    FLAG.load(Ordering::Relaxed)
}
