//! Error of a measurement.

use cohaptic_scene::SceneError;
use cohaptic_stability::{AnalysisError, BoundaryError, FamilyError};
use cohaptic_wan::{NetworkError, TimeWentBack};

/// Reason why a measurement ended early.
#[derive(Debug, thiserror::Error)]
pub enum AccuracyError {
    /// The watcher asked for the end.
    #[error("stopped")]
    Stopped,
    /// A scene of this crate is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene of this crate cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A family of scenes of this crate cannot be analysed.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// A boundary of this crate cannot be found.
    #[error(transparent)]
    Boundary(#[from] BoundaryError<FamilyError>),
    /// A network of this crate refuses a packet.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// A network of this crate was asked for an instant of the past.
    #[error(transparent)]
    Time(#[from] TimeWentBack),
    /// The system refused to wait.
    #[error("waiting for a packet's time: {0}")]
    Wait(#[from] std::io::Error),
}
