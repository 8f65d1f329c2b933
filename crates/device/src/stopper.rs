//! Stop of a device from any thread.

use core::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

/// Handle that stops a device from any thread, for example from a handler of signals. Clones stop the same device.
///
/// A driver shares one stopper with its gate and its thread: after [`stop`](Self::stop) the gate admits zero force alone, and the thread sends zero force to
/// the device and ends.
#[derive(Clone, Debug, Default)]
pub struct Stopper(Arc<AtomicBool>);

impl Stopper {
    /// Stops the device for good, and returns without waiting. A second call changes nothing.
    pub fn stop(&self) {
        // Release: a thread that sees the stop also sees all writes before the stop.
        self.0.store(true, Ordering::Release);
    }

    /// Returns whether the device was stopped.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}
