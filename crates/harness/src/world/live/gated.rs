//! Device in a person's hand, with the gate of the session.

use std::time::Duration;

use cohaptic_device::{Device, Gate, GatedForce, Limits, Moment, Reading, Verdict, ZeroCause};
use cohaptic_units::Instant;

/// Forces of the session that a gate changed or made zero, since the start.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct GateStats {
    /// Forces that became zero, indexed as in [`ZeroCause::ALL`].
    pub zeroed: [u64; ZeroCause::ALL.len()],
    /// Forces shortened to the greatest force of the device.
    pub limited: u64,
    /// Forces with a change shortened to the fastest change.
    pub slewed: u64,
}

impl GateStats {
    /// Returns the causes for which forces became zero, with their numbers, in the order of the checks.
    pub fn causes(&self) -> impl Iterator<Item = (ZeroCause, u64)> + use<> {
        ZeroCause::ALL.into_iter().zip(self.zeroed).filter(|(_, count)| *count > 0)
    }

    fn count(&mut self, verdict: Verdict) {
        match verdict {
            Verdict::Zero(cause) => self.zeroed[cause.index()] += 1,
            Verdict::Out(changes) => {
                self.limited += u64::from(changes.limited);
                self.slewed += u64::from(changes.slewed);
            }
        }
    }
}

/// Device and its gate. The device is stopped when the session ends, and when this value is dropped, also by a panic.
pub struct GatedDevice {
    device: Box<dyn Device>,
    gate: Gate,
    stats: GateStats,
    /// Time of the present tick on the clock of the session.
    clock: Instant,
    /// Time of the last reading on the clock of the session.
    reading_at: Option<Instant>,
    /// `true` if the device was read at the present tick.
    is_read: bool,
}

impl GatedDevice {
    /// Returns a device that is read every `tick`.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "the default limits are within their ranges")]
    pub fn new(device: Box<dyn Device>, tick: Duration) -> Self {
        // A scene may tick more slowly than the pause that stops the force of a fast loop. The bound of a second is the greatest that a gate takes.
        let gap = tick.saturating_mul(2).clamp(Limits::DEFAULT.gap, Duration::from_secs(1));
        let limits = |force| Limits { force, gap, ..Limits::DEFAULT };
        let gate = Gate::new(limits(device.description().force), device.stopper());
        // A description that is out of range gives a device without force.
        let gate = gate.or_else(|_| Gate::new(limits(0.0), device.stopper())).expect("the other limits are within their ranges");
        Self { device, gate, stats: GateStats::default(), clock: Instant::ZERO, reading_at: None, is_read: false }
    }

    /// Reads the device at the tick at `now`. `clock`: the time on the clock of the session, not before `now`. `sound` returns the usable part of a reading, or
    /// `None` for a reading that is not usable, which counts as none.
    pub fn read<T>(&mut self, now: Instant, clock: Instant, sound: impl FnOnce(Reading) -> Option<T>) -> Option<T> {
        let read = self.device.read(now).and_then(sound);
        (self.clock, self.is_read) = (clock, read.is_some());
        if self.is_read {
            self.reading_at = Some(clock);
        }
        read
    }

    /// Applies a force \[N\] on the hand until the next tick, as far as the gate admits the force. A device without a reading at this tick gives no force.
    pub fn hold(&mut self, now: Instant, span: Duration, wanted: [f64; 3]) {
        self.admit(now, span, wanted, Some(self.clock));
    }

    /// Ends the force until the next tick, at once: without a setpoint the gate admits no force, and the next force grows from zero.
    pub fn let_go(&mut self, now: Instant, span: Duration) {
        self.admit(now, span, [0.0; 3], None);
    }

    fn admit(&mut self, now: Instant, span: Duration, wanted: [f64; 3], setpoint_at: Option<Instant>) {
        let Self { clock, is_read, reading_at, .. } = *self;
        // The device returns no reading if the user has not switched forces on, so a read device is armed.
        let moment = Moment { now: clock, ready: is_read, armed: is_read, reading_at, setpoint_at };
        let admitted = self.gate.admit(wanted, &moment);
        self.stats.count(admitted.verdict);
        self.device.hold(now, span, admitted.force);
    }

    /// Ends the force of the session for good.
    pub fn stop(&mut self, now: Instant) {
        // Zero force goes out before the stop, because a device without a thread sends nothing afterwards.
        self.device.hold(now, Duration::ZERO, GatedForce::ZERO);
        self.gate.stop();
        self.device.stop();
    }

    /// Returns the counts of the gate.
    #[must_use]
    pub const fn stats(&self) -> &GateStats {
        &self.stats
    }
}

impl core::fmt::Debug for GatedDevice {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("GatedDevice").field("gate", &self.gate).field("stats", &self.stats).finish_non_exhaustive()
    }
}

impl Drop for GatedDevice {
    fn drop(&mut self) {
        self.device.stop();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use cohaptic_device::{Description, Stopper};

    use super::*;

    /// Device with a description of this force, and the latest force on the hand.
    struct Noted(f64, Arc<Mutex<[f64; 3]>>);

    impl Device for Noted {
        fn description(&self) -> Description {
            Description { name: "noted".to_owned(), motions: 3, force: self.0, period: Duration::from_millis(1) }
        }

        fn stopper(&self) -> Stopper {
            Stopper::default()
        }

        fn read(&mut self, _now: Instant) -> Option<Reading> {
            Some(Reading::default())
        }

        fn hold(&mut self, _now: Instant, _span: Duration, force: GatedForce) {
            *self.1.lock().unwrap() = force.newtons();
        }
    }

    /// Returns the forces along x \[N\] at these milliseconds, of a device that is read every `tick` milliseconds and asked for 30 N.
    fn forces(description: f64, tick: u64, at: &[u64]) -> Vec<f64> {
        let held = Arc::default();
        let mut device = GatedDevice::new(Box::new(Noted(description, Arc::clone(&held))), Duration::from_millis(tick));
        let force = |millis: &u64| {
            let now = Instant::ZERO + Duration::from_millis(*millis);
            device.read(now, now, Some);
            device.hold(now, Duration::from_millis(tick), [30.0, 0.0, 0.0]);
            held.lock().unwrap()[0]
        };
        at.iter().map(force).collect()
    }

    #[test]
    fn the_description_limits_the_force_and_counts_as_zero_out_of_range() {
        assert_eq!(forces(2.5, 1, &[0, 1, 2, 3, 4]), [0.0, 1.0, 2.0, 2.5, 2.5]);
        for description in [-1.0, 20.1, f64::NAN, f64::INFINITY] {
            assert_eq!(forces(description, 1, &[0, 1, 2]), [0.0; 3], "{description}");
        }
    }

    #[test]
    fn a_slow_tick_is_no_pause_and_two_ticks_are_the_longest() {
        assert_eq!(forces(20.0, 50, &[0, 50, 150, 251, 301]), [0.0, 20.0, 20.0, 0.0, 20.0]);
        assert_eq!(forces(20.0, 1, &[0, 20, 41, 42]), [0.0, 20.0, 0.0, 1.0]);
    }

    #[test]
    fn a_hand_that_is_let_go_has_no_force_at_once_and_then_the_force_grows() {
        let held = Arc::default();
        let mut device = GatedDevice::new(Box::new(Noted(20.0, Arc::clone(&held))), Duration::from_millis(1));
        let mut force = |millis: u64, is_held: bool| {
            let (now, span) = (Instant::ZERO + Duration::from_millis(millis), Duration::from_millis(1));
            device.read(now, now, Some);
            if is_held {
                device.hold(now, span, [30.0, 0.0, 0.0])
            } else {
                device.let_go(now, span)
            }
            held.lock().unwrap()[0]
        };
        let forces: Vec<f64> = [(0, true), (10, true), (11, false), (12, true)].map(|(millis, is_held)| force(millis, is_held)).into();
        assert_eq!(forces, [0.0, 10.0, 0.0, 1.0]);
    }
}
