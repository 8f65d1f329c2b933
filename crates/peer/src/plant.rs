//! Motion between ticks: a body along an axis, with held inputs.
//!
//! The body obeys m·a = f − b·v − k·x with the force f held over the step. Over one step h its state moves by a linear map
//!
//! ```text
//! Δx = e00·x + e01·v + g0·f        [e g] = the upper rows of exp([A B; 0 0]·h) − I
//! Δv = e10·x + e11·v + g1·f        A = [0 1; −k/m −b/m],  B = [0; 1/m]
//! ```
//!
//! The map is computed once per body. The augmented matrix needs no inverse of A, which is singular for a free body (k = 0). The *increment* exp − I keeps
//! full relative accuracy for small steps, and an input without effect gets an exact zero: the step of a free body does not depend on its position. The steps
//! of Euler and of Runge and Kutta are linear maps too, so the three integrators cost the same to run and differ only in accuracy.

use core::time::Duration;

use crate::{Motion, Number};

/// Method that computes the motion between ticks.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Integrator {
    /// The matrix exponential: exact up to rounding.
    #[default]
    Exact,
    /// Semi-implicit (symplectic) Euler: velocity first, then position with the new velocity. First order.
    SemiImplicitEuler {
        /// Steps per tick, at least 1.
        steps: u32,
    },
    /// The classical Runge–Kutta method. Fourth order.
    RungeKutta4 {
        /// Steps per tick, at least 1.
        steps: u32,
    },
}

/// A body along an axis: m·a = f − b·v − k·x.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plant {
    /// Mass m \[kg\], above zero.
    pub mass: f64,
    /// Viscous damping b towards ground [N·s/m].
    pub damping: f64,
    /// Stiffness k towards the origin [N/m].
    pub stiffness: f64,
}

/// The linear map of one step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StepMap<C = f64> {
    /// Increment by the state: row 0 for the position, row 1 for the velocity.
    state: [[C; 2]; 2],
    /// Increment by the held force.
    force: [C; 2],
}

/// Largest angle of an oscillation within a step, in radians, that an exact map carries: at this angle 64 roundings times the angle are 2·10⁻⁷.
const MOST_ANGLE: f64 = 16_777_216.0;

impl Plant {
    /// Returns the map of a step of that length.
    ///
    /// Coefficients of an exact map are NaN where nothing is left of their digits: each doubling of the exponential doubles the relative error of an
    /// oscillation, so a body that turns by more than 2²⁴ rad within the step, and is not at rest by its end, has no map. Without this rule the doubling
    /// would end at one of its fixed points, and the body would stop.
    #[must_use]
    pub fn step(&self, span: Duration, integrator: Integrator) -> StepMap {
        let h = span.as_secs_f64();
        // Without a phase there is no map: NaN makes the loss visible in every later state.
        let increment = match integrator {
            Integrator::Exact if self.is_lost(h) => [[f64::NAN; 3]; 3],
            Integrator::Exact => exponential_increment(self.augmented(h)),
            Integrator::SemiImplicitEuler { steps } => repeated(self.semi_implicit_euler(h / f64::from(steps)), steps),
            Integrator::RungeKutta4 { steps } => repeated(taylor(self.augmented(h / f64::from(steps)), 4), steps),
        };
        // The third row of the augmented matrix stays zero: the held force does not change.
        let [[e00, e01, g0], [e10, e11, g1], _] = increment;
        StepMap { state: [[e00, e01], [e10, e11]], force: [g0, g1] }
    }

    /// Returns by how much the rounding of an exact map exceeds that of a short step: 1 + b·h/m + h·√(k/m). The relative error of a coefficient is at most
    /// 64 roundings times this factor, compared with the larger of the coefficient and its size in units of h and m.
    #[must_use]
    pub fn rounding_factor(&self, span: Duration) -> f64 {
        let h = span.as_secs_f64();
        1.0 + self.damping / self.mass * h + self.angle(h)
    }

    /// Returns h·√(k/m), the angle of the undamped oscillation in a step \[rad\].
    fn angle(&self, h: f64) -> f64 {
        h * libm::sqrt(self.stiffness / self.mass)
    }

    /// Returns whether an oscillation is left at the end of the step and rounding has destroyed its phase.
    fn is_lost(&self, h: f64) -> bool {
        let (decay, angle) = (self.damping / self.mass * h, self.angle(h));
        // Beyond critical damping nothing oscillates, and each doubling halves the error again.
        decay < 2.0 * angle && angle * libm::exp(-0.5 * decay) > MOST_ANGLE
    }

    /// Returns \[A B; 0 0\]·h.
    fn augmented(&self, h: f64) -> Matrix {
        [[0.0, h, 0.0], [-self.stiffness / self.mass * h, -self.damping / self.mass * h, h / self.mass], [0.0; 3]]
    }

    /// Returns the increment of v⁺ = v + h·(f − b·v − k·x)/m, x⁺ = x + h·v⁺.
    fn semi_implicit_euler(&self, h: f64) -> Matrix {
        // The new velocity moves the position, so the position row is h times the velocity row, plus h·v.
        let velocity = self.augmented(h)[1];
        [[h * velocity[0], h + h * velocity[1], h * velocity[2]], velocity, [0.0; 3]]
    }
}

impl<C> StepMap<C> {
    /// Returns the map with these coefficients: increments by (x, v) row by row, then by the force.
    #[must_use]
    pub const fn new(state: [[C; 2]; 2], force: [C; 2]) -> Self {
        Self { state, force }
    }

    /// Returns the map with `coefficient` applied to each coefficient: increments by (x, v) row by row, then by the force.
    #[must_use]
    #[inline(always)]
    pub fn map<D>(&self, mut coefficient: impl FnMut(&C) -> D) -> StepMap<D> {
        let mut row = |[by_first, by_second]: &[C; 2]| [coefficient(by_first), coefficient(by_second)];
        StepMap { state: [row(&self.state[0]), row(&self.state[1])], force: row(&self.force) }
    }
}

impl<C: Copy> StepMap<C> {
    /// Returns the coefficients: increments by (x, v) row by row, then by the force.
    #[must_use]
    pub const fn coefficients(&self) -> ([[C; 2]; 2], [C; 2]) {
        (self.state, self.force)
    }
}

impl<N: Number> StepMap<N> {
    /// Moves a body by one step under the held force `force`.
    #[inline(always)]
    pub fn advance(&self, body: &mut Motion<N>, force: N) {
        let Motion { position: x, velocity: v } = *body;
        body.position = x + (self.state[0][0] * x + self.state[0][1] * v + self.force[0] * force);
        body.velocity = v + (self.state[1][0] * x + self.state[1][1] * v + self.force[1] * force);
    }

    /// Like [`StepMap::advance`], for a free body: the terms that are zero are left out. The result is equal to the bit, unless the position is infinite or
    /// NaN.
    #[inline(always)]
    pub fn advance_free(&self, body: &mut Motion<N>, force: N) {
        let Motion { position: x, velocity: v } = *body;
        body.position = x + (self.state[0][1] * v + self.force[0] * force);
        body.velocity = v + (self.state[1][1] * v + self.force[1] * force);
    }
}

impl StepMap {
    /// Returns whether the increment is independent of the position. The map then belongs to a body without a spring to ground.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.state[0][0] == 0.0 && self.state[1][0] == 0.0
    }
}

type Matrix = [[f64; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    core::array::from_fn(|i| core::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// Returns exp(X) − I by scaling and squaring: the increment of the halved step by its Taylor series, then E ← 2E + E² for every halving.
fn exponential_increment(x: Matrix) -> Matrix {
    // The largest sum of absolute values of a row bounds the matrix in the maximum norm.
    let norm = x.iter().map(|row| row.iter().map(|entry| entry.abs()).sum()).fold(0.0, f64::max);
    let mut halvings = 0;
    let mut scale = 1.0;
    // Past 1100 halvings no finite norm is left above a half.
    while norm * scale > 0.5 && halvings < 1100 {
        scale *= 0.5;
        halvings += 1;
    }
    let scaled = x.map(|row| row.map(|entry| entry * scale));
    // The first term left out is below 0.5^17/17! = 2e-20 of the first one kept.
    let mut increment = taylor(scaled, 16);
    for _ in 0..halvings {
        increment = doubled(&increment);
    }
    increment
}

/// Returns X + X²/2! + … + Xⁿ/n! by Horner's rule.
fn taylor(x: Matrix, order: u32) -> Matrix {
    let mut nested = [[0.0; 3]; 3];
    for n in (1..=order).rev() {
        // nested ← X/n·(I + nested)
        // Computed as X·nested + X: an added identity would cost the digits of a small X.
        let plus_identity = sum(&product(&x, &nested), &x);
        nested = plus_identity.map(|row| row.map(|entry| entry / f64::from(n)));
    }
    nested
}

/// Returns the increment of two steps: (I + E)² − I.
fn doubled(e: &Matrix) -> Matrix {
    sum(&sum(e, e), &product(e, e))
}

/// Returns the increment of `count` equal steps, by repeated squaring.
fn repeated(step: Matrix, count: u32) -> Matrix {
    let mut total = [[0.0; 3]; 3];
    let mut power = step;
    let mut left = count;
    while left > 0 {
        if left % 2 == 1 {
            // (I + total)·(I + power) − I
            total = sum(&sum(&total, &power), &product(&total, &power));
        }
        // `power` is the increment of 1, 2, 4, … steps.
        power = doubled(&power);
        left /= 2;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(1);

    fn close(actual: f64, expected: f64, relative: f64) {
        assert!((actual - expected).abs() <= relative * expected.abs(), "{actual:e} is not within {relative:e} of {expected:e}");
    }

    /// The closed form of a damped free body is Δv = −(1 − e^{−bh/m})·v + …, with `expm1` as the independent reference.
    #[test]
    fn a_damped_free_body_moves_as_the_closed_form_says() {
        for (mass, damping) in [(0.1, 5.0), (0.15, 1e-9), (1e-6, 5.0), (1e3, 5.0), (0.1, 500.0)] {
            let map = Plant { mass, damping, stiffness: 0.0 }.step(TICK, Integrator::Exact);
            // `decay` and `reached` are velocity lost and distance travelled per unit of velocity.
            let h = 1e-3;
            let decay = -libm::expm1(-damping / mass * h);
            let reached = decay * mass / damping;
            // Squaring doubles the relative error each time; the stiffest case, b·h/m = 5000, takes 14 of them.
            close(map.state[1][1], -decay, 1e-11);
            close(map.state[0][1], reached, 1e-11);
            close(map.force[1], decay / damping, 1e-11);
            if damping > 1.0 {
                close(map.force[0], (h - reached) / damping, 1e-9);
            }
            assert!(map.is_free());
        }
    }

    #[test]
    fn an_undamped_free_body_moves_as_newton_says() {
        let map = Plant { mass: 0.15, damping: 0.0, stiffness: 0.0 }.step(TICK, Integrator::Exact);
        let mut body = Motion { position: 1.0, velocity: 2.0 };
        map.advance(&mut body, 3.0);
        close(body.position, 1.0 + 2.0e-3 + 3.0 / 0.15 * 0.5e-6, 1e-15);
        close(body.velocity, 2.0 + 3.0 / 0.15 * 1e-3, 1e-15);
    }

    /// Without the rule of a lost phase, the doubling of the exponential falls to rest at angles of 10¹⁹ rad without a warning.
    #[test]
    fn an_oscillation_whose_phase_is_lost_has_no_map() {
        let map = |damping: f64, stiffness: f64| Plant { mass: 0.1, damping, stiffness }.step(TICK, Integrator::Exact);
        let is_lost = |map: StepMap| map.coefficients().0.as_flattened().iter().all(|coefficient| coefficient.is_nan());
        // The stiffness at which a mass of 0.1 kg turns by the greatest angle in 1 ms.
        let most = (MOST_ANGLE / 1e-3).powi(2) * 0.1;
        assert!(!is_lost(map(0.0, 0.999 * most)) && is_lost(map(0.0, 1.001 * most)) && is_lost(map(0.0, 1e45)));
        // An oscillation that has decayed to e^(−50) does not matter, and beyond critical damping nothing oscillates.
        assert!(!is_lost(map(1e4, 1.001 * most)) && !is_lost(map(1e45, 1e45)));
        let rest = map(1e4, 1.001 * most).coefficients().0;
        close(rest[0][0], -1.0, 1e-15);
        close(rest[1][1], -1.0, 1e-15);
    }

    /// An undamped spring: x(h) = cos(ωh), v(h) = −ω·sin(ωh) from (1, 0), up to thirty turns in one step.
    #[test]
    fn a_spring_oscillates_as_the_closed_form_says() {
        for stiffness in [1.0, 100.0, 1e6, 4e9] {
            let map = Plant { mass: 0.1, damping: 0.0, stiffness }.step(TICK, Integrator::Exact);
            let angle = libm::sqrt(stiffness / 0.1) * 1e-3;
            let mut body = Motion { position: 1.0, velocity: 0.0 };
            map.advance(&mut body, 0.0);
            let Motion { position: x, velocity: v } = body;
            assert!((x - libm::cos(angle)).abs() < 1e-9, "ωh = {angle}: {x} is not {}", libm::cos(angle));
            assert!((v * 1e-3 / angle + libm::sin(angle)).abs() < 1e-9);
        }
    }

    #[test]
    fn the_short_form_for_a_free_body_gives_the_same_bits() {
        let map = Plant { mass: 0.1, damping: 5.0, stiffness: 0.0 }.step(TICK, Integrator::Exact);
        for (position, velocity, f) in [(0.3, -0.2, 1.5), (0.0, 0.0, -1.5), (-1e6, 1e-3, 0.0), (-0.0, -0.0, 0.0)] {
            let mut full = Motion { position, velocity };
            let mut short = full;
            map.advance(&mut full, f);
            map.advance_free(&mut short, f);
            let bits = |body: Motion<f64>| (body.position.to_bits(), body.velocity.to_bits());
            assert_eq!(bits(full), bits(short));
        }
    }

    /// Halving the step of a method of order p divides its error by 2^p.
    #[test]
    fn the_other_integrators_converge_with_their_order() {
        let plant = Plant { mass: 0.1, damping: 5.0, stiffness: 3500.0 };
        let exact = plant.step(TICK, Integrator::Exact);
        let error = |integrator| (plant.step(TICK, integrator).state[1][0] - exact.state[1][0]).abs();
        let euler = |steps| error(Integrator::SemiImplicitEuler { steps });
        let runge_kutta = |steps| error(Integrator::RungeKutta4 { steps });
        // The number of steps doubles from coarse to fine, so the logarithm is the order.
        let order = |coarse: f64, fine: f64| libm::log2(coarse / fine);
        assert!((order(euler(8), euler(16)) - 1.0).abs() < 0.05);
        assert!((order(runge_kutta(8), runge_kutta(16)) - 4.0).abs() < 0.1);
    }
}
