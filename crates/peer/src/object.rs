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
    /// The copy on one axis: nothing ties it to ground.
    #[must_use]
    pub const fn plant(self) -> Plant {
        Plant { mass: self.mass, damping: self.damping, stiffness: 0.0 }
    }
}

impl<const A: usize> ObjectCopy<A> {
    /// A copy in that state.
    #[must_use]
    pub fn new(copy: CopyConfig, state: State<A>, integrator: Integrator, clock: &Clock) -> Self {
        Self { state, stepper: Stepper::new(copy.plant(), integrator, clock) }
    }

    /// Where it is and how fast it moves.
    #[must_use]
    #[inline]
    pub const fn state(&self) -> &State<A> {
        &self.state
    }

    /// Puts it into that state.
    pub const fn set_state(&mut self, state: State<A>) {
        self.state = state;
    }

    /// Another damping towards ground [N·s/m], from the next step on.
    pub(crate) fn set_damping(&mut self, damping: f64) {
        self.stepper.set_damping(damping);
    }

    /// How a force F that is subtracted from `force` moves it over `span`.
    pub(crate) fn ahead(&self, span: Duration, force: [f64; A]) -> Prediction<A> {
        let ([[_, by_velocity], _], [compliance, _]) = self.stepper.map(span).coefficients();
        let free = core::array::from_fn(|axis| by_velocity * self.state.velocity[axis] + compliance * force[axis]);
        Prediction { free, compliance }
    }

    /// Moves it over `span` under a held force.
    #[inline]
    pub(crate) fn advance(&mut self, span: Duration, force: [f64; A]) {
        self.stepper.advance(&mut self.state, span, force);
    }
}
