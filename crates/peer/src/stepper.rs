//! The step maps of one body, for the spans between its ticks.

use core::time::Duration;

use crate::{Clock, Integrator, Plant, State, StepMap};

/// Advances one body along A axes by the spans that lie between two ticks of a clock: one span, or two that differ by a nanosecond if it drifts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stepper {
    plant: Plant,
    integrator: Integrator,
    short: (Duration, StepMap),
    long: (Duration, StepMap),
    free: bool,
}

impl Stepper {
    pub(crate) fn new(plant: Plant, integrator: Integrator, clock: &Clock) -> Self {
        let (short, long) = clock.spans();
        let step = |span| (span, plant.step(span, integrator));
        let (short, long) = (step(short), step(long));
        Self { plant, integrator, short, long, free: short.1.is_free() && long.1.is_free() }
    }

    /// Another damping towards ground [N·s/m], from the next step on.
    pub(crate) fn set_damping(&mut self, damping: f64) {
        self.plant.damping = damping;
        for (span, map) in [&mut self.short, &mut self.long] {
            *map = self.plant.step(*span, self.integrator);
        }
        self.free = self.short.1.is_free() && self.long.1.is_free();
    }

    /// The map of a step of that length.
    #[inline(always)]
    pub(crate) fn map(&self, span: Duration) -> StepMap {
        if span == self.short.0 {
            self.short.1
        } else if span == self.long.0 {
            self.long.1
        } else {
            // Not a span of this clock: a driver that paces by another one pays for its own map.
            self.plant.step(span, self.integrator)
        }
    }

    /// Moves the body over `span` under the held force.
    #[inline(always)]
    pub(crate) fn advance<const A: usize>(&self, state: &mut State<A>, span: Duration, force: [f64; A]) {
        let other;
        let map = if span == self.short.0 {
            &self.short.1
        } else if span == self.long.0 {
            &self.long.1
        } else {
            // Not a span of this clock: a driver that paces by another one pays for its own map.
            other = self.plant.step(span, self.integrator);
            &other
        };
        for (axis, force) in force.into_iter().enumerate() {
            let mut body = state.along(axis);
            if self.free {
                map.advance_free(&mut body, force);
            } else {
                map.advance(&mut body, force);
            }
            state.set_along(axis, body);
        }
    }
}
