//! The grip as a mass with forces of motors, hand, friction and end stops.

use core::time::Duration;

use cohaptic_units::Instant;

use super::{Hand, MechanicsConfig};
use crate::kinematics::{ANGLE_LIMITS, Jacobian, Triple, count_of_angle, inverse};

/// Greatest length of a step. The fastest oscillation, at an end stop, has a period of 14 ms.
const STEP: Duration = Duration::from_micros(100);

#[derive(Clone, Copy, Debug)]
pub(super) struct Mechanics {
    config: MechanicsConfig,
    /// Time of the state.
    at: Instant,
    position: Triple,
    velocity: Triple,
    /// Angles of the arms at the position \[rad\].
    angles: Triple,
    /// Jacobian at the position; `None` where an arm has no influence on the grip.
    jacobian: Option<Jacobian>,
}

impl Mechanics {
    /// Returns a grip at rest at `position`, or at rest in the middle if the grip cannot be there.
    pub(super) fn new(config: MechanicsConfig, position: Triple) -> Self {
        let middle = [0.0, 0.0, 0.11];
        let (position, angles) = inverse(position).map_or_else(|| (middle, inverse(middle).unwrap_or_default()), |angles| (position, angles));
        Self { config, at: Instant::ZERO, position, velocity: [0.0; 3], angles, jacobian: Jacobian::at(position) }
    }

    pub(super) const fn at(&self) -> Instant {
        self.at
    }

    pub(super) const fn position(&self) -> Triple {
        self.position
    }

    pub(super) const fn velocity(&self) -> Triple {
        self.velocity
    }

    /// Returns the angles of the arms in counts, with their fractions.
    pub(super) fn counts(&self) -> Triple {
        self.angles.map(count_of_angle)
    }

    /// Returns the force on the grip \[N\] of the motors' torques \[N·m\] at its position.
    pub(super) fn force_of(&self, torques: Triple) -> Triple {
        self.jacobian.map_or([0.0; 3], |jacobian| jacobian.force(torques))
    }

    /// Returns the length of the next step towards `to`; `None` at or after `to`.
    pub(super) fn next_step(&self, to: Instant) -> Option<Duration> {
        to.checked_duration_since(self.at).filter(|rest| !rest.is_zero()).map(|rest| rest.min(STEP))
    }

    /// Makes a step of semi-implicit Euler. Dry friction is an impulse that can stop the grip and never reverses it.
    pub(super) fn step(&mut self, span: Duration, motors: Triple, hand: &mut dyn Hand) {
        let config = self.config;
        let seconds = span.as_secs_f64();
        let pull = hand.force(self.at, self.position, self.velocity);
        self.at += span;
        let Some(jacobian) = self.jacobian else { return self.velocity = [0.0; 3] };
        // The end stops act at the arms, so their damping needs the arms' velocities.
        let turning = jacobian.turning(self.velocity);
        let torques = core::array::from_fn(|arm| motors[arm] + self.stop(arm, turning[arm]));
        let arms = jacobian.force(torques);
        let mut velocity: Triple = core::array::from_fn(|axis| {
            let force = arms[axis] + pull[axis];
            // The viscous part is implicit, and so stable for any damping.
            (self.velocity[axis] + force * seconds / config.mass) / (1.0 + config.damping * seconds / config.mass)
        });
        let speed = libm::hypot(libm::hypot(velocity[0], velocity[1]), velocity[2]);
        // The velocity that dry friction can take in a step.
        let lost = config.coulomb * seconds / config.mass;
        velocity = if speed > lost { velocity.map(|part| part * (1.0 - lost / speed)) } else { [0.0; 3] };
        let position = core::array::from_fn(|axis| self.position[axis] + velocity[axis] * seconds);
        // An absurd force of a hand would lead out of the workspace: the grip then stops as at a wall.
        match inverse(position).zip(Jacobian::at(position)).filter(|_| velocity.iter().all(|part| part.is_finite())) {
            Some((angles, jacobian)) => (self.position, self.velocity, self.angles, self.jacobian) = (position, velocity, angles, Some(jacobian)),
            None => self.velocity = [0.0; 3],
        }
    }

    /// Returns the torque of an arm's end stop \[N·m\].
    fn stop(&self, arm: usize, turning: f64) -> f64 {
        let [lowest, highest] = ANGLE_LIMITS;
        let beyond = self.angles[arm] - self.angles[arm].clamp(lowest, highest);
        if beyond == 0.0 {
            return 0.0;
        }
        let torque = -self.config.stop_stiffness * beyond - self.config.stop_damping * turning;
        // A stop pushes, and does not hold an arm that leaves it.
        if beyond > 0.0 { torque.min(0.0) } else { torque.max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::StillHand;

    fn run(mechanics: &mut Mechanics, milliseconds: u64, hand: &mut dyn Hand) {
        let to = mechanics.at + Duration::from_millis(milliseconds);
        while let Some(step) = mechanics.next_step(to) {
            mechanics.step(step, [0.0; 3], hand);
        }
    }

    #[test]
    fn a_constant_force_ends_in_a_constant_speed() {
        let mut mechanics = Mechanics::new(MechanicsConfig { coulomb: 0.0, ..MechanicsConfig::DEFAULT }, [0.0, 0.0, 0.12]);
        // The speed is v(t) = F/b·(1 − e^(−b·t/m)) with m/b = 20 ms.
        run(&mut mechanics, 20, &mut |_, _, _| [0.5, 0.0, 0.0]);
        let expected = 0.1 * (1.0 - (-1.0_f64).exp());
        // The method has first order: the error is half a step of 100 us in 20 ms.
        assert!((mechanics.velocity[0] - expected).abs() < 0.1 * 0.0025 + 1e-9, "{}", mechanics.velocity[0]);
        run(&mut mechanics, 300, &mut |_, _, _| [0.5, 0.0, 0.0]);
        assert!((mechanics.velocity[0] - 0.1).abs() < 1e-6);
    }

    #[test]
    fn dry_friction_holds_what_is_weaker() {
        let mut mechanics = Mechanics::new(MechanicsConfig::DEFAULT, [0.0, 0.0, 0.12]);
        // A force of 0.17 N is below the dry friction of 0.2 N, and 0.3 N is above.
        run(&mut mechanics, 500, &mut |_, _, _| [0.1, 0.1, 0.1]);
        assert_eq!(mechanics.position, [0.0, 0.0, 0.12]);
        run(&mut mechanics, 500, &mut |_, _, _| [0.0, 0.0, 0.3]);
        assert!(mechanics.position[2] > 0.121);
        run(&mut mechanics, 500, &mut StillHand);
        assert_eq!(mechanics.velocity, [0.0; 3]);
    }

    #[test]
    fn no_hand_gets_past_the_stops() {
        // Forces in and out, sideways, far too large, and not a number.
        for force in [[0.0, 0.0, 30.0], [0.0, 0.0, -30.0], [40.0, -10.0, 5.0], [1e9, 1e9, 1e9], [f64::NAN, 0.0, 0.0]] {
            let mut mechanics = Mechanics::new(MechanicsConfig::DEFAULT, [0.0, 0.0, 0.12]);
            run(&mut mechanics, 1000, &mut |_, _, _| force);
            assert!(mechanics.position.iter().chain(&mechanics.velocity).all(|part| part.is_finite()), "{force:?}: {mechanics:?}");
            assert!(mechanics.position.iter().all(|part| part.abs() < 0.25), "{force:?}: {mechanics:?}");
            assert!(inverse(mechanics.position).is_some());
        }
    }
}
