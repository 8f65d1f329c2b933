//! Hands that hold a simulated grip.

use core::f64::consts::TAU;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::kinematics::Triple;

/// What moves the grip.
pub trait Hand: Send {
    /// The force \[N\] on the grip at `now`, with the grip at `position` \[m\] in the frame of the device and moving with `velocity` \[m/s\].
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple;
}

impl<F: FnMut(Instant, Triple, Triple) -> Triple + Send> Hand for F {
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple {
        self(now, position, velocity)
    }
}

/// No hand: the grip hangs free. Gravity is not simulated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StillHand;

impl Hand for StillHand {
    fn force(&mut self, _now: Instant, _position: Triple, _velocity: Triple) -> Triple {
        [0.0; 3]
    }
}

/// A hand that goes from point to point along straight lines and pulls the grip along, as a spring and a damper.
#[derive(Clone, PartialEq, Debug)]
pub struct Waypoints {
    /// When it is at which point \[m\]; in order.
    points: Vec<(Instant, Triple)>,
    stiffness: f64,
    damping: f64,
    sway: Option<(Triple, f64)>,
}

impl Waypoints {
    /// Through these points \[m\], each reached at its time since the beginning; it stays at the last. Points are put in the order of time.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (Duration, Triple)>) -> Self {
        let mut points: Vec<_> = points.into_iter().map(|(after, point)| (Instant::ZERO.saturating_add(after), point)).collect();
        points.sort_by_key(|(at, _)| *at);
        Self { points, stiffness: 600.0, damping: 15.0, sway: None }
    }

    /// What a user does to home a device and switch its forces on, from `begin` on: out, in, out again, and to the middle, in 4 s.
    #[must_use]
    pub fn homing(begin: Duration) -> Self {
        let path = [(0, 0.100), (1000, 0.176), (2000, 0.084), (3000, 0.176), (3300, 0.176), (4000, 0.125)];
        Self::new(path.map(|(ms, z)| (begin + Duration::from_millis(ms), [0.0, 0.0, z])))
    }

    /// Sways around the last point once it is there, with these amplitudes \[m\] and that frequency \[Hz\].
    #[must_use]
    pub const fn swaying(mut self, amplitude: Triple, frequency: f64) -> Self {
        self.sway = Some((amplitude, frequency));
        self
    }

    /// Where the hand is, and how fast.
    fn wanted(&self, now: Instant) -> Option<(Triple, Triple)> {
        let next = self.points.partition_point(|(at, _)| *at <= now);
        let Some(&(end, to)) = self.points.get(next) else {
            let &(at, last) = self.points.last()?;
            let (amplitude, frequency) = self.sway.unwrap_or(([0.0; 3], 0.0));
            let angle = TAU * frequency * now.saturating_duration_since(at).as_secs_f64();
            let place = |axis: usize| last[axis] + amplitude[axis] * libm::sin(angle);
            let speed = |axis: usize| amplitude[axis] * TAU * frequency * libm::cos(angle);
            return Some((core::array::from_fn(place), core::array::from_fn(speed)));
        };
        // Not there yet: at the first point.
        let Some(&(start, from)) = next.checked_sub(1).and_then(|before| self.points.get(before)) else { return Some((to, [0.0; 3])) };
        let whole = end.saturating_duration_since(start).as_secs_f64();
        let part = now.saturating_duration_since(start).as_secs_f64() / whole;
        let place = |axis: usize| from[axis] + part * (to[axis] - from[axis]);
        let speed = |axis: usize| (to[axis] - from[axis]) / whole;
        Some((core::array::from_fn(place), core::array::from_fn(speed)))
    }
}

impl Hand for Waypoints {
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple {
        let Some((place, speed)) = self.wanted(now) else { return [0.0; 3] };
        core::array::from_fn(|axis| self.stiffness * (place[axis] - position[axis]) + self.damping * (speed[axis] - velocity[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_straight_between_points_and_ends_at_the_last() {
        let at = |ms| Instant::ZERO + Duration::from_millis(ms);
        let hand = Waypoints::new([(Duration::from_secs(2), [1.0, 0.0, 0.0]), (Duration::from_secs(1), [0.0; 3])]).swaying([0.0, 0.5, 0.0], 0.25);
        assert_eq!(hand.wanted(at(0)), Some(([0.0; 3], [0.0; 3])));
        assert_eq!(hand.wanted(at(1250)), Some(([0.25, 0.0, 0.0], [1.0, 0.0, 0.0])));
        let (place, _) = hand.wanted(at(3000)).unwrap();
        assert!((place[1] - 0.5).abs() < 1e-12 && place[0] == 1.0);
        assert_eq!(Waypoints::new([]).wanted(at(0)), None);
    }
}
