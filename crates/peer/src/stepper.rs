//! Step maps of a body, for the spans between ticks.

use core::time::Duration;

use crate::{Clock, Integrator, Plant, State, StepMap};

/// Advances one body along A axes by the spans between two ticks of a clock: one span without drift, or two spans that differ by a nanosecond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stepper {
    plant: Plant,
    integrator: Integrator,
    short: (Duration, StepMap),
    long: (Duration, StepMap),
    /// `true` if no spring ties the body to ground, so that [`StepMap::advance_free`] applies.
    free: bool,
}

impl Stepper {
    /// Returns the stepper of a plant, with the maps of both spans of `clock`.
    pub(crate) fn new(plant: Plant, integrator: Integrator, clock: &Clock) -> Self {
        let (short, long) = clock.spans();
        let step = |span| (span, plant.step(span, integrator));
        let (short, long) = (step(short), step(long));
        Self { plant, integrator, short, long, free: short.1.is_free() && long.1.is_free() }
    }

    /// Sets the damping towards ground [N·s/m], from the next step on.
    pub(crate) fn set_damping(&mut self, damping: f64) {
        self.plant.damping = damping;
        for (span, map) in [&mut self.short, &mut self.long] {
            *map = self.plant.step(*span, self.integrator);
        }
        self.free = self.short.1.is_free() && self.long.1.is_free();
    }

    /// Returns the map of a step over `span`.
    #[inline(always)]
    pub(crate) fn map(&self, span: Duration) -> StepMap {
        if span == self.short.0 {
            self.short.1
        } else if span == self.long.0 {
            self.long.1
        } else {
            // A span of another clock: the driver that passes it pays for a new map at each call.
            self.plant.step(span, self.integrator)
        }
    }

    /// Moves the body over `span` under the held force.
    #[inline(always)]
    pub(crate) fn advance<const A: usize>(&self, state: &mut State<A>, span: Duration, force: [f64; A]) {
        // A borrowed map: `Stepper::map` would copy its coefficients at each tick.
        let other;
        let map = if span == self.short.0 {
            &self.short.1
        } else if span == self.long.0 {
            &self.long.1
        } else {
            // A span of another clock: the driver that passes it pays for a new map at each call.
            other = self.plant.step(span, self.integrator);
            &other
        };
        for (axis, force) in force.into_iter().enumerate() {
            let mut body = state.along(axis);
            // The terms of the position are zero for a free body. The branch is the same at every tick.
            if self.free {
                map.advance_free(&mut body, force);
            } else {
                map.advance(&mut body, force);
            }
            state.set_along(axis, body);
        }
    }
}
