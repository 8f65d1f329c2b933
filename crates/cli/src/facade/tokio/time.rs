//! Time. In a test bed the real tokio's clock is paused, and the test bed moves it.

pub use real::time::*;

/// See `tokio::time::pause`. Nothing happens in a test bed, whose time is virtual already.
#[cfg(feature = "test-util")]
#[track_caller]
pub fn pause() {
    if !cohaptic_sockets::is_in_bed() {
        real::time::pause();
    }
}

/// See `tokio::time::resume`. Nothing happens in a test bed, whose time stays virtual.
#[cfg(feature = "test-util")]
#[track_caller]
pub fn resume() {
    if !cohaptic_sockets::is_in_bed() {
        real::time::resume();
    }
}
