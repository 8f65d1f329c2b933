//! Pointers: mice, pens, fingers and sticks for pulling the simulated device of a peer.
//!
//! The program of a pointer tells the position to a [`Pointer`], at the rate of a display. The session's thread reads the pointer at each tick, as the thread
//! reads a device. Between two given positions, the read position moves on a straight line at constant speed, so that the hand has a velocity and makes no
//! steps.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_units::Instant;

/// Largest absolute value of a pointer's coordinate \[m\]. No arm reaches so far.
pub const REACH: f64 = 10.0;

/// Greatest force of a pointer \[N\]. A mouse has no motors, so the bound is that of every device.
pub const FORCE: f64 = 20.0;

/// Time without a new position after which a pointer counts as absent.
const OLD: Duration = Duration::from_millis(100);
/// Least duration of a way between two arrivals. A way takes as long as the time between the arrivals of the last two positions, from [`QUICKEST`] to
/// [`SLOWEST`]. Displays give 60 to 144 positions a second.
const QUICKEST: Duration = Duration::from_millis(2);
/// Largest duration of a way between two arrivals.
const SLOWEST: Duration = Duration::from_millis(50);
/// Duration of the way to the first position that a session reads. The time since the position before is not known then. The way is slow, so that the arm does
/// not jerk.
const FIRST: Duration = Duration::from_millis(80);
/// Smallest ratio of the durations of two successive ways. After a gap in reading, the pointer catches up step by step.
const CATCHES_UP: f64 = 0.85;

/// Error of [`Pointer::tell`]: a coordinate is beyond [`REACH`] or not a number.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("a pointer at {found:?} m: expected numbers from -{REACH} to {REACH}")]
pub struct BeyondReach {
    /// Refused position \[m\].
    pub found: [f64; 3],
}

/// Pointer, shared by the program that moves the pointer and by the session. A pointer outlives the session: in the next session the hand begins where the
/// pointer is.
#[derive(Clone, Debug, Default)]
pub struct Pointer(Arc<Mutex<Shared>>);

/// Data exchanged between the program and the session's thread.
#[derive(Clone, Copy, Debug, Default)]
struct Shared {
    told: Told,
    /// Rest of the way at the end of the session's latest tick, on a clock that begins with the next session. The next session goes on with this way. `None`
    /// if there is no way.
    rest: Option<Way>,
    /// Force on the hand of the latest tick \[N\].
    force: [f64; 3],
}

/// Position that the program gave last.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    /// Number of positions and releases given so far. A changed number tells the session of a new position, even if the position is the same as before.
    number: u64,
    /// Position \[m\]. `None`: the pointer has let go.
    position: Option<[f64; 3]>,
}

impl Pointer {
    /// Tells the position of the pointer \[m\] from now on. `None`: the pointer lets go.
    ///
    /// # Errors
    ///
    /// [`BeyondReach`] if a coordinate is not a number from `-REACH` to `REACH`. The previous position stays.
    pub fn tell(&self, position: Option<[f64; 3]>) -> Result<(), BeyondReach> {
        // The comparison is false for a number that is not a number, so that such a coordinate is refused too.
        if let Some(found) = position
            && !found.iter().all(|x| x.abs() <= REACH)
        {
            return Err(BeyondReach { found });
        }
        let told = &mut self.0.lock().unwrap_or_else(PoisonError::into_inner).told;
        *told = Told { number: told.number + 1, position };
        Ok(())
    }

    /// Returns the force between device and copy computed last by the session, as the hand feels it \[N\], for motors in the pointer. The gate of the session has
    /// limited the force to [`FORCE`] and to 1000 N/s.
    #[must_use]
    pub fn force(&self) -> [f64; 3] {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).force
    }

    /// Returns the pointer as a device of a session.
    #[must_use]
    pub fn device(&self) -> Box<dyn Device> {
        let shared = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Box::new(PointerDevice { pointer: self.clone(), told: shared.told, newest: None, way: shared.rest, stopper: Stopper::default() })
    }
}

/// Straight way between two positions, at constant speed. Position and velocity stay defined after the end: the pointer rests at `to`.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// Position at `begin` \[m\].
    from: [f64; 3],
    /// Position at the end, `begin` plus `span` \[m\].
    to: [f64; 3],
    begin: Instant,
    /// Duration of the way. Never zero, because both positions and velocities divide by the duration.
    span: Duration,
}

impl Way {
    /// Returns the rest of the way after `now`, for a clock that begins at `now`.
    fn rest(&self, now: Instant) -> Self {
        let left = self.begin.saturating_add(self.span).saturating_duration_since(now);
        let Reading { position: from, .. } = self.at(now);
        // After the end of the way both positions are the same, and any duration above zero will do.
        Self { from, to: self.to, begin: Instant::ZERO, span: if left.is_zero() { QUICKEST } else { left } }
    }

    /// Returns position \[m\] and velocity [m/s] at the instant `now`.
    fn at(&self, now: Instant) -> Reading {
        let Self { from, to, begin, span } = *self;
        // Before `begin` the difference is zero, so that the position is `from`.
        let gone = now.saturating_duration_since(begin).as_secs_f64() / span.as_secs_f64();
        if gone >= 1.0 {
            return Reading { position: to, velocity: [0.0; 3] };
        }
        Reading {
            position: core::array::from_fn(|axis| from[axis] + gone * (to[axis] - from[axis])),
            velocity: core::array::from_fn(|axis| (to[axis] - from[axis]) / span.as_secs_f64()),
        }
    }
}

/// Pointer in the view of the session.
struct PointerDevice {
    pointer: Pointer,
    /// Position read last by the session.
    told: Told,
    /// Instant of the tick at which the session first read `told`. `None` if `told` is older than the session.
    newest: Option<Instant>,
    /// Present way. `None` before the first position, and after the pointer has let go.
    way: Option<Way>,
    stopper: Stopper,
}

impl Device for PointerDevice {
    fn description(&self) -> Description {
        Description { name: "pointer".to_owned(), motions: 3, force: FORCE, period: QUICKEST }
    }

    fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        // The program holds the lock only while it copies a few numbers. If the lock is held, the next tick is soon enough: this thread must not wait.
        let told = match self.pointer.0.try_lock() {
            Ok(shared) => shared.told,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner().told,
            Err(TryLockError::WouldBlock) => self.told,
        };
        if told.number != self.told.number {
            // The new way lasts as long as the time since the last news, but not much less than the way before lasted.
            let since = self.newest.map_or(FIRST, |newest| now.saturating_duration_since(newest).clamp(QUICKEST, SLOWEST));
            let span = self.way.as_ref().map_or(since, |way| since.max(way.span.mul_f64(CATCHES_UP)));
            self.way = told.position.map(|to| match &self.way {
                // The new way begins at the present position on the old way, so that the position makes no step.
                Some(way) => Way { from: way.at(now).position, to, begin: now, span },
                // Without a way the pointer appears at the told position: both ends are the same, and there is no velocity.
                None => Way { from: to, to, begin: now, span: QUICKEST },
            });
            (self.told, self.newest) = (told, Some(now));
        }
        // A position from before the session counts as fresh for the first 100 ms of the session.
        let is_fresh = now.saturating_duration_since(self.newest.unwrap_or(Instant::ZERO)) < OLD;
        self.told.position.filter(|_| is_fresh)?;
        self.way.as_ref().map(|way| way.at(now))
    }

    fn hold(&mut self, now: Instant, _span: Duration, force: GatedForce) {
        // If the lock is held, the force of the next tick is soon enough.
        if let Ok(mut shared) = self.pointer.0.try_lock() {
            shared.force = force.newtons();
            shared.rest = self.way.as_ref().map(|way| way.rest(now));
        }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_device::{Gate, Limits, Moment};
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    fn x(device: &mut dyn Device, millis: u64) -> Option<[f64; 2]> {
        device.read(at(millis)).map(|state| [state.position[0], state.velocity[0]])
    }

    fn near(found: Option<[f64; 2]>, expected: [f64; 2]) {
        let found = found.expect("a pointer that is there");
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?} {expected:?}");
    }

    #[test]
    fn a_pointer_goes_straight_from_place_to_place_in_the_time_between_them() {
        let pointer = Pointer::default();
        let mut device = pointer.device();
        assert_eq!(x(&mut *device, 0), None, "nothing was told");
        pointer.tell(Some([0.01, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 20), [0.01, 0.0]);
        near(x(&mut *device, 30), [0.01, 0.0]);
        pointer.tell(Some([0.03, 0.0, 0.0])).unwrap();
        // The position arrives 20 ms after the position before: 20 mm in 20 ms.
        near(x(&mut *device, 40), [0.01, 1.0]);
        near(x(&mut *device, 45), [0.015, 1.0]);
        near(x(&mut *device, 60), [0.03, 0.0]);
        // The new way begins at the present position on the way, not at the end of the way.
        pointer.tell(Some([0.05, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 80), [0.03, 0.5]);
        pointer.tell(Some([0.0, 0.0, 0.0])).unwrap();
        // 40 mm back, 20 ms later. The way takes 85 % of the 40 ms before, not 20 ms.
        near(x(&mut *device, 100), [0.04, -0.04 / 0.034]);
    }

    #[test]
    fn it_is_not_there_when_it_lets_go_or_tells_nothing_for_long() {
        let pointer = Pointer::default();
        let mut device = pointer.device();
        pointer.tell(Some([0.01, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 1), [0.01, 0.0]);
        near(x(&mut *device, 100), [0.01, 0.0]);
        assert_eq!(x(&mut *device, 101), None);
        pointer.tell(Some([0.02, 0.0, 0.0])).unwrap();
        assert!(x(&mut *device, 102).is_some());
        pointer.tell(None).unwrap();
        assert_eq!(x(&mut *device, 103), None);
        // A pointer that takes hold again begins at its new position. The device is not dragged from the position where the pointer let go.
        pointer.tell(Some([0.07, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 104), [0.07, 0.0]);
    }

    /// The device of the next session goes on along the way of the last session, at the same speed. The first new position is reached in 80 ms, because the
    /// time between the sessions is not known.
    #[test]
    fn the_next_session_goes_on_along_the_way() {
        let pointer = Pointer::default();
        let mut device = pointer.device();
        pointer.tell(Some([0.01, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 10), [0.01, 0.0]);
        pointer.tell(Some([0.03, 0.0, 0.0])).unwrap();
        // 20 mm in 20 ms, of which 15 ms have passed when the session ends.
        near(x(&mut *device, 30), [0.01, 1.0]);
        near(x(&mut *device, 45), [0.025, 1.0]);
        let mut gate = Gate::new(Limits::DEFAULT, device.stopper()).unwrap();
        let force = [44, 45].map(|millis| {
            let now = at(millis);
            gate.admit([0.25, 0.0, 0.0], &Moment { now, ready: true, armed: true, reading_at: Some(now), setpoint_at: Some(now) }).force
        });
        device.hold(at(45), Duration::from_millis(1), force[1]);
        assert_eq!(pointer.force().map(f64::to_bits), [0.25_f64.to_bits(), 0, 0]);
        let mut next = pointer.device();
        near(x(&mut *next, 0), [0.025, 1.0]);
        pointer.tell(Some([0.108, 0.0, 0.0])).unwrap();
        // 80 mm in 80 ms, although the position was told after 3 ms of this session. Then 60 mm in 85 % of that time.
        near(x(&mut *next, 3), [0.028, 1.0]);
        pointer.tell(Some([0.096, 0.0, 0.0])).unwrap();
        near(x(&mut *next, 11), [0.036, 0.06 / 0.068]);
        device.hold(at(99), Duration::from_millis(1), GatedForce::ZERO);
        near(x(&mut *pointer.device(), 0), [0.03, 0.0]);
    }

    properties! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// For any positions told at any times, the read position is finite, and no farther from the origin than the farthest accepted position.
        #[test]
        fn what_is_read_lies_among_the_places_told(steps in prop::collection::vec((0_u64..300, prop::option::of(prop::num::f64::ANY)), 1..40)) {
            let pointer = Pointer::default();
            let mut device = pointer.device();
            let (mut now, mut farthest) = (0, 0.0_f64);
            for (after, place) in steps {
                now += after;
                let accepted = pointer.tell(place.map(|x| [x, 0.0, 0.0])).is_ok();
                prop_assert_eq!(accepted, place.is_none_or(|x| x.abs() <= REACH));
                if let Some(x) = place.filter(|_| accepted) {
                    farthest = farthest.max(x.abs());
                }
                if let Some(state) = device.read(at(now)) {
                    prop_assert!(state.position[0].is_finite() && state.velocity[0].is_finite() && state.position[0].abs() <= farthest + 1e-12);
                }
            }
        }
    }
}
