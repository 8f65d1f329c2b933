//! Gate: from a wanted force to an admitted force.

use cohaptic_units::Instant;

use crate::{GatedForce, Limits, LimitsError, Stopper};

/// Knowledge about device and setpoint at the time of a force. All instants are on one clock.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    /// Time of the force.
    pub now: Instant,
    /// `true` if positions of the device have a meaning, for example after homing.
    pub ready: bool,
    /// `true` if the user has switched forces on.
    pub armed: bool,
    /// Arrival of the last reading; `None` before the first reading.
    pub reading_at: Option<Instant>,
    /// Time at which the force was asked for; `None` without a setpoint.
    pub setpoint_at: Option<Instant>,
}

/// Reason why a force became zero, in the order of the checks.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum ZeroCause {
    /// The gate was stopped, which is final.
    Stopped,
    /// The device is not ready, so its position has no meaning.
    NotReady,
    /// The user has not switched forces on.
    NotArmed,
    /// The last reading is too old, or no reading has arrived.
    StaleReading,
    /// The last setpoint is too old, or no setpoint was given.
    StaleSetpoint,
    /// The loop has paused too long.
    LoopLate,
    /// A component of the force is infinite or NaN.
    NotFinite,
}

impl ZeroCause {
    /// All causes, in the order of the checks.
    pub const ALL: [Self; 7] =
        [Self::Stopped, Self::NotReady, Self::NotArmed, Self::StaleReading, Self::StaleSetpoint, Self::LoopLate, Self::NotFinite];

    /// Returns the index in [`ZeroCause::ALL`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Returns the name in a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stopped => "stopped",
            Self::NotReady => "not ready",
            Self::NotArmed => "not armed",
            Self::StaleReading => "stale reading",
            Self::StaleSetpoint => "stale setpoint",
            Self::LoopLate => "loop late",
            Self::NotFinite => "not finite",
        }
    }
}

/// Changes of a force that was admitted.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Changes {
    /// The force was too large.
    pub limited: bool,
    /// The force changed too fast.
    pub slewed: bool,
}

/// Decision of the gate on a force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// The force was admitted with these changes.
    Out(Changes),
    /// The force became zero.
    Zero(ZeroCause),
}

/// Result of the gate for a force.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Admitted {
    /// Admitted force.
    pub force: GatedForce,
    /// Decision on the wanted force.
    pub verdict: Verdict,
}

/// Gate of forces, and the only source of [`GatedForce`]s other than zero.
///
/// A force passes if the device is ready and armed, reading and setpoint are fresh, the loop is on time, and every number is finite. Otherwise the force is
/// zero at once. A passed force is shortened to the largest force, and its change since the last force is shortened to the fastest change. After zero, the
/// force grows from zero at most as fast as the limit of change allows.
///
/// Each loop that sends forces owns a gate, on the clock of the loop. A driver whose thread exchanges packets at its own rate asks a gate for each packet, in
/// addition to the gate of the session: only the thread knows the age of the device's last answer and of the session's last force.
#[derive(Debug)]
pub struct Gate {
    limits: Limits,
    stopper: Stopper,
    /// Last admitted force \[N\].
    last: [f64; 3],
    last_at: Option<Instant>,
}

impl Gate {
    /// Returns a gate that has admitted no force yet, and that `stopper` stops.
    ///
    /// # Errors
    ///
    /// [`LimitsError`] for a limit out of range.
    pub fn new(limits: Limits, stopper: Stopper) -> Result<Self, LimitsError> {
        Ok(Self { limits: limits.checked()?, stopper, last: [0.0; 3], last_at: None })
    }

    /// Stops the gate and all that share its stopper: every later force is zero. A stopped gate cannot be started again.
    pub fn stop(&mut self) {
        self.stopper.stop();
        self.last = [0.0; 3];
    }

    /// Returns whether the gate was stopped.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopper.is_stopped()
    }

    /// Returns the stopper of the gate.
    #[must_use]
    pub const fn stopper(&self) -> &Stopper {
        &self.stopper
    }

    /// Returns the limits of the gate.
    #[must_use]
    pub const fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Returns the force that may be given for the wanted force on the hand `wanted` \[N\]. Must be called once per turn of the loop, also without a setpoint,
    /// because the calls measure the time between turns.
    pub fn admit(&mut self, wanted: [f64; 3], moment: &Moment) -> Admitted {
        let since = self.last_at.map(|last| moment.now.saturating_duration_since(last));
        // Noted for a zero force too, because the gap is between turns of the loop, not between forces.
        self.last_at = Some(moment.now);
        if let Some(cause) = self.zero_cause(wanted, moment, since.is_some_and(|since| since > self.limits.gap)) {
            self.last = [0.0; 3];
            return Admitted { force: GatedForce::ZERO, verdict: Verdict::Zero(cause) };
        }
        self.limited(wanted, since.map_or(0.0, |since| since.as_secs_f64()))
    }

    /// Tells that the driver gave zero at `now`, in place of the force admitted last or without a force to admit: the next force grows from zero, from `now`
    /// on. Counts as a turn of the loop.
    pub const fn withdraw(&mut self, now: Instant) {
        self.last = [0.0; 3];
        self.last_at = Some(now);
    }

    /// Returns the first reason for zero force.
    fn zero_cause(&self, wanted: [f64; 3], moment: &Moment, late: bool) -> Option<ZeroCause> {
        // An instant in the future is not fresh either: a clock that jumps back must not keep an old force.
        let fresh = |at: Option<Instant>, age| at.and_then(|at| moment.now.checked_duration_since(at)).is_some_and(|passed| passed <= age);
        let checks = [
            (self.is_stopped(), ZeroCause::Stopped),
            (!moment.ready, ZeroCause::NotReady),
            (!moment.armed, ZeroCause::NotArmed),
            (!fresh(moment.reading_at, self.limits.reading_age), ZeroCause::StaleReading),
            (!fresh(moment.setpoint_at, self.limits.setpoint_age), ZeroCause::StaleSetpoint),
            (late, ZeroCause::LoopLate),
            (!wanted.iter().all(|part| part.is_finite()), ZeroCause::NotFinite),
        ];
        // The first failing check names the cause, so the order of `checks` is the order of `ZeroCause`.
        checks.into_iter().find(|(fails, _)| *fails).map(|(_, cause)| cause)
    }

    /// Applies the limits of size and change to a force that passed the checks, `passed` seconds after the last call.
    fn limited(&mut self, wanted: [f64; 3], passed: f64) -> Admitted {
        let mut changes = Changes::default();
        // Size first, then change: the change is measured to a force that is itself admissible.
        let wanted = shortened(wanted, self.limits.force, &mut changes.limited);
        // Both ends of the change lie in the ball of the largest force, and so do all points between them.
        let change = core::array::from_fn(|axis| wanted[axis] - self.last[axis]);
        let change = shortened(change, self.limits.slew * passed, &mut changes.slewed);
        self.last = core::array::from_fn(|axis| self.last[axis] + change[axis]);
        Admitted { force: GatedForce(self.last), verdict: Verdict::Out(changes) }
    }
}

/// Returns the vector, shortened to the length `longest` if it is longer.
fn shortened(vector: [f64; 3], longest: f64, changed: &mut bool) -> [f64; 3] {
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
