//! Step maps of a body, for the spans between ticks.

use core::time::Duration;

use crate::{Clock, Integrator, Motion, Plant, State, StepMap};

/// Advances one body along A axes by the spans between two ticks of a clock: one span without drift, or two spans that differ by a nanosecond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stepper {
    plant: Plant,
    integrator: Integrator,
    /// Shorter span \[ns\] and its map. Spans are whole numbers, because a comparison of two [`Duration`] compares seconds and nanoseconds.
    short: (u64, StepMap),
    /// Longer span \[ns\] and its map.
    long: (u64, StepMap),
    /// Shorter span \[ns\] if no spring ties the body to ground, so that [`StepMap::advance_free`] applies; [`NO_SPAN`] for any other body. A single comparison
    /// then tests the span and the kind of body.
    free: u64,
}

/// A number that [`nanos`] never returns.
const NO_SPAN: u64 = u64::MAX;

impl Stepper {
    /// Returns the stepper of a plant, with the maps of both spans of `clock`.
    pub(crate) fn new(plant: Plant, integrator: Integrator, clock: &Clock) -> Self {
        let (short, long) = clock.spans();
        let step = |span| (nanos(span), plant.step(span, integrator));
        let (short, long) = (step(short), step(long));
        Self { plant, integrator, short, long, free: free_span(&short, &long) }
    }

    /// Sets the damping towards ground [N·s/m], from the next step on.
    pub(crate) fn set_damping(&mut self, damping: f64) {
        self.plant.damping = damping;
        for (span, map) in [&mut self.short, &mut self.long] {
            *map = self.plant.step(Duration::from_nanos(*span), self.integrator);
        }
        self.free = free_span(&self.short, &self.long);
    }

    /// Returns the map of a step over `span`.
    #[inline]
    pub(crate) fn map(&self, span: Duration) -> StepMap {
        [&self.short, &self.long]
            .into_iter()
            .find(|known| known.0 == nanos(span))
            // A span of another clock: the driver that passes it pays for a new map at each call.
            .map_or_else(|| self.plant.step(span, self.integrator), |known| known.1)
    }

    /// Moves the body over `span` under the held force.
    #[inline(always)]
    pub(crate) fn advance<const A: usize>(&self, state: &mut State<A>, span: Duration, force: [f64; A]) {
        // The only span of a clock without drift. Its map is borrowed, and the other maps are chosen elsewhere: a choice would copy a map at each tick.
        let nanos = nanos(span);
        if nanos == self.free {
            advance_along(state, force, |body, force| self.short.1.advance_free(body, force));
        } else if nanos == self.short.0 {
            advance_along(state, force, |body, force| self.short.1.advance(body, force));
        } else {
            self.advance_otherwise(state, span, force);
        }
    }

    /// Moves the body over a span that is not the shorter span of its clock.
    #[cold]
    #[inline(never)]
    fn advance_otherwise<const A: usize>(&self, state: &mut State<A>, span: Duration, force: [f64; A]) {
        let map = self.map(span);
        // The terms of the position are zero for a free body.
        if self.free == NO_SPAN {
            advance_along(state, force, |body, force| map.advance(body, force));
        } else {
            advance_along(state, force, |body, force| map.advance_free(body, force));
        }
    }
}

/// Moves the body along each axis.
#[inline(always)]
fn advance_along<const A: usize>(state: &mut State<A>, force: [f64; A], advance: impl Fn(&mut Motion, f64)) {
    for (axis, force) in force.into_iter().enumerate() {
        let mut body = state.along(axis);
        advance(&mut body, force);
        state.set_along(axis, body);
    }
}

/// Returns [`Stepper::free`] for the two spans of a clock with their maps.
fn free_span(short: &(u64, StepMap), long: &(u64, StepMap)) -> u64 {
    if short.1.is_free() && long.1.is_free() { short.0 } else { NO_SPAN }
}

/// Returns a span \[ns\]. A span of 584 years or more counts as the longest span below [`NO_SPAN`].
#[inline(always)]
fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(NO_SPAN).min(NO_SPAN - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body with a spring has a step of its own over every span, the longest spans included: no span is taken for the span of a free body.
    #[test]
    fn a_spring_acts_over_every_span() {
        let (plant, integrator) = (Plant { mass: 1e30, damping: 0.0, stiffness: 1.0 }, Integrator::SemiImplicitEuler { steps: 1 });
        for tick in [1_000_000, u64::MAX] {
            let stepper = Stepper::new(plant, integrator, &Clock::regular(Duration::from_nanos(tick)));
            for span in [0, 1, 1_000_000, u64::MAX - 1, u64::MAX].map(Duration::from_nanos) {
                let mut state = State { position: [1e30], velocity: [0.0] };
                let mut expected = state.along(0);
                stepper.advance(&mut state, span, [0.0]);
                plant.step(span, integrator).advance(&mut expected, 0.0);
                assert_eq!(state.along(0), expected, "{span:?}");
                assert_eq!(span.is_zero(), expected.velocity == 0.0);
            }
        }
    }
}
