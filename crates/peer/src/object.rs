//! One peer's copy of the shared virtual object.

use core::time::Duration;

use crate::coordination::Prediction;
use crate::stepper::Stepper;
use crate::{Clock, CopyConfig, Integrator, Plant, State};

/// A copy of the shared virtual object: a damped mass on each axis.
#[derive(Clone, Debug)]
pub struct ObjectCopy<const A: usize> {
    state: State<A>,
    stepper: Stepper,
}

impl CopyConfig {
    /// Returns the plant of the copy along one axis. No spring ties the copy to ground.
    #[must_use]
    pub const fn plant(self) -> Plant {
        Plant { mass: self.mass, damping: self.damping, stiffness: 0.0 }
    }
}

impl<const A: usize> ObjectCopy<A> {
    /// Returns a copy in the state `state`.
    #[must_use]
    pub fn new(copy: CopyConfig, state: State<A>, integrator: Integrator, clock: &Clock) -> Self {
        Self { state, stepper: Stepper::new(copy.plant(), integrator, clock) }
    }

    /// Returns position and velocity of the copy.
    #[must_use]
    pub const fn state(&self) -> &State<A> {
        &self.state
    }

    /// Sets position and velocity of the copy.
    pub const fn set_state(&mut self, state: State<A>) {
        self.state = state;
    }

    /// Sets the damping towards ground [N·s/m], from the next step on.
    pub(crate) fn set_damping(&mut self, damping: f64) {
        self.stepper.set_damping(damping);
    }

    /// Predicts the motion of the copy over `span`, for a force F that is subtracted from `force` \[N\].
    pub(crate) fn ahead(&self, span: Duration, force: [f64; A]) -> Prediction<A> {
        // Displacement = by_velocity·v + compliance·(force − F): the position has no effect on a free body.
        let ([[_, by_velocity], _], [compliance, _]) = self.stepper.map(span).coefficients();
        let free = core::array::from_fn(|axis| by_velocity * self.state.velocity[axis] + compliance * force[axis]);
        Prediction { free, compliance }
    }

    /// Moves the copy over `span` under a held force \[N\].
    #[inline]
    pub(crate) fn advance(&mut self, span: Duration, force: [f64; A]) {
        self.stepper.advance(&mut self.state, span, force);
    }
}
