//! Process-wide cancellation flag, set by the signal handler and polled by long-running loops.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set by [`request`], cleared by [`withdraw`].
static FLAG: AtomicBool = AtomicBool::new(false);

/// Requests cancellation. Returns true if it had been requested before.
pub fn request() -> bool {
    FLAG.swap(true, Ordering::Relaxed)
}

/// Withdraws the request, once all that it stopped has ended: the process can run again.
pub fn withdraw() {
    FLAG.store(false, Ordering::Relaxed);
}

pub fn requested() -> bool {
    FLAG.load(Ordering::Relaxed)
}

/// Cancellation of a part of the process, such as one server. The part is also cancelled with the whole process.
#[derive(Debug, Default)]
pub struct CancelFlag(AtomicBool);

/// The flag of what is cancelled with the process alone.
pub static WITH_PROCESS: CancelFlag = CancelFlag::new();

impl CancelFlag {
    pub const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True once cancellation of the part or of the process has been requested.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed) || requested()
    }
}
