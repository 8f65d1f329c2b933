//! Step of a body against an independent computation: the same matrix exponential by its plain Taylor series, in double-double arithmetic (about 32 digits).
//! The series runs over steps so short that it converges at once, and the result is doubled as often as needed.

use std::time::Duration;

use cohaptic_peer::{Integrator, Motion, Plant};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

properties! {
    #![proptest_config(crate::cases(400))]

    /// Masses, springs, dampers and steps cover 12 decades each. Only two dimensionless numbers matter: the damping z = b·h/m and the squared angle w =
    /// k·h²/m of a step.
    #[test]
    fn a_step_is_the_matrix_exponential(
        mass in -6.0..6.0, step in -6.0..0.0, z in prop_oneof![Just(None), (-9.0..2.0).prop_map(Some)], w in prop_oneof![Just(None), (-9.0..3.0).prop_map(Some)],
    ) {
        let power = |exponent: f64| libm::exp10(exponent);
        let span = Duration::from_secs_f64(power(step));
        let (m, h) = (power(mass), span.as_secs_f64());
        let (z, w) = (z.map_or(0.0, power), w.map_or(0.0, power));
        let (b, k) = (z * m / h, w * m / (h * h));
        let ([[e00, e01], [e10, e11]], [g0, g1]) = Plant { mass: m, damping: b, stiffness: k }.step(span, Integrator::Exact).coefficients();
        // Made dimensionless: lengths, velocities times h, accelerations times h².
        let actual = [[e00, e01 / h, g0 * m / (h * h)], [e10 * h, e11, g1 * m / h]];
        let expected = reference(z, w);
        for (row, (actual, expected)) in actual.iter().zip(&expected).enumerate() {
            for (column, (actual, expected)) in actual.iter().zip(expected).enumerate() {
                // Halving until the norm is below 1/2 and doubling again: up to 60 doublings round each entry once, and each of the last log2(z + √w)
                // doublings can double the present error. Entries that are small because z and w are small keep their relative accuracy.
                let own = if column == 0 || (row, column) == (1, 1) { [[w, 1.0], [w, z + w]][row][column].min(1.0) } else { 1.0 };
                let tolerance = 64.0 * f64::EPSILON * (1.0 + z + w.sqrt()) * own.max(expected.abs());
                prop_assert!((actual - expected).abs() <= tolerance, "[{row}][{column}] at z = {z:e}, w = {w:e}: {actual:e}, expected {expected:e}");
            }
        }
    }
}

properties! {
    #![proptest_config(crate::cases(200))]

    /// One step of each method equals its textbook form, and not merely some form of its order: velocity first and the position with the new velocity; four
    /// slopes, weighted 1, 2, 2, 1. Doubles of moderate size have only a few roundings of the terms.
    #[test]
    fn one_step_of_each_other_method_is_that_method(
        mass in 0.1..2.0, damping in 0.0..20.0, stiffness in 0.0..2000.0, x in -1.0..1.0, v in -1.0..1.0, f in -5.0..5.0,
    ) {
        let span = Duration::from_millis(10);
        let h = span.as_secs_f64();
        let plant = Plant { mass, damping, stiffness };
        let slope = |x: f64, v: f64| (v, (f - damping * v - stiffness * x) / mass);
        let one_step = |integrator| {
            let mut body = Motion { position: x, velocity: v };
            plant.step(span, integrator).advance(&mut body, f);
            (body.position, body.velocity)
        };
        let close = |a: f64, b: f64| (a - b).abs() < 1e-11;
        let (position, velocity) = one_step(Integrator::SemiImplicitEuler { steps: 1 });
        let new = v + h * slope(x, v).1;
        prop_assert!(close(velocity, new) && close(position, x + h * new), "Euler: {position}, {velocity}");
        let (position, velocity) = one_step(Integrator::RungeKutta4 { steps: 1 });
        let (x1, v1) = slope(x, v);
        let (x2, v2) = slope(x + h / 2.0 * x1, v + h / 2.0 * v1);
        let (x3, v3) = slope(x + h / 2.0 * x2, v + h / 2.0 * v2);
        let (x4, v4) = slope(x + h * x3, v + h * v3);
        let expected = (x + h / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4), v + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4));
        prop_assert!(close(position, expected.0) && close(velocity, expected.1), "Runge and Kutta: {position}, {velocity}, expected {expected:?}");
    }
}

/// Returns the upper rows of exp(X) − I for X = [0 1 0; −w −z 1; 0 0 0].
fn reference(z: f64, w: f64) -> [[f64; 3]; 2] {
    let mut halvings = 0;
    let mut scale = 1.0;
    while (1.0 + z + w) * scale > 1.0 {
        scale *= 0.5;
        halvings += 1;
    }
    let entry = |value: f64| Double::from(value * scale);
    let x = [[entry(0.0), entry(1.0), entry(0.0)], [entry(-w), entry(-z), entry(1.0)], [Double::ZERO; 3]];
    // The first term left out has the factor 1/30! = 4e-33.
    let mut term = x;
    let mut increment = x;
    for n in 2..=30 {
        term = product(&term, &x).map(|row| row.map(|entry| entry.over(f64::from(n))));
        increment = sum(&increment, &term);
    }
    for _ in 0..halvings {
        increment = sum(&sum(&increment, &increment), &product(&increment, &increment));
    }
    [increment[0].map(Double::rounded), increment[1].map(Double::rounded)]
}

type Matrix = [[Double; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).fold(Double::ZERO, |sum, n| sum.plus(a[i][n].times(b[n][j])))))
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j].plus(b[i][j])))
}

/// Unevaluated sum of two doubles, the second at most half a unit in the last place of the first (Dekker 1971; Knuth's exact sum).
#[derive(Clone, Copy)]
struct Double(f64, f64);

impl Double {
    const ZERO: Self = Self(0.0, 0.0);

    fn from(value: f64) -> Self {
        Self(value, 0.0)
    }

    fn exact_sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let other = sum - a;
        Self(sum, (a - (sum - other)) + (b - other))
    }

    fn plus(self, other: Self) -> Self {
        let Self(high, low) = Self::exact_sum(self.0, other.0);
        Self::exact_sum(high, low + (self.1 + other.1))
    }

    fn times(self, other: Self) -> Self {
        let high = self.0 * other.0;
        let low = libm::fma(self.0, other.0, -high) + (self.0 * other.1 + self.1 * other.0);
        Self::exact_sum(high, low)
    }

    fn over(self, divisor: f64) -> Self {
        let high = self.0 / divisor;
        let rest = libm::fma(-high, divisor, self.0) + self.1;
        Self::exact_sum(high, rest / divisor)
    }

    fn rounded(self) -> f64 {
        self.0 + self.1
    }
}
