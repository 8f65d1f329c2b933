//! The status of a device.

use cohaptic_units::Instant;

use crate::kinematics::Triple;
use crate::protocol::{Buttons, Leds};
use crate::safety::{MotorCounts, Verdict, ZeroCause};

/// Progress of a device towards giving force.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Phase {
    /// No report has arrived yet.
    #[default]
    Silent,
    /// The device is not homed: the user must pull the grip fully out, then push it fully in. Red.
    Homing,
    /// The device is homed, and forces are off: the user must pull the grip out to switch them on. Blue.
    Homed,
    /// The device is homed, and forces go out. Green.
    Active,
    /// The driver is stopped, and gives no more force. Red.
    Stopped,
}

impl Phase {
    /// Returns the name of the phase, a single word, as in messages and files.
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

    /// Returns the lights of the phase.
    #[must_use]
    pub const fn leds(self) -> Leds {
        match self {
            Self::Silent | Self::Homing | Self::Stopped => Leds::RED,
            Self::Homed => Leds::BLUE,
            Self::Active => Leds::GREEN,
        }
    }
}

/// A wanted force and its time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Setpoint {
    /// Force on the grip \[N\].
    pub force: Triple,
    /// Time at which the force was asked for, on the transport's clock.
    pub at: Instant,
}

/// Position and velocity of the grip at a report.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reading {
    /// Arrival of the report, on the transport's clock.
    pub at: Instant,
    /// Position \[m\] relative to the calibration's origin.
    pub position: Triple,
    /// Velocity \[m/s\], estimated by a low-pass filter of the bandwidth [`DriverConfig::velocity_bandwidth`](super::DriverConfig::velocity_bandwidth).
    pub velocity: Triple,
}

/// Status of a device after an exchange.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Status {
    /// Phase of the device.
    pub phase: Phase,
    /// `true` if the device is homed and the user has switched forces on since then, so that forces go out.
    pub armed: bool,
    /// `true` for each encoder that is homed, as reported by the device. All `false` before the first report.
    pub homed: [bool; 3],
    /// Counts of the encoders in the last report.
    pub encoders: [i16; 3],
    /// Pressed buttons.
    pub buttons: Buttons,
    /// Position and velocity of the grip; `None` unless homing is confirmed.
    pub reading: Option<Reading>,
    /// Force of the last packet \[N\].
    pub force: Triple,
    /// Motor counts of the last packet.
    pub motors: MotorCounts,
    /// Verdict of the gate on the wanted force.
    pub verdict: Verdict,
}

impl Status {
    /// Status before the first exchange, with nothing homed.
    pub(super) const UNKNOWN: Self = Self {
        phase: Phase::Silent,
        armed: false,
        homed: [false; 3],
        encoders: [0; 3],
        buttons: Buttons::NONE,
        reading: None,
        force: [0.0; 3],
        motors: MotorCounts::ZERO,
        verdict: Verdict::Zero(ZeroCause::Gate(cohaptic_device::ZeroCause::NotReady)),
    };
}
