//! What a device feels like when it is moved slowly: a spring, a damper and a mass.
//!
//! The impedance Z = F/v has a series around ω = 0,
//!
//! ```text
//! Re Z = b + r·ω² + …        ω·Im Z = −k + m·ω² + s·ω⁴ + …
//! ```
//!
//! both parts in ω² alone. Their first coefficients are found by extrapolation to ω² = 0 (Richardson 1911): the frequency is halved again and again, a
//! table of differences (Neville) removes one term of the series after the other, and the entry is taken that changed least (Ridders 1982) over three
//! frequencies. That stops by itself between frequencies that are too high for the series and those so low that rounding covers the answer.

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
    /// How far the limit may be off: how far the extrapolations are apart from which it comes, and what rounding of the impedances does to it at most.
    /// Infinite where there is no limit.
    pub error: f64,
}

impl Estimate {
    const NONE: Self = Self { value: f64::NAN, error: f64::INFINITY };
}

/// How many frequencies are tried, each half of the one before.
const FREQUENCIES: usize = 30;
/// How many terms of the series are removed at most: beyond that rounding grows faster than the rest shrinks.
const MOST_TERMS: usize = 8;

impl LowFrequencyFit {
    /// No definite size.
    pub(super) const NONE: Self = Self { stiffness: Estimate::NONE, viscosity: Estimate::NONE, inertia: Estimate::NONE };

    /// From the impedance at any frequency up to `highest` with a bound of its rounding, and whether anything ties the device to ground.
    pub(super) fn of(impedance: impl Fn(f64) -> (Complex64, f64), highest: f64, tied: bool) -> Self {
        let frequencies: Vec<f64> = std::iter::successors(Some(highest), |hz| Some(0.5 * hz)).take(FREQUENCIES).collect();
        // A unit in the last place is for the operations on each here.
        let point = |hz: &f64| {
            let (z, noise) = impedance(*hz);
            (TAU * hz, z, noise + 2.0 * f64::EPSILON * z.norm())
        };
        let points: Vec<(f64, Complex64, f64)> = frequencies.iter().map(point).collect();
        // Each value with what rounding of the impedance makes of it.
        let real: Vec<(f64, f64)> = points.iter().map(|(_, z, noise)| (z.re, *noise)).collect();
        let spring: Vec<(f64, f64)> = points.iter().map(|(omega, z, noise)| (-omega * z.im, omega * noise)).collect();
        let mass: Vec<(f64, f64)> = if tied {
            // (p(ω²) − p(ω²/4)) / (3/4·ω²) of p = ω·Im Z has the series m + 5/4·s·ω² + …, again in ω².
            let pairs = points.windows(2).zip(spring.windows(2));
            pairs
                .map(|(point, spring)| (spring[1].0 - spring[0].0, spring[0].1 + spring[1].1, 0.75 * point[0].0 * point[0].0))
                .map(|(p, noise, h)| (p / h, noise / h))
                .collect()
        } else {
            points.iter().map(|(omega, z, noise)| (z.im / omega, noise / omega)).collect()
        };
        let stiffness = if tied { extrapolated(&spring) } else { Estimate { value: 0.0, error: 0.0 } };
        Self { stiffness, viscosity: extrapolated(&real), inertia: extrapolated(&mass) }
    }
}

/// The limit of a sequence whose terms have a series in h, at h, h/4, h/16, …; beside each term what rounding makes of it at most.
///
/// An entry of the table is (4ᵏ·a − b)/(4ᵏ − 1) of two entries before it, so that what rounding makes of it is at most (4ᵏ·α + β)/(4ᵏ − 1) of theirs: that
/// is carried along beside the entries, as it grows quickly where the terms themselves are divided by h.
///
/// A series may seem to converge to the impedance in some range of frequencies above the lowest ones. So each frequency has its own estimate, and the best is
/// taken of those from the lowest frequency up to the first that contradicts them.
fn extrapolated(sequence: &[(f64, f64)]) -> Estimate {
    let mut estimates = Vec::with_capacity(sequence.len());
    let (mut before, mut earlier) = (Vec::<(f64, f64)>::new(), Vec::<(f64, f64)>::new());
    for (value, noise) in sequence {
        let mut best = Estimate::NONE;
        let mut row = vec![(*value, *noise)];
        let mut power = 1.0;
        for (term, (above, noise_above)) in before.iter().enumerate().take(MOST_TERMS) {
            power *= 4.0;
            let (here, noise_here) = row[term];
            let next = here + (here - above) / (power - 1.0);
            let noise = (power * noise_here + noise_above) / (power - 1.0) + 2.0 * f64::EPSILON * next.abs();
            // Above the first resonance terms follow no series, and two of them may agree by chance: those of three frequencies must.
            let before_that = earlier.get(term).map_or(f64::INFINITY, |(entry, _)| (above - entry).abs());
            let error = (next - here).abs().max((next - above).abs()).max(before_that) + noise;
            if error < best.error {
                best = Estimate { value: next, error };
            }
            row.push((next, noise));
        }
        estimates.push(best);
        earlier = std::mem::replace(&mut before, row);
    }
    let mut best = Estimate::NONE;
    for estimate in estimates.into_iter().rev().filter(|estimate| estimate.error.is_finite()) {
        if (estimate.value - best.value).abs() > estimate.error + best.error {
            break;
        }
        if estimate.error < best.error {
            best = estimate;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_found(found: Estimate, expected: f64, relative: f64) {
        let off = (found.value - expected).abs();
        assert!(off <= relative * expected.abs() && off <= found.error, "{found:?} is not {expected}");
    }

    /// k/s + b + m·s with a delayed force g·(1 − e^{−sτ}): as s → 0 that adds g·τ·s, an inertia.
    #[test]
    fn a_spring_a_damper_and_a_mass_are_found_beside_a_delay() {
        for stiffness in [0.0, 300.0] {
            let impedance = |hz: f64| {
                let s = Complex64::new(0.0, TAU * hz);
                let z = stiffness / s + 5.0 + 0.2 * s + 7.0 * (1.0 - (-s * 0.03).exp());
                // Of sums of numbers up to 7, and of the spring.
                (z, 4.0 * f64::EPSILON * (14.0 + z.norm()))
            };
            let fit = LowFrequencyFit::of(impedance, 20.0, stiffness > 0.0);
            assert_found(fit.stiffness, stiffness, 1e-9);
            assert_found(fit.viscosity, 5.0, 1e-9);
            assert_found(fit.inertia, 0.2 + 7.0 * 0.03, 1e-7);
        }
    }

    /// 5 N·s/m at 0.1 Hz and above, and 10⁴ N·s/m below some µHz: the lowest frequencies count.
    #[test]
    fn a_range_of_frequencies_in_which_something_else_is_felt_is_no_limit() {
        let impedance = |hz: f64| {
            let z = 5.0 + 1e4 / (1.0 + Complex64::new(0.0, hz / 3e-6));
            (z, 4.0 * f64::EPSILON * (1e4 + z.norm()))
        };
        assert_found(LowFrequencyFit::of(impedance, 30.0, false).viscosity, 10_005.0, 1e-9);
    }

    #[test]
    fn there_is_no_limit_where_there_are_no_numbers() {
        let fit = LowFrequencyFit::of(|_| (Complex64::new(f64::NAN, f64::NAN), f64::NAN), 20.0, false);
        assert!(fit.viscosity.value.is_nan() && fit.viscosity.error.is_infinite());
    }
}
