//! A limit on the pixels that all clients together have in rendering.

use std::sync::{Condvar, Mutex, PoisonError};

use softvt_common::cancel::CancelFlag;
use softvt_policy::transport::POLL_INTERVAL;

/// Maximum number of pixels of an image of a requested size, and of all images that are rendered at the same time.
pub(super) const MAX_RENDER_PIXELS: usize = 1920 * 1080;

#[derive(Debug, Default)]
pub(super) struct RenderBudget {
    in_use: Mutex<usize>,
    released: Condvar,
}

impl RenderBudget {
    /// Waits until an image of so many pixels fits. A larger one than the limit is rendered alone. `None` if
    /// the server is cancelled.
    pub(super) fn acquire(&self, pixels: usize, cancel: &CancelFlag) -> Option<RenderPermit<'_>> {
        let pixels = pixels.min(MAX_RENDER_PIXELS);
        let mut in_use = self.in_use.lock().unwrap_or_else(PoisonError::into_inner);
        while *in_use + pixels > MAX_RENDER_PIXELS {
            if cancel.requested() {
                return None;
            }
            let waited = self.released.wait_timeout(in_use, POLL_INTERVAL);
            in_use = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        *in_use += pixels;
        Some(RenderPermit { budget: self, pixels })
    }
}

/// Permission to render an image; its pixels are released on drop.
#[derive(Debug)]
pub(super) struct RenderPermit<'a> {
    budget: &'a RenderBudget,
    pixels: usize,
}

impl Drop for RenderPermit<'_> {
    fn drop(&mut self) {
        *self.budget.in_use.lock().unwrap_or_else(PoisonError::into_inner) -= self.pixels;
        self.budget.released.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_wait_until_they_fit() {
        let (budget, cancel) = (RenderBudget::default(), CancelFlag::default());
        let large = budget.acquire(usize::MAX, &cancel).unwrap();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| budget.acquire(1, &cancel).is_some());
            std::thread::sleep(std::time::Duration::from_millis(20));
            assert!(!waiting.is_finished());
            drop(large);
            assert!(waiting.join().unwrap());
        });
        let half = MAX_RENDER_PIXELS / 2;
        let _both = [half, half].map(|pixels| budget.acquire(pixels, &cancel).unwrap());
        cancel.request();
        assert!(budget.acquire(1, &cancel).is_none());
    }
}
