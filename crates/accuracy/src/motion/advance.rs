//! Methods of motion for a body from tick to tick under a held force.

use cohaptic_peer::{Motion, Number, Plant, StepMap};

/// A method of motion for a body along an axis over a tick.
pub(crate) trait Advance<T> {
    /// Moves a body by one tick under the held force \[N\].
    fn advance(&self, body: &mut Motion<T>, force: T);
}

/// The program's own map, in its short form for a body without a spring to ground, as peers of the program use it at every tick, for any integrator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Program {
    map: StepMap,
    free: bool,
}

impl Program {
    pub(crate) fn new(map: StepMap) -> Self {
        Self { map, free: map.is_free() }
    }
}

impl Advance<f64> for Program {
    #[inline(always)]
    fn advance(&self, body: &mut Motion, force: f64) {
        if self.free {
            self.map.advance_free(body, force);
        } else {
            self.map.advance(body, force);
        }
    }
}

/// Coefficients of a body and the length of a sub-step \[s\], as a loop over sub-steps uses them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stepped {
    inverse_mass: f64,
    damping: f64,
    stiffness: f64,
    h: f64,
    steps: u32,
}

impl Stepped {
    /// Returns the coefficients for `steps` sub-steps in a tick of the length `tick` \[s\].
    pub(crate) fn new(plant: &Plant, tick: f64, steps: u32) -> Self {
        Self { inverse_mass: 1.0 / plant.mass, damping: plant.damping, stiffness: plant.stiffness, h: tick / f64::from(steps), steps }
    }

    #[inline(always)]
    fn acceleration(&self, x: f64, v: f64, force: f64) -> f64 {
        (force - self.damping * v - self.stiffness * x) * self.inverse_mass
    }
}

/// Semi-implicit Euler by a loop over sub-steps: velocity first, then position with the new velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Euler(pub(crate) Stepped);

impl Advance<f64> for Euler {
    #[inline(always)]
    fn advance(&self, body: &mut Motion, force: f64) {
        for _ in 0..self.0.steps {
            body.velocity += self.0.h * self.0.acceleration(body.position, body.velocity, force);
            body.position += self.0.h * body.velocity;
        }
    }
}

/// The classical Runge–Kutta method by a loop over sub-steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RungeKutta(pub(crate) Stepped);

impl Advance<f64> for RungeKutta {
    #[inline(always)]
    fn advance(&self, body: &mut Motion, force: f64) {
        let h = self.0.h;
        let half = 0.5 * h;
        for _ in 0..self.0.steps {
            let Motion { position: x, velocity: v } = *body;
            // Slopes at the begin, twice in the middle, and at the end of the sub-step. The slope of a position is a velocity.
            let a1 = self.0.acceleration(x, v, force);
            let v2 = v + half * a1;
            let a2 = self.0.acceleration(x + half * v, v2, force);
            let v3 = v + half * a2;
            let a3 = self.0.acceleration(x + half * v2, v3, force);
            let v4 = v + h * a3;
            let a4 = self.0.acceleration(x + h * v3, v4, force);
            body.position = x + h / 6.0 * (v + 2.0 * (v2 + v3) + v4);
            body.velocity = v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
        }
    }
}

/// A map in any number type, with all its terms.
impl<T: Number> Advance<T> for StepMap<T> {
    fn advance(&self, body: &mut Motion<T>, force: T) {
        Self::advance(self, body, force);
    }
}
