//! Force gate: from a wanted force to motor counts.

use cohaptic_device::{Gate, Limits, LimitsError, Stopper};
use cohaptic_units::Instant;

use super::MotorCounts;
use crate::calibration::Calibration;
use crate::kinematics::{Jacobian, Triple};

/// State of the device at the time of a packet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// Time of the packet.
    pub now: Instant,
    /// `true` if the homing of the device is confirmed.
    pub homed: bool,
    /// `true` if the user has switched forces on, by a pull of the grip.
    pub armed: bool,
    /// Arrival of the last report; `None` before the first report.
    pub reading_at: Option<Instant>,
    /// Time at which the force was asked for; `None` without a setpoint.
    pub setpoint_at: Option<Instant>,
    /// Position of the grip in the frame of the device \[m\]; `None` while unknown.
    pub position: Option<Triple>,
}

/// Reason why a force became zero, in the order of the checks.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum ZeroCause {
    /// The [`Gate`] of every device admitted no force. A Falcon that is not ready is not homed.
    Gate(cohaptic_device::ZeroCause),
    /// No torques can make a force at the position of the grip.
    NoTorques,
}

impl ZeroCause {
    /// All causes, in the order of the checks.
    pub const ALL: [Self; cohaptic_device::ZeroCause::ALL.len() + 1] = {
        let mut all = [Self::NoTorques; cohaptic_device::ZeroCause::ALL.len() + 1];
        let mut place = 0;
        while place < cohaptic_device::ZeroCause::ALL.len() {
            all[place] = Self::Gate(cohaptic_device::ZeroCause::ALL[place]);
            place += 1;
        }
        all
    };

    /// Returns the index in [`ZeroCause::ALL`].
    #[must_use]
    pub(crate) const fn index(self) -> usize {
        match self {
            Self::Gate(cause) => cause.index(),
            Self::NoTorques => cohaptic_device::ZeroCause::ALL.len(),
        }
    }

    /// Returns the name in a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            // A user of a Falcon knows homing, not readiness.
            Self::Gate(cohaptic_device::ZeroCause::NotReady) => "not homed",
            Self::Gate(cause) => cause.name(),
            Self::NoTorques => "no torques",
        }
    }
}

/// Changes of a force that went out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Changes {
    /// The force was too large.
    pub limited: bool,
    /// The force changed too fast.
    pub slewed: bool,
    /// A motor could not give its part. All three torques were lowered by the same factor, so that the direction of the force stays.
    pub saturated: bool,
}

/// Decision of the gate on a force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// The force went out with these changes.
    Out(Changes),
    /// The force became zero.
    Zero(ZeroCause),
}

/// Result of the gate for a packet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Admitted {
    /// Admitted force \[N\], before the limit of the motors.
    pub force: Triple,
    /// Motor counts of the force.
    pub motors: MotorCounts,
    /// Decision on the wanted force.
    pub verdict: Verdict,
}

/// Gate of a Falcon: the [`Gate`] of every device, and the torques of each admitted force.
///
/// A force passes if the [`Gate`] admits it, and if torques can make the force at the position of the grip. The torques are lowered if a motor would exceed its
/// limit.
#[derive(Debug)]
pub struct ForceGate {
    gate: Gate,
    calibration: Calibration,
}

impl ForceGate {
    /// Returns a gate that has admitted no force yet.
    ///
    /// # Errors
    ///
    /// [`LimitsError`] for a limit out of range.
    pub fn new(limits: Limits, calibration: Calibration) -> Result<Self, LimitsError> {
        Ok(Self { gate: Gate::new(limits, Stopper::default())?, calibration })
    }

    /// Stops the gate: every later force is zero. A stopped gate cannot be started again.
    pub fn stop(&mut self) {
        self.gate.stop();
    }

    /// Returns whether the gate was stopped.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.gate.is_stopped()
    }

    /// Returns the handle that stops the gate from any thread.
    #[must_use]
    pub const fn stopper(&self) -> &Stopper {
        self.gate.stopper()
    }

    /// Returns the force and the motor counts for the wanted force `wanted` \[N\]. Must be called once per packet, because the calls measure the time between
    /// packets.
    pub fn admit(&mut self, wanted: Triple, moment: &Moment) -> Admitted {
        let Moment { now, homed, armed, reading_at, setpoint_at, position } = *moment;
        let admitted = self.gate.admit(wanted, &cohaptic_device::Moment { now, ready: homed, armed, reading_at, setpoint_at });
        let changes = match admitted.verdict {
            cohaptic_device::Verdict::Zero(cause) => return Self::zero(ZeroCause::Gate(cause)),
            cohaptic_device::Verdict::Out(changes) => changes,
        };
        let motors = position.and_then(Jacobian::at).and_then(|jacobian| MotorCounts::of(admitted.force, &jacobian, &self.calibration));
        let Some((motors, saturated)) = motors else {
            // Zero goes out in place of the admitted force, so the next force grows from zero.
            self.gate.withdraw(now);
            return Self::zero(ZeroCause::NoTorques);
        };
        let cohaptic_device::Changes { limited, slewed } = changes;
        Admitted { force: admitted.force.newtons(), motors, verdict: Verdict::Out(Changes { limited, slewed, saturated }) }
    }

    const fn zero(cause: ZeroCause) -> Admitted {
        Admitted { force: [0.0; 3], motors: MotorCounts::ZERO, verdict: Verdict::Zero(cause) }
    }
}
