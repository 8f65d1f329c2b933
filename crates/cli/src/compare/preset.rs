//! What a preset stands for.

use cohaptic_campaign::{Strategies, StrategiesError};

use crate::arguments::{CompareArguments, PresetName};

/// Strategies, and texts `KEY=VALUES` of keys that vary.
pub(super) struct Asked {
    pub(super) strategies: Strategies,
    pub(super) vary: Vec<String>,
}

/// The grid of `field`: delays of a laboratory to those of the other side of the earth, losses from none to those that make calls useless.
const FIELD: [&str; 2] = ["link.delay=0ms..200ms/9", "link.loss=0%..30%/4"];

/// Beside the strategies of the registry: a dead band on velocities, by Weber's law for the sense of touch, with the fraction usual in teleoperation.
const DEAD_BAND: &str = "average-position{coordination.send-when.velocity=10%}";

impl Asked {
    /// What the arguments ask for.
    pub(super) fn of(arguments: &CompareArguments) -> Result<Self, StrategiesError> {
        match arguments.preset {
            Some(PresetName::Field) => {
                let all: Vec<String> = Strategies::all().names().chain([DEAD_BAND]).map(str::to_owned).collect();
                Ok(Self { strategies: Strategies::parse(&all.join(","))?, vary: FIELD.map(str::to_owned).to_vec() })
            }
            None => {
                let strategies = Strategies::parse(arguments.strategies.as_deref().unwrap_or_default())?;
                Ok(Self { strategies, vary: arguments.vary.clone() })
            }
        }
    }
}
