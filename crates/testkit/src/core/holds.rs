//! Work on other threads, during which the time of the run does not pass.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::Shared;

/// Guard: time does not pass until the guard is dropped.
pub(crate) struct Held(Arc<AtomicUsize>);

impl cohaptic_sockets::Hold for Held {}

impl Shared {
    /// Holds the time of the run. Only tokio's executor heeds this.
    pub(crate) fn hold(&self) -> Held {
        self.holds.fetch_add(1, Ordering::Relaxed);
        Held(Arc::clone(&self.holds))
    }

    /// Returns whether time must not pass.
    pub(crate) fn is_held(&self) -> bool {
        self.holds.load(Ordering::Relaxed) > 0
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
