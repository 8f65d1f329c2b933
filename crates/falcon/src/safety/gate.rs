//! From a force that somebody wants to counts that the motors may get.

use cohaptic_units::Instant;

use super::{Limits, LimitsError, MotorCounts};
use crate::calibration::{Calibration, MOTOR_LIMIT};
use crate::kinematics::{Jacobian, Triple};

/// The state of the device at the moment at which a force is to go out.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// Now.
    pub now: Instant,
    /// Whether the device is homed, beyond doubt.
    pub homed: bool,
    /// Whether the user has switched forces on, by pulling the grip out.
    pub armed: bool,
    /// When the device last reported.
    pub reading_at: Option<Instant>,
    /// When the force was asked for.
    pub setpoint_at: Option<Instant>,
    /// Where the grip is, in the frame of the device \[m\].
    pub position: Option<Triple>,
}

/// Why a force became zero. Checked in this order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum ZeroCause {
    /// The gate was stopped; that is for good.
    Stopped,
    /// The device is not homed: where the grip is means nothing.
    NotHomed,
    /// The user has not switched forces on.
    NotArmed,
    /// The last report is too old, or there was none.
    StaleReading,
    /// The last setpoint is too old, or there was none.
    StaleSetpoint,
    /// The loop paused too long.
    LoopLate,
    /// Not a number, or infinite.
    NotFinite,
    /// No torques make a force where the grip is.
    NoTorques,
}

impl ZeroCause {
    /// All of them, in their order.
    pub const ALL: [Self; 8] =
        [Self::Stopped, Self::NotHomed, Self::NotArmed, Self::StaleReading, Self::StaleSetpoint, Self::LoopLate, Self::NotFinite, Self::NoTorques];

    /// Its place among [`ZeroCause::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// In a few words.
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

/// What was taken from a force that went out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Changes {
    /// It was too large.
    pub limited: bool,
    /// It changed too fast.
    pub slewed: bool,
    /// A motor could not give its part; all three were lowered alike, so that the direction stays.
    pub saturated: bool,
}

/// What became of a force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// It went out, with these changes.
    Out(Changes),
    /// It became zero.
    Zero(ZeroCause),
}

/// What the gate let through.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Admitted {
    /// The force \[N\], before the motors' own limit.
    pub force: Triple,
    /// The counts.
    pub motors: MotorCounts,
    /// What became of what was asked for.
    pub verdict: Verdict,
}

/// The only maker of [`MotorCounts`].
///
/// A force passes if the device is homed, its report and the force itself are fresh, the loop is on time and every number is finite; otherwise it is zero, at
/// once. What passes is cut to the largest force, then its change since the last one is cut to the fastest change, then turned into torques, and lowered
/// if a motor would have to give more than it can. After zero, force comes back from zero, as fast as the limit of change allows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ForceGate {
    limits: Limits,
    calibration: Calibration,
    last: Triple,
    last_at: Option<Instant>,
    stopped: bool,
}

impl ForceGate {
    /// A gate that has let nothing through yet.
    ///
    /// # Errors
    ///
    /// [`LimitsError`] if a limit makes no sense.
    pub fn new(limits: Limits, calibration: Calibration) -> Result<Self, LimitsError> {
        Ok(Self { limits: limits.checked()?, calibration, last: [0.0; 3], last_at: None, stopped: false })
    }

    /// Lets nothing through any more. There is no way back: make another gate.
    pub const fn stop(&mut self) {
        self.stopped = true;
        self.last = [0.0; 3];
    }

    /// Whether it was stopped.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// The limits.
    #[must_use]
    pub const fn limits(&self) -> &Limits {
        &self.limits
    }

    /// What the motors are told when somebody wants `wanted` \[N\]. Call it once for each packet that goes out.
    pub fn admit(&mut self, wanted: Triple, moment: &Moment) -> Admitted {
        let since = self.last_at.map(|last| moment.now.saturating_duration_since(last));
        self.last_at = Some(moment.now);
        match self.checked(wanted, moment, since.is_some_and(|since| since > self.limits.gap)) {
            Err(cause) => {
                self.last = [0.0; 3];
                Admitted { force: [0.0; 3], motors: MotorCounts::ZERO, verdict: Verdict::Zero(cause) }
            }
            Ok(jacobian) => self.limited(wanted, &jacobian, since.map_or(0.0, |since| since.as_secs_f64())),
        }
    }

    fn checked(&self, wanted: Triple, moment: &Moment, late: bool) -> Result<Jacobian, ZeroCause> {
        // What lies in the future is no fresher than what lies in the past: a clock that jumps must not keep a force alive.
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
        if let Some((_, cause)) = checks.into_iter().find(|(fails, _)| *fails) {
            return Err(cause);
        }
        moment.position.and_then(Jacobian::at).ok_or(ZeroCause::NoTorques)
    }

    fn limited(&mut self, wanted: Triple, jacobian: &Jacobian, passed: f64) -> Admitted {
        let mut changes = Changes::default();
        let wanted = shortened(wanted, self.limits.force, &mut changes.limited);
        // Both ends lie in the ball of the largest force, so what lies between them does as well.
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

    fn counts(&self, force: Triple, jacobian: &Jacobian, saturated: &mut bool) -> Option<MotorCounts> {
        let counts = jacobian.torques(force)?.map(|torque| -self.calibration.counts_per_newton_metre() * torque);
        let largest = counts.iter().fold(0.0_f64, |largest, count| largest.max(count.abs()));
        let limit = f64::from(MOTOR_LIMIT);
        *saturated = largest > limit;
        let scale = if *saturated { limit / largest } else { 1.0 };
        counts.iter().all(|count| count.is_finite()).then(|| MotorCounts(counts.map(|count| whole(count * scale))))
    }
}

fn shortened(vector: Triple, longest: f64, changed: &mut bool) -> Triple {
    // Squares of components that are finite may be infinite; hypot's are not.
    let length = libm::hypot(libm::hypot(vector[0], vector[1]), vector[2]);
    if length <= longest {
        return vector;
    }
    *changed = true;
    if length.is_finite() {
        vector.map(|part| part / length * longest)
    } else {
        // Finite parts of a vector too long for a number.
        shortened(vector.map(|part| part * 0.25), longest, changed)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "clamped to what a motor takes")]
fn whole(count: f64) -> i16 {
    libm::rint(count).clamp(-f64::from(MOTOR_LIMIT), f64::from(MOTOR_LIMIT)) as i16
}
