//! Why there is no reproduction.

use cohaptic_scene::SceneError;
use cohaptic_stability::{AdmittanceError, AnalysisError, FamilyError, KeyRangeError, MapError};

/// Why there is no reproduction.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// The watcher asked for an end.
    #[error("given up before the end")]
    Stopped,
    /// A scene of the paper is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene of the paper cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A scene of the paper has no admittance.
    #[error(transparent)]
    Admittance(#[from] AdmittanceError),
    /// A stability region cannot be computed.
    #[error(transparent)]
    Map(#[from] MapError),
    /// A stability region cannot be computed.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// The gains of a stability region make no range.
    #[error(transparent)]
    Range(#[from] KeyRangeError),
}
