//! Continuous tracking after the crossover model.

use core::time::Duration;

use super::View;
use crate::State;

/// Tracking of a target: a hand with the velocity ωc times the seen error, an integrator with a delay. McRuer & Jex (1967) found that a person and the
/// controlled element together have this form near the frequency ωc at which the gain of the loop is 1.
#[derive(Clone, Debug)]
pub(super) struct Crossover<const A: usize> {
    /// Crossover frequency ωc \[rad/s\].
    frequency: f64,
    /// Period of the tick \[s\].
    tick: f64,
    /// Wanted position at the next tick \[m\].
    position: [f64; A],
}

impl<const A: usize> Crossover<A> {
    pub(super) fn new(frequency: f64, tick: Duration, place: [f64; A]) -> Self {
        Self { frequency, tick: tick.as_secs_f64(), position: place }
    }

    /// Returns the wanted position at the next tick \[m\].
    pub(super) const fn position(&self) -> [f64; A] {
        self.position
    }

    /// Sets the wanted position at the next tick \[m\].
    pub(super) const fn set_position(&mut self, position: [f64; A]) {
        self.position = position;
    }

    /// Returns the wanted motion over a tick, and moves the wanted position on to the next tick.
    #[inline]
    pub(super) fn tick(&mut self, seen: &View<A>) -> State<A> {
        let velocity: [f64; A] = core::array::from_fn(|axis| self.frequency * (seen.target[axis] - seen.position[axis]));
        let position = self.position;
        self.position = core::array::from_fn(|axis| position[axis] + self.tick * velocity[axis]);
        State { position, velocity }
    }
}
