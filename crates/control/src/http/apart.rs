//! Work that may wait for a disk or take long.

use tokio::task::JoinError;

/// Does work on a thread of its own, so that other requests are answered meanwhile.
///
/// # Errors
///
/// If the work panics.
#[cfg(not(fuzzing))]
pub(super) async fn apart<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, JoinError> {
    tokio::task::spawn_blocking(work).await
}

/// Does work at once: a fuzz target knows an answer as complete when nothing moves any more, and would not wait for another thread.
///
/// # Errors
///
/// None: a panic of the work is one of the target.
#[cfg(fuzzing)]
pub(super) async fn apart<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, JoinError> {
    Ok(work())
}
