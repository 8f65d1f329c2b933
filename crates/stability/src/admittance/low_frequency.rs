//! The spring, damper and mass that a hand feels in slow motion of a device, extrapolated from the impedance at falling frequencies.
//!
//! The impedance Z = F/v has a series around ω = 0,
//!
//! ```text
//! Re Z = b + r·ω² + …        ω·Im Z = −k + m·ω² + s·ω⁴ + …
//! ```
//!
//! both parts in ω² alone. The first coefficients are found by extrapolation to ω² = 0 (Richardson 1911). The frequency is halved repeatedly, a table of
//! differences (Neville) removes one term of the series after the other, and the entry that changed least over three frequencies is taken (Ridders 1982).
//! This choice lies between frequencies that are too high for the series and frequencies so low that rounding dominates.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// Stiffness, viscosity and inertia of a device in the limit ω → 0, where force = k·x + b·v + m·a.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LowFrequencyFit {
    /// The rendered stiffness k [N/m]: exactly 0 where nothing ties the object to ground.
    pub stiffness: Estimate,
    /// The rendered viscosity b [N·s/m].
    pub viscosity: Estimate,
    /// The rendered inertia m \[kg\]. Negative if delays make the force lead.
    pub inertia: Estimate,
}

/// An extrapolated limit with a bound of its error.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Estimate {
    /// Extrapolated value of the limit; NaN if there is no limit.
    pub value: f64,
    /// Possible error of the value: the largest distance between the extrapolations from which the value comes, plus the largest effect of the impedances'
    /// rounding. Infinite if there is no limit.
    pub error: f64,
}

impl Estimate {
    const NONE: Self = Self { value: f64::NAN, error: f64::INFINITY };
}

/// Number of frequencies in an extrapolation, each half of the frequency before.
const FREQUENCIES: usize = 30;
/// Largest number of terms of the series that are removed. With more terms, rounding grows faster than the remainder shrinks.
const MOST_TERMS: usize = 8;

impl LowFrequencyFit {
    /// Fit without any limit: all values NaN, all errors infinite.
    pub(super) const NONE: Self = Self { stiffness: Estimate::NONE, viscosity: Estimate::NONE, inertia: Estimate::NONE };

    /// Fits the impedance, which `impedance` gives with a bound of its rounding error for any frequency up to `highest` \[Hz\]. `tied` tells whether anything
    /// ties the device to ground; if nothing does, the stiffness is exactly 0.
    pub(super) fn of(impedance: impl Fn(f64) -> (Complex64, f64), highest: f64, tied: bool) -> Self {
        let frequencies: Vec<f64> = std::iter::successors(Some(highest), |hz| Some(0.5 * hz)).take(FREQUENCIES).collect();
        // Two units in the last place are added for the rounding of the operations on each impedance below.
        let point = |hz: &f64| {
            let (z, noise) = impedance(*hz);
            (TAU * hz, z, noise + 2.0 * f64::EPSILON * z.norm())
        };
        let points: Vec<(f64, Complex64, f64)> = frequencies.iter().map(point).collect();
        // Each value is paired with a bound of the error that the impedance's rounding causes in the value.
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

/// Extrapolates a sequence to h = 0. The terms, each paired with a bound of its rounding error, are the values at h, h/4, h/16, … of a series in h.
///
/// An entry of the table is (4ᵏ·a − b)/(4ᵏ − 1) for two earlier entries a and b. If α and β bound the rounding of a and b, the rounding of the entry is at
/// most (4ᵏ·α + β)/(4ᵏ − 1). This bound is carried with each entry, because it grows quickly if the terms themselves are divided by h.
///
/// In a range of frequencies above the lowest, the table may seem to converge to a value that is not the limit. Each frequency therefore has its own estimate.
/// The result is the best of the estimates from the lowest frequency up to the first estimate that contradicts those below.
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
