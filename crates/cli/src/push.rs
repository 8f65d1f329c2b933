//! Force of `watch` on a hand, the same for every device.

use crate::arguments::Force;
use crate::device_text::{Triple, length};
use crate::failure::Failure;

/// Force on the hand: none, a constant force \[N\], or a spring to the origin (stiffness \[N/m\], damping \[N·s/m\]).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Push {
    Nothing,
    Force(Triple),
    Spring { stiffness: f64, damping: f64 },
}

impl Push {
    /// Returns the push of the options `--force`, `--spring` and `--damping`, and refuses a force above `limit` \[N\].
    pub(crate) fn of(force: Option<Force>, spring: Option<f64>, damping: f64, limit: f64) -> Result<Self, Failure> {
        Ok(match (force, spring) {
            (Some(Force(force)), _) => {
                let asked = length(force);
                // The gate would shorten such a force without an error, and the user would not get the force of the option.
                if asked > limit {
                    return Err(Failure::Input(format!("the force of {asked:.3} N is above the limit of {limit} N: ask for less, or raise --limit")));
                }
                Self::Force(force)
            }
            (None, Some(stiffness)) => Self::Spring { stiffness, damping },
            (None, None) => Self::Nothing,
        })
    }

    /// Returns the force \[N\] at a position \[m\] and a velocity \[m/s\]; `None` asks for no force. Without a reading a spring asks for no force, because the
    /// position is not known.
    pub(crate) fn wants(self, reading: Option<(Triple, Triple)>) -> Option<Triple> {
        match self {
            Self::Nothing => None,
            Self::Force(force) => Some(force),
            Self::Spring { stiffness, damping } => {
                reading.map(|(position, velocity)| std::array::from_fn(|axis| -stiffness * position[axis] - damping * velocity[axis]))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_pulls_to_the_origin_and_brakes() {
        let reading = Some(([0.01, 0.0, -0.02], [0.0, 0.1, 0.0]));
        assert_eq!(Push::of(None, Some(100.0), 5.0, 1.0).unwrap().wants(reading), Some([-1.0, -0.5, 2.0]));
        assert_eq!(Push::of(None, Some(100.0), 5.0, 1.0).unwrap().wants(None), None);
    }

    #[test]
    fn a_force_needs_no_reading_and_stays_within_the_limit() {
        let force = |limit| Push::of(Some(Force([0.0, 0.6, 0.8])), None, 0.0, limit);
        assert_eq!(force(1.0).unwrap().wants(None), Some([0.0, 0.6, 0.8]));
        assert!(force(0.99).is_err());
        assert_eq!(Push::of(None, None, 0.0, 1.0).unwrap().wants(Some(([1.0; 3], [1.0; 3]))), None);
    }
}
