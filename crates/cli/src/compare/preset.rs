//! What a preset stands for.

use cohaptic_campaign::{Strategies, StrategiesError};

use crate::arguments::{CompareArguments, PresetName};

/// Strategies, and texts `KEY=VALUES` of keys that vary.
pub(super) struct Asked {
    pub(super) strategies: Strategies,
    pub(super) vary: Vec<String>,
}

/// The grid of `field`: on links of today, from a laboratory to the other side of the earth, and from none to what makes calls useless.
const FIELD: [&str; 2] = ["link.delay=0ms..200ms/9", "link.loss=0%..30%/4"];

impl Asked {
    /// What the arguments ask for.
    pub(super) fn of(arguments: &CompareArguments) -> Result<Self, StrategiesError> {
        match arguments.preset {
            Some(PresetName::Field) => Ok(Self { strategies: Strategies::all(), vary: FIELD.map(str::to_owned).to_vec() }),
            None => {
                let strategies = Strategies::parse(arguments.strategies.as_deref().unwrap_or_default())?;
                Ok(Self { strategies, vary: arguments.vary.clone() })
            }
        }
    }
}
