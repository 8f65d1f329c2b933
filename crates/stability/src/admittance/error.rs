//! Why there is no admittance.

use crate::AnalysisError;

/// Why there is no admittance.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum AdmittanceError {
    /// There is no such peer.
    #[error("no peer in place {peer}: expected one of the {peers} peers of the scene, counted from 0")]
    NoSuchPeer {
        /// The place asked for.
        peer: usize,
        /// How many peers there are.
        peers: usize,
    },
    /// Not a frequency, or one that ticks cannot show.
    #[error("{hz} Hz: expected a frequency above 0 and at most {highest} Hz, half the rate of the peer's ticks")]
    Frequency {
        /// The frequency asked for \[Hz\].
        hz: f64,
        /// The highest there is an admittance for \[Hz\].
        highest: f64,
    },
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}
