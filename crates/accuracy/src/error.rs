//! Why there are no rows.

/// Why a measurement came to no end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AccuracyError {
    /// Whoever watches asked for it.
    #[error("stopped")]
    Stopped,
}
