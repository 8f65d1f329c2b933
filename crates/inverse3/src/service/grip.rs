//! Grip of a simulated device: a mass with damping, in the axes of a scene, and the hands that move the grip.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::axes::{Triple, length};

/// Longest step. The fastest motion of a grip has the time constant m/b = 20 ms; the arm of a hand is slower than 1 ms.
const STEP: Duration = Duration::from_micros(100);
/// Radius of the workspace \[m\], made up: Haply's tutorials stay within 0.10 m.
const REACH: f64 = 0.12;

/// Hand on the grip of a simulated device.
pub trait Hand: Send {
    /// Returns the force of the hand on the grip \[N\]. Position \[m\] and velocity \[m/s\] of the grip are in the axes of a scene, from the middle of the
    /// workspace. `now` is the instant on the clock of the service.
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple;
}

impl<F: FnMut(Instant, Triple, Triple) -> Triple + Send> Hand for F {
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple {
        self(now, position, velocity)
    }
}

/// Hand that holds the grip in the middle for a second and then sways: a spring of 100 N/m and a damper of 5 N·s/m to a place that moves on a sine.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SwayingHand {
    /// Largest distance from the middle along each axis \[m\].
    pub amplitude: Triple,
    /// Frequency \[Hz\].
    pub frequency: f64,
}

impl Hand for SwayingHand {
    fn force(&mut self, now: Instant, position: Triple, velocity: Triple) -> Triple {
        let angle = core::f64::consts::TAU * self.frequency * (now.as_secs_f64() - 1.0).max(0.0);
        let sine = libm::sin(angle);
        core::array::from_fn(|axis| 100.0 * (self.amplitude[axis] * sine - position[axis]) - 5.0 * velocity[axis])
    }
}

/// State of the grip, in the axes of a scene, from the middle of the workspace.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Grip {
    mass: f64,
    damping: f64,
    at: Instant,
    pub(super) position: Triple,
    pub(super) velocity: Triple,
}

impl Grip {
    /// Returns a grip at rest in the middle. `mass` \[kg\] is above zero, `damping` \[N·s/m\] at least zero.
    pub(super) const fn new(mass: f64, damping: f64) -> Self {
        Self { mass, damping, at: Instant::ZERO, position: [0.0; 3], velocity: [0.0; 3] }
    }

    /// Moves to `now` with the constant force of the motors \[N\]. Semi-implicit Euler; the viscous part is implicit, and so stable for any damping.
    pub(super) fn advance(&mut self, now: Instant, motors: Triple, hand: &mut dyn Hand) {
        while let Some(span) = now.checked_duration_since(self.at).filter(|rest| !rest.is_zero()) {
            let span = span.min(STEP);
            let seconds = span.as_secs_f64();
            let pull = hand.force(self.at, self.position, self.velocity);
            self.at += span;
            for axis in 0..3 {
                let gained = (motors[axis] + pull[axis]) * seconds / self.mass;
                self.velocity[axis] = (self.velocity[axis] + gained) / (1.0 + self.damping * seconds / self.mass);
                self.position[axis] += self.velocity[axis] * seconds;
            }
            let far = length(self.position);
            // The end of the workspace stops the grip without a rebound. `contains` is false for NaN, so a force that is not finite stops the grip, too.
            if !(0.0..=REACH).contains(&far) {
                self.position = if far.is_finite() { self.position.map(|part| part / far * REACH) } else { [0.0; 3] };
                self.velocity = [0.0; 3];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_force_ends_in_a_constant_speed_and_at_the_end_of_the_workspace() {
        let mut grip = Grip::new(0.1, 5.0);
        let mut still = |_: Instant, _: Triple, _: Triple| [0.0; 3];
        // v(t) = F/b·(1 − e^(−b·t/m)) with m/b = 20 ms. The method has first order: its error is half a step of 100 µs in 20 ms.
        grip.advance(Instant::from_nanos(20_000_000), [0.0, 0.5, 0.0], &mut still);
        let expected = 0.1 * (1.0 - libm::exp(-1.0));
        assert!((grip.velocity[1] - expected).abs() < 0.1 * 0.0025 + 1e-9, "{grip:?}");
        grip.advance(Instant::from_nanos(300_000_000), [0.0, 0.5, 0.0], &mut still);
        assert!((grip.velocity[1] - 0.1).abs() < 1e-6, "{grip:?}");
        grip.advance(Instant::from_nanos(3_000_000_000), [0.0, 0.5, 0.0], &mut still);
        assert!((grip.position[1] - REACH).abs() < 1e-5 && grip.position[0] == 0.0, "{grip:?}");
    }

    #[test]
    fn no_hand_makes_a_position_that_is_not_finite() {
        for force in [1e300, f64::INFINITY, f64::NAN] {
            let mut grip = Grip::new(0.1, 5.0);
            grip.advance(Instant::from_nanos(10_000_000), [0.0; 3], &mut move |_: Instant, _: Triple, _: Triple| [force, 0.0, 0.0]);
            assert!(length(grip.position) <= REACH * (1.0 + 1e-12), "{grip:?}");
        }
    }
}
