//! Hands that move a simulated grip.

use core::f64::consts::TAU;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::kinematics::Triple;

/// A source of force on the grip.
pub trait Hand: Send {
    /// Returns the force \[N\] on the grip at `now`, with the grip at `position` \[m\] in the frame of the device and with `velocity` \[m/s\].
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple;
}

impl<F: FnMut(Instant, Triple, Triple) -> Triple + Send> Hand for F {
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple {
        self(now, position, velocity)
    }
}

/// No hand: the grip is free. Gravity is not simulated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StillHand;

impl Hand for StillHand {
    fn force(&mut self, _now: Instant, _position: Triple, _velocity: Triple) -> Triple {
        [0.0; 3]
    }
}

/// A hand that moves from point to point along straight lines, and pulls the grip by a spring and a damper.
#[derive(Clone, PartialEq, Debug)]
pub struct Waypoints {
    /// Points \[m\] with the times of arrival, in order of time.
    points: Vec<(Instant, Triple)>,
    /// Stiffness of the spring \[N/m\].
    stiffness: f64,
    /// Damping of the damper \[N·s/m\].
    damping: f64,
    /// Amplitudes \[m\] and frequency \[Hz\] of a sway around the last point.
    sway: Option<(Triple, f64)>,
}

impl Waypoints {
    /// Returns a hand through these points \[m\], each reached at its time since the beginning. The hand stays at the last point. The points are sorted by
    /// time.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (Duration, Triple)>) -> Self {
        let mut points: Vec<_> = points.into_iter().map(|(after, point)| (Instant::ZERO.saturating_add(after), point)).collect();
        points.sort_by_key(|(at, _)| *at);
        Self { points, stiffness: 600.0, damping: 15.0, sway: None }
    }

    /// Returns the hand of a user who homes a device and switches its forces on, from `begin` on: out, in, out again, and to the middle, in 4 s.
    #[must_use]
    pub fn homing(begin: Duration) -> Self {
        let path = [(0, 0.100), (1000, 0.176), (2000, 0.084), (3000, 0.176), (3300, 0.176), (4000, 0.125)];
        Self::new(path.map(|(ms, z)| (begin + Duration::from_millis(ms), [0.0, 0.0, z])))
    }

    /// Adds a sway around the last point after the arrival, with these amplitudes \[m\] and that frequency \[Hz\].
    #[must_use]
    pub const fn swaying(mut self, amplitude: Triple, frequency: f64) -> Self {
        self.sway = Some((amplitude, frequency));
        self
    }

    /// Returns position \[m\] and velocity \[m/s\] of the hand; `None` without points.
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
        // Before the first time, the hand is at the first point.
        let Some(&(start, from)) = next.checked_sub(1).and_then(|before| self.points.get(before)) else { return Some((to, [0.0; 3])) };
        // `next` is the first point after now, so `whole` is above zero.
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
        // The points are given out of order. The sway has a period of 4 s, so its first maximum is a second after the arrival.
        let hand = Waypoints::new([(Duration::from_secs(2), [1.0, 0.0, 0.0]), (Duration::from_secs(1), [0.0; 3])]).swaying([0.0, 0.5, 0.0], 0.25);
        assert_eq!(hand.wanted(at(0)), Some(([0.0; 3], [0.0; 3])));
        assert_eq!(hand.wanted(at(1250)), Some(([0.25, 0.0, 0.0], [1.0, 0.0, 0.0])));
        let (place, _) = hand.wanted(at(3000)).unwrap();
        assert!((place[1] - 0.5).abs() < 1e-12 && place[0] == 1.0);
        assert_eq!(Waypoints::new([]).wanted(at(0)), None);
    }
}
