//! What a device feels like when it is moved slowly: a spring, a damper and a mass.
//!
//! The impedance Z = F/v has a series around ω = 0,
//!
//! ```text
//! Re Z = b + r·ω² + …        ω·Im Z = −k + m·ω² + s·ω⁴ + …
//! ```
//!
//! both parts in ω² alone. Their first coefficients are found by extrapolation to ω² = 0 (Richardson 1911): the frequency is halved again and again, a
//! table of differences (Neville) removes one term of the series after the other, and the entry is taken that changed least (Ridders 1982). That stops by
//! itself between frequencies that are too high for the series and those so low that rounding covers what is looked for.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// The spring, damper and mass that a device feels like as ω → 0: force = k·x + b·v + m·a.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LowFrequencyFit {
    /// The rendered stiffness k [N/m]: exactly 0 where nothing ties the object to ground.
    pub stiffness: Estimate,
    /// The rendered viscosity b [N·s/m].
    pub viscosity: Estimate,
    /// The rendered inertia m \[kg\]. Below zero where delays make the force lead.
    pub inertia: Estimate,
}

/// A limit that was extrapolated.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Estimate {
    /// The limit.
    pub value: f64,
    /// How far the best extrapolations are apart, and what rounding may add: about how far it may be off. Infinite where there is no limit.
    pub error: f64,
}

/// How many frequencies are tried, each half of the one before.
const FREQUENCIES: usize = 30;
/// How many terms of the series are removed at most: beyond that rounding grows faster than what is left shrinks.
const MOST_TERMS: usize = 8;
/// What an impedance may be rounded by, relative to its size: some units in the last place.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

impl LowFrequencyFit {
    /// From the impedance at any frequency up to `highest`, and whether anything ties the device to ground.
    pub(super) fn of(impedance: impl Fn(f64) -> Complex64, highest: f64, tied: bool) -> Self {
        let frequencies: Vec<f64> = std::iter::successors(Some(highest), |hz| Some(0.5 * hz)).take(FREQUENCIES).collect();
        let points: Vec<(f64, Complex64)> = frequencies.iter().map(|hz| (TAU * hz, impedance(*hz))).collect();
        // Each value with what rounding of the impedance makes of it.
        let noise = |z: &Complex64| ROUNDING * z.norm();
        let real: Vec<(f64, f64)> = points.iter().map(|(_, z)| (z.re, noise(z))).collect();
        let spring: Vec<(f64, f64)> = points.iter().map(|(omega, z)| (-omega * z.im, omega * noise(z))).collect();
        let mass: Vec<(f64, f64)> = if tied {
            // (p(ω²) − p(ω²/4)) / (3/4·ω²) of p = ω·Im Z has the series m + 5/4·s·ω² + …, again in ω².
            let pairs = points.windows(2).zip(spring.windows(2));
            pairs
                .map(|(point, spring)| (spring[1].0 - spring[0].0, spring[0].1, 0.75 * point[0].0 * point[0].0))
                .map(|(p, noise, h)| (p / h, 2.0 * noise / h))
                .collect()
        } else {
            points.iter().map(|(omega, z)| (z.im / omega, noise(z) / omega)).collect()
        };
        let stiffness = if tied { extrapolated(&spring) } else { Estimate { value: 0.0, error: 0.0 } };
        Self { stiffness, viscosity: extrapolated(&real), inertia: extrapolated(&mass) }
    }
}

/// The limit of a sequence whose terms have a series in h, at h, h/4, h/16, …; beside each term what rounding makes of it.
fn extrapolated(sequence: &[(f64, f64)]) -> Estimate {
    let mut best = Estimate { value: f64::NAN, error: f64::INFINITY };
    let mut before: Vec<f64> = Vec::new();
    for (value, noise) in sequence {
        let mut row = vec![*value];
        let mut power = 1.0;
        for (term, above) in before.iter().enumerate().take(MOST_TERMS) {
            power *= 4.0;
            let next = row[term] + (row[term] - above) / (power - 1.0);
            let apart = (next - row[term]).abs().max((next - above).abs());
            // Two entries of noise may agree by chance.
            let error = apart + noise;
            if error < best.error {
                best = Estimate { value: next, error };
            }
            row.push(next);
        }
        before = row;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_found(found: Estimate, expected: f64, relative: f64) {
        let off = (found.value - expected).abs();
        assert!(off <= relative * expected.abs() && off <= 2.0 * found.error, "{found:?} is not {expected}");
    }

    /// k/s + b + m·s with a delayed force g·(1 − e^{−sτ}): as s → 0 that adds g·τ·s, an inertia.
    #[test]
    fn a_spring_a_damper_and_a_mass_are_found_beside_a_delay() {
        for stiffness in [0.0, 300.0] {
            let impedance = |hz: f64| {
                let s = Complex64::new(0.0, TAU * hz);
                stiffness / s + 5.0 + 0.2 * s + 7.0 * (1.0 - (-s * 0.03).exp())
            };
            let fit = LowFrequencyFit::of(impedance, 20.0, stiffness > 0.0);
            assert_found(fit.stiffness, stiffness, 1e-9);
            assert_found(fit.viscosity, 5.0, 1e-9);
            assert_found(fit.inertia, 0.2 + 7.0 * 0.03, 1e-7);
        }
    }

    #[test]
    fn there_is_no_limit_where_there_are_no_numbers() {
        let fit = LowFrequencyFit::of(|_| Complex64::new(f64::NAN, f64::NAN), 20.0, false);
        assert!(fit.viscosity.value.is_nan() && fit.viscosity.error.is_infinite());
    }
}
