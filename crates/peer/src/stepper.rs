//! Step maps of a body, for the spans between ticks.

use core::time::Duration;

use crate::{Clock, Integrator, Plant, State, StepMap};

/// Advances one body along A axes by the spans between two ticks of a clock: one span without drift, or two spans that differ by a nanosecond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stepper {
    plant: Plant,
    integrator: Integrator,
    /// Shorter span \[ns\] and its map. Spans are whole numbers, because a comparison of two [`Duration`] compares seconds and nanoseconds.
    short: (u64, StepMap),
    /// Longer span \[ns\] and its map.
    long: (u64, StepMap),
    /// `true` if no spring ties the body to ground, so that [`StepMap::advance_free`] applies.
    free: bool,
}

impl Stepper {
    /// Returns the stepper of a plant, with the maps of both spans of `clock`.
    pub(crate) fn new(plant: Plant, integrator: Integrator, clock: &Clock) -> Self {
        let (short, long) = clock.spans();
        let step = |span| (nanos(span), plant.step(span, integrator));
        let (short, long) = (step(short), step(long));
        Self { plant, integrator, short, long, free: short.1.is_free() && long.1.is_free() }
    }

    /// Sets the damping towards ground [N·s/m], from the next step on.
    pub(crate) fn set_damping(&mut self, damping: f64) {
        self.plant.damping = damping;
        for (span, map) in [&mut self.short, &mut self.long] {
            *map = self.plant.step(Duration::from_nanos(*span), self.integrator);
        }
        self.free = self.short.1.is_free() && self.long.1.is_free();
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
        if nanos(span) == self.short.0 { self.advance_by(&self.short.1, state, force) } else { self.advance_otherwise(state, span, force) }
    }

    #[cold]
    #[inline(never)]
    fn advance_otherwise<const A: usize>(&self, state: &mut State<A>, span: Duration, force: [f64; A]) {
        self.advance_by(&self.map(span), state, force);
    }

    #[inline(always)]
    fn advance_by<const A: usize>(&self, map: &StepMap, state: &mut State<A>, force: [f64; A]) {
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

/// Returns a span \[ns\]. A span of more than 584 years, which no two instants have between them, counts as the longest.
#[inline(always)]
fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}
