//! Force gate: from a wanted force to motor counts.

use cohaptic_units::Instant;

use super::{Limits, LimitsError, MotorCounts};
use crate::calibration::{Calibration, MOTOR_LIMIT};
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
    /// The gate was stopped, which is final.
    Stopped,
    /// The device is not homed, so the position of the grip has no meaning.
    NotHomed,
    /// The user has not switched forces on.
    NotArmed,
    /// The last report is too old, or no report has arrived.
    StaleReading,
    /// The last setpoint is too old, or no setpoint was given.
    StaleSetpoint,
    /// The loop has paused too long.
    LoopLate,
    /// A component of the force is infinite or NaN.
    NotFinite,
    /// No torques can make a force at the position of the grip.
    NoTorques,
}

impl ZeroCause {
    /// All causes, in the order of the checks.
    pub const ALL: [Self; 8] =
        [Self::Stopped, Self::NotHomed, Self::NotArmed, Self::StaleReading, Self::StaleSetpoint, Self::LoopLate, Self::NotFinite, Self::NoTorques];

    /// Returns the index in [`ZeroCause::ALL`].
    #[must_use]
    pub(crate) const fn index(self) -> usize {
        self as usize
    }

    /// Returns the name in a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stopped => "stopped",
            Self::NotHomed => "not homed",
            Self::NotArmed => "not armed",
            Self::StaleReading => "stale reading",
            Self::StaleSetpoint => "stale setpoint",
            Self::LoopLate => "loop late",
            Self::NotFinite => "not finite",
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

/// The only source of [`MotorCounts`].
///
/// A force passes if the device is homed, its report and the setpoint are fresh, the loop is on time, and every number is finite. Otherwise the force is zero
/// at once. A passed force is shortened to the largest force, its change since the last force is shortened to the fastest change, and its torques are lowered
/// if a motor would exceed its limit. After zero, the force grows from zero at most as fast as the limit of change allows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ForceGate {
    limits: Limits,
    calibration: Calibration,
    last: Triple,
    last_at: Option<Instant>,
    stopped: bool,
}

impl ForceGate {
    /// Returns a gate that has admitted no force yet.
    ///
    /// # Errors
    ///
    /// [`LimitsError`] for a limit out of range.
    pub fn new(limits: Limits, calibration: Calibration) -> Result<Self, LimitsError> {
        Ok(Self { limits: limits.checked()?, calibration, last: [0.0; 3], last_at: None, stopped: false })
    }

    /// Stops the gate: every later force is zero. A stopped gate cannot be started again.
    pub const fn stop(&mut self) {
        self.stopped = true;
        self.last = [0.0; 3];
    }

    /// Returns whether the gate was stopped.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Returns the force and the motor counts for the wanted force `wanted` \[N\]. Must be called once per packet, because the calls measure the time between
    /// packets.
    pub fn admit(&mut self, wanted: Triple, moment: &Moment) -> Admitted {
        let since = self.last_at.map(|last| moment.now.saturating_duration_since(last));
        // Also for a zero force: the gap is between packets, not between forces.
        self.last_at = Some(moment.now);
        match self.checked(wanted, moment, since.is_some_and(|since| since > self.limits.gap)) {
            Err(cause) => {
                // After zero, the limit of change starts from zero force.
                self.last = [0.0; 3];
                Admitted { force: [0.0; 3], motors: MotorCounts::ZERO, verdict: Verdict::Zero(cause) }
            }
            Ok(jacobian) => self.limited(wanted, &jacobian, since.map_or(0.0, |since| since.as_secs_f64())),
        }
    }

    /// Returns the Jacobian at the grip, or the first reason for zero force.
    fn checked(&self, wanted: Triple, moment: &Moment, late: bool) -> Result<Jacobian, ZeroCause> {
        // An instant in the future is not fresh either: a clock that jumps back must not keep an old force.
        let fresh = |at: Option<Instant>, age| at.and_then(|at| moment.now.checked_duration_since(at)).is_some_and(|passed| passed <= age);
        let checks = [
            (self.stopped, ZeroCause::Stopped),
            (!moment.homed, ZeroCause::NotHomed),
            (!moment.armed, ZeroCause::NotArmed),
            (!fresh(moment.reading_at, self.limits.reading_age), ZeroCause::StaleReading),
            (!fresh(moment.setpoint_at, self.limits.setpoint_age), ZeroCause::StaleSetpoint),
            (late, ZeroCause::LoopLate),
            (!wanted.iter().all(|part| part.is_finite()), ZeroCause::NotFinite),
        ];
        // The first failing check names the cause, so the order of `checks` is the order of `ZeroCause`.
        if let Some((_, cause)) = checks.into_iter().find(|(fails, _)| *fails) {
            return Err(cause);
        }
        moment.position.and_then(Jacobian::at).ok_or(ZeroCause::NoTorques)
    }

    /// Applies the limits of size, change and motors to a force that passed the checks.
    fn limited(&mut self, wanted: Triple, jacobian: &Jacobian, passed: f64) -> Admitted {
        let mut changes = Changes::default();
        // Size first, then change: the change is measured to a force that is itself admissible.
        let wanted = shortened(wanted, self.limits.force, &mut changes.limited);
        // Both ends of the change lie in the ball of the largest force, and so do all points between them.
        let change = core::array::from_fn(|axis| wanted[axis] - self.last[axis]);
        let change = shortened(change, self.limits.slew * passed, &mut changes.slewed);
        let force = core::array::from_fn(|axis| self.last[axis] + change[axis]);
        let Some(motors) = self.counts(force, jacobian, &mut changes.saturated) else {
            self.last = [0.0; 3];
            return Admitted { force: [0.0; 3], motors: MotorCounts::ZERO, verdict: Verdict::Zero(ZeroCause::NoTorques) };
        };
        self.last = force;
        Admitted { force, motors, verdict: Verdict::Out(changes) }
    }

    /// Returns the motor counts of a force; `None` for a force without torques.
    fn counts(&self, force: Triple, jacobian: &Jacobian, saturated: &mut bool) -> Option<MotorCounts> {
        // A positive count turns an arm backwards, hence the sign.
        let counts = jacobian.torques(force)?.map(|torque| -self.calibration.counts_per_newton_metre() * torque);
        let largest = counts.iter().fold(0.0_f64, |largest, count| largest.max(count.abs()));
        let limit = f64::from(MOTOR_LIMIT);
        *saturated = largest > limit;
        // One factor for all motors keeps the direction of the force.
        let scale = if *saturated { limit / largest } else { 1.0 };
        counts.iter().all(|count| count.is_finite()).then(|| MotorCounts(counts.map(|count| whole(count * scale))))
    }
}

/// Returns the vector, shortened to the length `longest` if it is longer.
fn shortened(vector: Triple, longest: f64, changed: &mut bool) -> Triple {
    // Squares of finite components can overflow; hypot does not square them.
    let length = libm::hypot(libm::hypot(vector[0], vector[1]), vector[2]);
    if length <= longest {
        return vector;
    }
    *changed = true;
    if length.is_finite() {
        vector.map(|part| part / length * longest)
    } else {
        // The components are finite, but the length overflows: a quarter of the vector has the same direction.
        shortened(vector.map(|part| part * 0.25), longest, changed)
    }
}

/// Rounds a count to the nearest integer within the limit of a motor.
#[expect(clippy::cast_possible_truncation, reason = "clamped to what a motor takes")]
fn whole(count: f64) -> i16 {
    libm::rint(count).clamp(-f64::from(MOTOR_LIMIT), f64::from(MOTOR_LIMIT)) as i16
}
