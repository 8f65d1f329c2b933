//! The status of a device.

use cohaptic_units::Instant;

use crate::kinematics::Triple;
use crate::protocol::{Buttons, Leds};
use crate::safety::{MotorCounts, Verdict, ZeroCause};

/// Where a device stands on its way to giving force.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Phase {
    /// No report has come yet.
    #[default]
    Silent,
    /// Not homed: pull the grip fully out, then push it fully in. Red.
    Homing,
    /// Homed, and forces are off: pull the grip out to switch them on. Blue.
    Homed,
    /// Homed, and forces asked for go out. Green.
    Active,
    /// Stopped: no force any more. Red.
    Stopped,
}

impl Phase {
    /// In a word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Silent => "silent",
            Self::Homing => "homing",
            Self::Homed => "homed",
            Self::Active => "active",
            Self::Stopped => "stopped",
        }
    }

    /// The lights that show it.
    #[must_use]
    pub const fn leds(self) -> Leds {
        match self {
            Self::Silent | Self::Homing | Self::Stopped => Leds::RED,
            Self::Homed => Leds::BLUE,
            Self::Active => Leds::GREEN,
        }
    }
}

/// A force that somebody wants, and when.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Setpoint {
    /// The force on the grip \[N\].
    pub force: Triple,
    /// When it was asked for, on the transport's clock.
    pub at: Instant,
}

/// Where the grip was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reading {
    /// When the report came, on the transport's clock.
    pub at: Instant,
    /// Position \[m\] from the calibration's origin.
    pub position: Triple,
    /// Velocity \[m/s\], estimated by a [`VelocityFilter`](super::VelocityFilter).
    pub velocity: Triple,
}

/// The status after an exchange.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Status {
    /// Where the device stands.
    pub phase: Phase,
    /// Whether the device is homed and the user has switched forces on since: then forces asked for go out.
    pub armed: bool,
    /// Which encoders the device says are homed; none before its first report.
    pub homed: [bool; 3],
    /// The last counts of the encoders.
    pub encoders: [i16; 3],
    /// Which buttons are pressed.
    pub buttons: Buttons,
    /// Where the grip is; `None` unless the device is homed beyond doubt.
    pub reading: Option<Reading>,
    /// The force that went out \[N\].
    pub force: Triple,
    /// Its motor counts.
    pub motors: MotorCounts,
    /// What became of the force that was asked for.
    pub verdict: Verdict,
}

impl Status {
    /// Before the first exchange: nothing is known, and nothing is homed.
    pub(super) const UNKNOWN: Self = Self {
        phase: Phase::Silent,
        armed: false,
        homed: [false; 3],
        encoders: [0; 3],
        buttons: Buttons::NONE,
        reading: None,
        force: [0.0; 3],
        motors: MotorCounts::ZERO,
        verdict: Verdict::Zero(ZeroCause::NotHomed),
    };
}
