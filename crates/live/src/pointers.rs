//! Pointers: mice, pens, fingers and sticks that pull the simulated device of a peer.
//!
//! What moves a pointer tells its [`Pointer`] where it is, at the rate of a display. The thread that has to be on time reads it at each tick, as it reads a
//! device: on the straight way from where the pointer was to where it was last told to be, so that the hand has a velocity and no steps.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};
use std::time::Duration;

use cohaptic_harness::live::LiveDevice;
use cohaptic_peer::State;
use cohaptic_units::Instant;

/// No pointer is farther from the origin along an axis \[m\]: so far reaches nobody's arm.
pub const REACH: f64 = 10.0;

/// A pointer that has told nothing for so long is not there.
const OLD: Duration = Duration::from_millis(100);
/// Between two places the way takes as long as passed between their coming, within these limits: a screen shows 60 a second, or 144.
const QUICKEST: Duration = Duration::from_millis(2);
const SLOWEST: Duration = Duration::from_millis(50);
/// Of the first place that a session reads nobody knows how long ago the one before it came. The way there is slow, so that the arm does not jerk.
const FIRST: Duration = Duration::from_millis(80);
/// A way is no quicker than this share of the one before it: what was missed while nobody read is caught up little by little.
const CATCHES_UP: f64 = 0.85;

/// Why a place is no place of a pointer.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("a pointer at {found:?} m: expected numbers from -{REACH} to {REACH}")]
pub struct BeyondReach {
    /// The place.
    pub found: [f64; 3],
}

/// A pointer, shared by what moves it and the session. It outlives the session: the next one begins with the pointer where it is.
#[derive(Clone, Debug, Default)]
pub struct Pointer(Arc<Mutex<Shared>>);

#[derive(Clone, Copy, Debug, Default)]
struct Shared {
    told: Told,
    /// The rest of its way when a session last read it: the next session goes on from there.
    rest: Option<Way>,
    /// FC \[N\].
    force: [f64; 3],
}

/// What a pointer was told last.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    /// Counts up.
    number: u64,
    /// `None`: it has let go.
    position: Option<[f64; 3]>,
}

impl Pointer {
    /// The pointer is there now, or has let go.
    ///
    /// # Errors
    ///
    /// [`BeyondReach`] if that is no place; nothing changes.
    pub fn tell(&self, position: Option<[f64; 3]>) -> Result<(), BeyondReach> {
        if let Some(found) = position
            && !found.iter().all(|x| x.abs() <= REACH)
        {
            return Err(BeyondReach { found });
        }
        let told = &mut self.0.lock().unwrap_or_else(PoisonError::into_inner).told;
        *told = Told { number: told.number + 1, position };
        Ok(())
    }

    /// The force that the session last computed between device and copy \[N\], for motors.
    #[must_use]
    pub fn force(&self) -> [f64; 3] {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).force
    }

    /// The pointer as a session reads it.
    #[must_use]
    pub fn device(&self) -> Box<dyn LiveDevice> {
        let shared = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Box::new(PointerDevice { pointer: self.clone(), told: shared.told, newest: None, way: shared.rest })
    }
}

/// The straight way from one place to another, at constant speed.
#[derive(Clone, Copy, Debug)]
struct Way {
    from: [f64; 3],
    to: [f64; 3],
    begin: Instant,
    span: Duration,
}

impl Way {
    /// The remaining way at `now`, for a clock that begins then.
    fn rest(&self, now: Instant) -> Self {
        let left = self.begin.saturating_add(self.span).saturating_duration_since(now);
        let State { position: from, .. } = self.at(now);
        // Where nothing is left both ends are the same place.
        Self { from, to: self.to, begin: Instant::ZERO, span: if left.is_zero() { QUICKEST } else { left } }
    }

    fn at(&self, now: Instant) -> State<3> {
        let Self { from, to, begin, span } = *self;
        let gone = now.saturating_duration_since(begin).as_secs_f64() / span.as_secs_f64();
        if gone >= 1.0 {
            return State { position: to, velocity: [0.0; 3] };
        }
        State {
            position: core::array::from_fn(|axis| from[axis] + gone * (to[axis] - from[axis])),
            velocity: core::array::from_fn(|axis| (to[axis] - from[axis]) / span.as_secs_f64()),
        }
    }
}

struct PointerDevice {
    pointer: Pointer,
    told: Told,
    /// When it was told that; `None` if that was before this session.
    newest: Option<Instant>,
    /// `None` before it was told anything, and when it has let go.
    way: Option<Way>,
}

impl LiveDevice for PointerDevice {
    fn read(&mut self, now: Instant) -> Option<State<3>> {
        // The other side holds the lock for nanoseconds; if it is held just now, the next tick is soon enough.
        let told = match self.pointer.0.try_lock() {
            Ok(shared) => shared.told,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner().told,
            Err(TryLockError::WouldBlock) => self.told,
        };
        if told.number != self.told.number {
            let since = self.newest.map_or(FIRST, |newest| now.saturating_duration_since(newest).clamp(QUICKEST, SLOWEST));
            let span = self.way.as_ref().map_or(since, |way| since.max(way.span.mul_f64(CATCHES_UP)));
            self.way = told.position.map(|to| match &self.way {
                Some(way) => Way { from: way.at(now).position, to, begin: now, span },
                None => Way { from: to, to, begin: now, span: QUICKEST },
            });
            (self.told, self.newest) = (told, Some(now));
        }
        let is_fresh = now.saturating_duration_since(self.newest.unwrap_or(Instant::ZERO)) < OLD;
        self.told.position.filter(|_| is_fresh)?;
        self.way.as_ref().map(|way| way.at(now))
    }

    fn hold(&mut self, now: Instant, _span: Duration, coupling_force: [f64; 3]) {
        if let Ok(mut shared) = self.pointer.0.try_lock() {
            shared.force = coupling_force;
            shared.rest = self.way.as_ref().map(|way| way.rest(now));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    fn x(device: &mut dyn LiveDevice, millis: u64) -> Option<[f64; 2]> {
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
        // 20 ms after the place before it: 20 mm in 20 ms.
        near(x(&mut *device, 40), [0.01, 1.0]);
        near(x(&mut *device, 45), [0.015, 1.0]);
        near(x(&mut *device, 60), [0.03, 0.0]);
        // From where it is on its way, not from where it was to be.
        pointer.tell(Some([0.05, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 80), [0.03, 0.5]);
        pointer.tell(Some([0.0, 0.0, 0.0])).unwrap();
        // 40 mm back, 20 ms later: in 85 % of the 40 ms before, not at once.
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
        // Elsewhere it takes hold there; nothing drags the device from where it let go.
        pointer.tell(Some([0.07, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 104), [0.07, 0.0]);
    }

    /// The device of the next session goes on along the way of the last one, as fast; the first place that is new is reached in 80 ms, because nobody knows
    /// how long the session was away.
    #[test]
    fn the_next_session_goes_on_along_the_way() {
        let pointer = Pointer::default();
        let mut device = pointer.device();
        pointer.tell(Some([0.01, 0.0, 0.0])).unwrap();
        near(x(&mut *device, 10), [0.01, 0.0]);
        pointer.tell(Some([0.03, 0.0, 0.0])).unwrap();
        // 20 mm in 20 ms, of which 15 ms are gone when the session ends.
        near(x(&mut *device, 30), [0.01, 1.0]);
        near(x(&mut *device, 45), [0.025, 1.0]);
        device.hold(at(45), Duration::from_millis(1), [0.25, 0.0, 0.0]);
        assert_eq!(pointer.force().map(f64::to_bits), [0.25_f64.to_bits(), 0, 0]);
        let mut next = pointer.device();
        near(x(&mut *next, 0), [0.025, 1.0]);
        pointer.tell(Some([0.108, 0.0, 0.0])).unwrap();
        // 80 mm in 80 ms, though it was told after 3 ms of this session; then 60 mm in 85 % of that.
        near(x(&mut *next, 3), [0.028, 1.0]);
        pointer.tell(Some([0.096, 0.0, 0.0])).unwrap();
        near(x(&mut *next, 11), [0.036, 0.06 / 0.068]);
        device.hold(at(99), Duration::from_millis(1), [0.0; 3]);
        near(x(&mut *pointer.device(), 0), [0.03, 0.0]);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever is told at whatever times: what is read is finite, and no farther than the farthest place that was accepted.
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
                    prop_assert!(state.is_finite() && state.position[0].abs() <= farthest + 1e-12);
                }
            }
        }
    }
}
