//! Why there is no family of scenes, or no radius in it.

use cohaptic_scene::SceneError;
use cohaptic_units::print::SixDigits;

use crate::AnalysisError;

/// Why there is no family of scenes, or no radius in it.
#[derive(Debug, thiserror::Error)]
pub enum FamilyError {
    /// The scene is refused, as it is without the keys or with one of their values: an unknown key or peer, a value out of range.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A key takes something else than a number.
    #[error("{key} is no number that can be varied: {message}")]
    NoNumber {
        /// The key.
        key: String,
        /// What the scene's reader says to a number there.
        message: String,
    },
    /// No key, or more than two.
    #[error("{keys} keys are left open: expected one or two")]
    Keys {
        /// How many.
        keys: usize,
    },
    /// A key is named twice.
    #[error("{key} is left open twice: expected two different keys")]
    Twice {
        /// The key.
        key: String,
    },
    /// Not one value for each key.
    #[error("{given} values for {keys} open keys: expected one for each")]
    Values {
        /// How many values.
        given: usize,
        /// How many keys.
        keys: usize,
    },
    /// A value is not in the range of its key.
    #[error("{key} = {} is out of its range: expected a number from {} to {}", SixDigits(*value), SixDigits(*low), SixDigits(*high))]
    Outside {
        /// The key.
        key: String,
        /// The value asked for.
        value: f64,
        /// The smallest one.
        low: f64,
        /// The largest one.
        high: f64,
    },
}
