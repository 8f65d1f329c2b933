//! Strategies and varied keys of a comparison, from a preset or from the arguments.

use cohaptic_campaign::{Strategies, StrategiesError};

use crate::arguments::{CompareArguments, PresetName};

/// Strategies to compare, and the keys that vary, as texts `KEY=VALUES`.
pub(super) struct Asked {
    pub(super) strategies: Strategies,
    pub(super) vary: Vec<String>,
}

/// Grid of the preset `field`: delays from a laboratory network to the other side of the earth, and losses from 0 % to 30 %.
const FIELD: [&str; 2] = ["link.delay=0ms..200ms/9", "link.loss=0%..30%/4"];

/// Strategy of the preset `field` beside the registered strategies: a dead band on velocities by Weber's law for the sense of touch, with the usual fraction of
/// teleoperation.
const DEAD_BAND: &str = "average-position{coordination.send-when.velocity=10%}";

impl Asked {
    /// Returns the strategies and the varied keys of the arguments.
    pub(super) fn of(arguments: &CompareArguments) -> Result<Self, StrategiesError> {
        match arguments.preset {
            Some(PresetName::Field) => {
                // All registered strategies take part, so that a new strategy joins the preset without a change here.
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
