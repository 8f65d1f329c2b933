//! What of a sample takes part: one number, where all that hears it uses the same combination of position and velocity, or both.

use cohaptic_peer::Gains;

use crate::linear_form::LawRow;

/// Which numbers of a sample are unknowns of their own.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Sampling {
    /// (K·x + B·v)/(K + B/time), a length, of these gains K and B.
    Combined(Gains),
    /// Position, and velocity multiplied by the common time.
    Whole,
}

impl Sampling {
    /// How many numbers of a sample there are.
    pub const fn channels(self) -> usize {
        match self {
            Self::Combined(_) => 1,
            Self::Whole => 2,
        }
    }

    /// Whether samples have no part in the motion.
    pub fn is_silent(self, time: f64) -> bool {
        self.unit(time) <= 0.0
    }

    /// What position and velocity of a copy are multiplied by in that number of a sample, where velocities are multiplied by `time`.
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

    /// As [`Sampling::shares`], of a combined number before it is divided to be a length \[N\].
    pub fn gains(self, channel: usize, time: f64) -> (f64, f64) {
        match self {
            Self::Combined(Gains { stiffness, damping }) => (stiffness, damping / time),
            Self::Whole => self.shares(channel, time),
        }
    }

    /// The coefficient of a number in the scale of [`Sampling::gains`], from its coefficient in the scale of [`Sampling::shares`].
    pub(crate) fn of_gains(self, heard: f64, time: f64) -> f64 {
        let unit = self.unit(time);
        if unit > 0.0 && unit.is_finite() { heard / unit } else { 1.0 }
    }

    /// How far a translation of everything by 1 moves that number of a sample.
    pub fn translation(self, channel: usize, time: f64) -> f64 {
        self.shares(channel, time).0
    }

    /// What that number of a sample of that age \[s\] is multiplied by in what a row of a law hears \[N\].
    pub fn heard(self, row: &LawRow, channel: usize, age: f64, time: f64) -> f64 {
        match (self, channel) {
            (Self::Combined(gains), _) if row.heard == gains => self.unit(time),
            (Self::Combined(gains), _) if gains.stiffness != 0.0 => self.unit(time) * (row.heard.stiffness / gains.stiffness),
            (Self::Combined(gains), _) if gains.damping != 0.0 => self.unit(time) * (row.heard.damping / gains.damping),
            (Self::Combined(_), _) => 0.0,
            (Self::Whole, 0) => row.heard.stiffness,
            (Self::Whole, _) => (row.heard.damping + row.ahead * age) / time,
        }
    }

    /// What a sample is divided by [N/m].
    fn unit(self, time: f64) -> f64 {
        match self {
            Self::Combined(Gains { stiffness, damping }) => stiffness + damping / time,
            Self::Whole => 1.0,
        }
    }
}
