//! Tasks of the present runtime.

use std::future::Future;

use real::task::JoinHandle;

use crate::hosted;

/// See `tokio::task::spawn`.
#[track_caller]
pub fn spawn<F>(future: F) -> JoinHandle<F::Output>
where
    F: Future + Send + 'static,
    F::Output: Send + 'static,
{
    hosted::expect_runtime();
    hosted::start!(future, real::task::spawn(future), |started| started.abort_handle())
}

/// See `tokio::task::spawn_blocking`. In a test bed the virtual time waits for the function.
#[track_caller]
pub fn spawn_blocking<F, R>(function: F) -> JoinHandle<R>
where
    F: FnOnce() -> R + Send + 'static,
    R: Send + 'static,
{
    hosted::expect_runtime();
    hosted::start_blocking!(function, real::task::spawn_blocking(function), |task| real::task::spawn(task))
}

/// See `tokio::task::block_in_place`. In a test bed, which has one thread, the function simply runs: work takes no virtual time.
#[cfg(feature = "rt-multi-thread")]
#[track_caller]
pub fn block_in_place<F, R>(function: F) -> R
where
    F: FnOnce() -> R,
{
    if cohaptic_sockets::is_in_bed() { function() } else { real::task::block_in_place(function) }
}
