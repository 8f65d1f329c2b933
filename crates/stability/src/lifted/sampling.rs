//! Numbers of a sample among the unknowns of a frame: one number if all laws use the same combination of position and velocity, otherwise both.

use cohaptic_peer::Gains;

use crate::linear_form::LawRow;

/// Numbers of a sample among the unknowns.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Sampling {
    /// The combination (K·x + B·v)/(K + B/time), a length, for these gains K and B.
    Combined(Gains),
    /// Position, and velocity multiplied by the common time.
    Whole,
}

impl Sampling {
    /// Returns the count of numbers in a sample.
    pub const fn channels(self) -> usize {
        match self {
            Self::Combined(_) => 1,
            Self::Whole => 2,
        }
    }

    /// Returns whether samples have no effect on the motion.
    pub fn is_silent(self, time: f64) -> bool {
        self.unit(time) <= 0.0
    }

    /// Returns the factors of the copy's position and velocity in number `channel` of a sample; velocities are multiplied by `time` \[s\].
    pub fn shares(self, channel: usize, time: f64) -> (f64, f64) {
        match (self, channel) {
            (Self::Combined(_), _) if self.is_silent(time) => (0.0, 0.0),
            (Self::Combined(Gains { stiffness, damping }), _) => {
                let unit = self.unit(time);
                (stiffness / unit, damping / time / unit)
            }
            (Self::Whole, 0) => (1.0, 0.0),
            (Self::Whole, _) => (0.0, 1.0),
        }
    }

    /// Returns the factors of position and velocity as [`Sampling::shares`], but for a combined number without the division by K + B/time [N/m].
    pub(crate) fn gains(self, channel: usize, time: f64) -> (f64, f64) {
        match self {
            Self::Combined(Gains { stiffness, damping }) => (stiffness, damping / time),
            Self::Whole => self.shares(channel, time),
        }
    }

    /// Converts the coefficient of a number from the scale of [`Sampling::shares`] to the scale of [`Sampling::gains`].
    pub(crate) fn of_gains(self, heard: f64, time: f64) -> f64 {
        let unit = self.unit(time);
        if unit > 0.0 && unit.is_finite() { heard / unit } else { 1.0 }
    }

    /// Returns the distance by which a translation of everything by 1 moves number `channel` of a sample.
    pub fn translation(self, channel: usize, time: f64) -> f64 {
        self.shares(channel, time).0
    }

    /// Returns the factor of number `channel` of a sample of age `age` \[s\] in the heard force of a row of a law [N/m].
    pub(crate) fn heard(self, row: &LawRow, channel: usize, age: f64, time: f64) -> f64 {
        match (self, channel) {
            // All rows hear multiples of one combination. The factor of the multiple comes from whichever of its gains is not zero.
            (Self::Combined(gains), _) if row.heard == gains => self.unit(time),
            (Self::Combined(gains), _) if gains.stiffness != 0.0 => self.unit(time) * (row.heard.stiffness / gains.stiffness),
            (Self::Combined(gains), _) if gains.damping != 0.0 => self.unit(time) * (row.heard.damping / gains.damping),
            (Self::Combined(_), _) => 0.0,
            (Self::Whole, 0) => row.heard.stiffness,
            (Self::Whole, _) => (row.heard.damping + row.ahead * age) / time,
        }
    }

    /// Returns the divisor by which a combined number becomes a length [N/m]; 1 for whole samples.
    fn unit(self, time: f64) -> f64 {
        match self {
            Self::Combined(Gains { stiffness, damping }) => stiffness + damping / time,
            Self::Whole => 1.0,
        }
    }
}
