//! Statistics of means that each unit, a group of people, has in every condition.

use cohaptic_campaign::Estimate;
use cohaptic_wan::random::{Purpose, Stream};

/// Largest number of units for which all sign flips are counted; 2²⁰ are a million.
const MOST_EXACT: usize = 20;

/// Number of drawn sign flips above [`MOST_EXACT`] units.
const DRAWN: u64 = 1_000_000;

/// Number of units below which no sign flip test has a p below 0.05: with 5 units the least p is 2/2⁵ = 0.0625.
pub const LEAST_UNITS: usize = 6;

/// Means of a condition with the interval of Cousineau and Morey.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ConditionMean {
    /// Mean over the units.
    pub mean: f64,
    /// Half of the width of the interval of 95 %; `None` for a single unit.
    pub half_width: Option<f64>,
}

/// Returns the mean of each condition with its interval of 95 % (Cousineau 2005, corrected by Morey 2008): the values less the mean of their unit, plus the
/// mean of all; then Student's t·s/√n, times √(C/(C−1)) with C conditions. Differences between the units do not widen the intervals.
///
/// `rows`: values of each unit, indexed by condition; all rows have the same length. Empty for no rows.
#[must_use]
pub fn condition_means(rows: &[Vec<f64>]) -> Vec<ConditionMean> {
    let conditions = rows.first().map_or(0, Vec::len);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / float(values.len());
    let all: Vec<f64> = rows.iter().flatten().copied().collect();
    let unit_means: Vec<f64> = rows.iter().map(|row| mean(row)).collect();
    let of = |condition: usize| {
        // A single condition has no differences within a unit: the plain interval of Student.
        let (normalised, factor): (Vec<f64>, f64) = if conditions > 1 {
            let normalised = rows.iter().zip(&unit_means).map(|(row, unit)| row[condition] - unit + mean(&all));
            (normalised.collect(), libm::sqrt(float(conditions) / (float(conditions) - 1.0)))
        } else {
            (rows.iter().map(|row| row[condition]).collect(), 1.0)
        };
        // The mean is taken of the measured values: normalised values have the same mean, but with the rounding of two more sums.
        let values: Vec<f64> = rows.iter().map(|row| row[condition]).collect();
        // Normalising also removes a part of the variance within the units, by the factor (C−1)/C. The correction of Morey restores this part.
        let half_width = Estimate::of(&normalised).and_then(|estimate| estimate.half_width).map(|half| half * factor);
        ConditionMean { mean: Estimate::of(&values).map_or(f64::NAN, |estimate| estimate.mean), half_width }
    };
    (0..conditions).map(of).collect()
}

/// Difference of a condition to another one over the same units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Difference {
    /// Mean difference with Student's interval of 95 %.
    pub estimate: Estimate,
    /// Effect size d_z: the mean over the standard deviation of the differences; `None` if these are all equal.
    pub effect: Option<f64>,
    /// Two-sided p of the sign flip test.
    pub p: f64,
    /// p after the correction of Holm over all differences of the measure.
    pub p_holm: f64,
}

/// Returns the difference of each condition but the first to the first. `rows` as in [`condition_means`]. `seed`: seed of the draws of [`sign_flip`].
#[must_use]
pub fn differences_to_first(rows: &[Vec<f64>], seed: u64) -> Vec<Difference> {
    let conditions = rows.first().map_or(0, Vec::len);
    let of = |condition: usize| {
        // Differences are taken within each unit, so that slow and fast groups do not widen the interval.
        let differences: Vec<f64> = rows.iter().map(|row| row[condition] - row[0]).collect();
        let estimate = Estimate::of(&differences)?;
        let p = sign_flip(&differences, seed);
        Some(Difference { estimate, effect: effect(&differences), p, p_holm: p })
    };
    let mut all: Vec<Difference> = (1..conditions).filter_map(of).collect();
    // Holm's correction depends on all p of the measure, so every difference is made with its plain p first.
    let corrected = holm(&all.iter().map(|difference| difference.p).collect::<Vec<f64>>());
    for (difference, p) in all.iter_mut().zip(corrected) {
        difference.p_holm = p;
    }
    all
}

/// Returns the effect size d_z (Cohen 1988): the mean over the standard deviation; `None` for fewer than two values, and for values that differ by rounding
/// alone.
#[must_use]
pub fn effect(differences: &[f64]) -> Option<f64> {
    let n = float(differences.len());
    let mean = differences.iter().sum::<f64>() / n;
    // Fewer than two values make NaN, in the mean or in the variance, and are refused below by their number.
    let variance = differences.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
    let deviation = libm::sqrt(variance);
    // Equal values can have a mean that is rounded, and then a deviation from the mean of about 1e-16 of their size. An effect of 1e16 would be no finding.
    let rounding = 1e-12 * differences.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    (differences.len() > 1 && deviation > rounding).then(|| mean / deviation)
}

/// Returns the two-sided p of the sign flip test (Fisher 1935): the share of all choices of signs of the differences whose sum is at least as far from zero as
/// the observed sum. Above 20 differences, the share among 10⁶ choices by draws of `seed`, the observed choice included.
#[must_use]
pub fn sign_flip(differences: &[f64], seed: u64) -> f64 {
    let observed = differences.iter().sum::<f64>().abs();
    // Sums of the same numbers in another order differ by rounding. A sum that equals the observed one must count, so that p never is too small.
    let tolerance = 1e-12 * differences.iter().map(|value| value.abs()).sum::<f64>();
    // Sums of eight differences for each choice of their signs, so that a choice of all signs takes an eighth of the additions. Bit k of a byte says whether
    // difference k of the eight is flipped.
    let signed = |(bit, value): (usize, &f64), byte: usize| if byte >> bit & 1 == 1 { -value } else { *value };
    let sums_of = |eight: &[f64]| core::array::from_fn(|byte| eight.iter().enumerate().map(|difference| signed(difference, byte)).sum());
    let sums: Vec<[f64; 256]> = differences.chunks(8).map(sums_of).collect();
    let counts = |signs: &[u64]| {
        let bytes = signs.iter().flat_map(|word| word.to_le_bytes());
        let sum: f64 = sums.iter().zip(bytes).map(|(sums, byte)| sums[usize::from(byte)]).sum();
        sum.abs() >= observed - tolerance
    };
    if differences.len() <= MOST_EXACT {
        // Bit k of a number says whether difference k is flipped. Number 0 is the observed choice, so p is always above zero.
        let all = 1_u64 << differences.len();
        let extreme = (0..all).filter(|signs| counts(&[*signs])).count();
        return float(extreme) / float(usize::try_from(all).unwrap_or(usize::MAX));
    }
    let stream = Stream::new(seed, b"study flips");
    let mut signs = vec![0; differences.len().div_ceil(64)];
    let extreme = (0..DRAWN).filter(|number| {
        // Each choice has draws under its own number, so that p does not depend on the order in which the choices are counted.
        let mut draws = stream.packet(*number).draws(Purpose::Study);
        signs.fill_with(|| draws.next_word());
        counts(&signs)
    });
    // The observed signs are a choice too: without this one, p could be 0.
    (1.0 + float(extreme.count())) / (1.0 + 1e6)
}

/// Returns the p of each test after the correction of Holm (1979).
#[must_use]
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    // Holm's procedure goes from the smallest p to the largest: the factor of a p is the number of tests not yet passed.
    order.sort_by(|one, other| p[*one].total_cmp(&p[*other]));
    let (mut corrected, mut largest) = (vec![1.0; p.len()], 0.0_f64);
    for (rank, place) in order.into_iter().enumerate() {
        // Never below the corrected p of a smaller p.
        largest = largest.max((float(p.len() - rank) * p[place]).min(1.0));
        corrected[place] = largest;
    }
    corrected
}

#[expect(clippy::cast_precision_loss, reason = "fewer than 2^52")]
const fn float(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    /// Source of the expected values: a program that shares no code with this crate.
    #[test]
    fn the_sign_flip_test_of_six_differences_is_exact() {
        let differences = [0.31, 0.52, -0.14, 0.83, 0.40, 0.22];
        assert_eq!(sign_flip(&differences, 0), 0.0625);
        assert!((effect(&differences).unwrap() - 1.105_835).abs() < 5e-7);
    }

    /// Source of the expected values: a program that shares no code with this crate.
    #[test]
    fn intervals_within_units_are_those_of_cousineau_and_morey() {
        let rows = [[4.1, 4.9, 6.2], [3.8, 4.1, 5.0], [5.2, 5.6, 7.4], [4.4, 4.6, 5.1], [6.0, 6.9, 8.3], [3.9, 4.6, 5.8]].map(Vec::from);
        let means = condition_means(&rows);
        for (mean, expected) in means.iter().zip([0.380_717, 0.166_299, 0.456_166]) {
            assert!((mean.half_width.unwrap() - expected).abs() < 5e-7, "{mean:?} and {expected}");
        }
        assert!((means[0].mean - 27.4 / 6.0).abs() < 1e-12);
        let [second, third] = differences_to_first(&rows, 0).try_into().unwrap();
        assert_eq!((second.p, third.p), (0.031_25, 0.031_25));
        assert!((second.effect.unwrap() - 1.909_078).abs() < 5e-7);
        // Two equal p: both are doubled.
        assert_eq!((second.p_holm, third.p_holm), (0.0625, 0.0625));
    }

    #[test]
    fn equal_differences_have_no_effect_size() {
        // 0.1 three times has the mean 0.10000000000000002, and a deviation of 1.7e-17.
        for equal in [vec![0.1; 3], vec![-0.7; 7], vec![0.0; 5], vec![0.3], Vec::new()] {
            assert_eq!(effect(&equal), None, "{equal:?}");
        }
        assert!((effect(&[1e-9, 2e-9]).unwrap() - 1.5 * core::f64::consts::SQRT_2).abs() < 1e-9);
    }

    #[test]
    fn fewer_than_six_units_have_no_small_p() {
        let p = |units: usize| sign_flip(&vec![1.0; units], 0);
        assert_eq!(p(LEAST_UNITS - 1), 0.0625);
        assert_eq!(p(LEAST_UNITS), 0.031_25);
        // No difference at all, and nothing measured.
        assert_eq!((sign_flip(&[0.0; 7], 0), sign_flip(&[], 0)), (1.0, 1.0));
    }

    /// Source: Holm (1979), by hand: 0.01·4, 0.02·3, 0.03·2 = 0.06, 0.04·1 raised to 0.06.
    #[test]
    fn holm_multiplies_by_the_tests_left_and_never_falls() {
        let close = |found: Vec<f64>, expected: &[f64]| found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-15);
        assert!(close(holm(&[0.04, 0.01, 0.03, 0.02]), &[0.06, 0.04, 0.06, 0.06]));
        assert!(close(holm(&[0.9, 0.6]), &[1.0, 1.0]));
        assert!(holm(&[]).is_empty());
    }

    /// The drawn test has a standard deviation of √(p(1 − p)/10⁶), so 5·10⁻⁴ at most.
    #[test]
    fn drawn_flips_agree_with_a_normal_law_and_follow_the_seed() {
        // 40 differences of ±1, of which 27 are positive: the sum of signs has the binomial law, and p = 2·P(X ≥ 27) = 0.038477.
        let differences: Vec<f64> = (0..40).map(|place| if place < 27 { 1.0 } else { -1.0 }).collect();
        let (one, again, other) = (sign_flip(&differences, 1), sign_flip(&differences, 1), sign_flip(&differences, 2));
        assert_eq!(one, again);
        assert_ne!(one, other);
        assert!((one - 0.038_477).abs() < 5.0 * 2e-4, "{one}");
        // The same differences behind 100 zeros have their signs in other random words, and the same law.
        let late: Vec<f64> = core::iter::repeat_n(0.0, 100).chain(differences).collect();
        let late = sign_flip(&late, 1);
        assert!((late - 0.038_477).abs() < 5.0 * 2e-4, "{late}");
    }

    properties! {
        /// The signs and the order of the units do not matter, and a unit without a difference halves nothing.
        #[test]
        fn p_is_that_of_the_differences_as_a_set(differences in prop::collection::vec(-4_i32..=4, 1..9)) {
            let values: Vec<f64> = differences.iter().map(|value| f64::from(*value) * 0.1).collect();
            let p = sign_flip(&values, 0);
            prop_assert!(p > 0.0 && p <= 1.0);
            let turned: Vec<f64> = values.iter().rev().map(|value| -value).collect();
            prop_assert_eq!(sign_flip(&turned, 0), p);
            let with_zero: Vec<f64> = values.iter().copied().chain([0.0]).collect();
            prop_assert_eq!(sign_flip(&with_zero, 0), p);
        }

        /// Adding a constant to a unit moves the means and leaves every interval, difference and p.
        #[test]
        fn differences_between_units_do_not_count(rows in prop::collection::vec(prop::collection::vec(0_i32..50, 3), 2..8), shift in -100_i32..100) {
            let of = |shift: i32| -> Vec<Vec<f64>> {
                rows.iter().enumerate().map(|(place, row)| row.iter().map(|value| f64::from(value + if place == 0 { shift } else { 0 })).collect()).collect()
            };
            let (one, other) = (of(0), of(shift));
            for (mean, moved) in condition_means(&one).iter().zip(condition_means(&other)) {
                prop_assert!((mean.half_width.unwrap() - moved.half_width.unwrap()).abs() < 1e-9);
            }
            for (one, other) in differences_to_first(&one, 0).iter().zip(differences_to_first(&other, 0)) {
                prop_assert_eq!(one.p, other.p);
            }
        }
    }
}
