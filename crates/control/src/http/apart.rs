//! Runs work that may wait for a disk or take long.

use tokio::task::JoinError;

/// Runs `work` on a thread of its own, so that the thread of the server answers other requests meanwhile.
///
/// # Errors
///
/// [`JoinError`] if `work` panics.
#[cfg(not(fuzzing))]
pub(super) async fn apart<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, JoinError> {
    tokio::task::spawn_blocking(work).await
}

/// Runs `work` at once, because a fuzz target takes an answer as complete when no byte moves, and would not wait for another thread.
///
/// # Errors
///
/// None: a panic of `work` is a panic of the fuzz target.
#[cfg(fuzzing)]
pub(super) async fn apart<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, JoinError> {
    Ok(work())
}
