//! Uncertainty of figures of a correlated series, by the means of batches.
//!
//! Input is a series of numbers in order of time. Output is a standard error or an interval, or a number of batches whose means are nearly independent.
//!
//! The means of batches tell the uncertainty of the mean of a series under any law, if a batch is much longer than the memory of the series. The memory is
//! the integrated autocorrelation time τ = 1 + 2·Σ rₖ of the means of up to 240 fine batches, summed up to the first lag of 3τ or more (Sokal 1997, "Monte
//! Carlo methods in statistical mechanics", section 3). A batch has a length of at least 4τ. For a series with exponential memory e^(−t/T), with τ = 2T,
//! neighbouring batches are then correlated by 7 % at most. This correlation lowers the variance of a mean of length L by the share T/L, which is put back.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::series::{NORMAL_975, count, floor, mean, variance, wilson, wilson_of_effective};

/// Greatest number of batches used: Schmeiser (1982, Operations Research 30(3)) found 10 to 30 to be enough for any length.
pub(crate) const MOST: usize = 30;
/// Fewest numbers in a batch whose mean is used.
const LEAST_LENGTH: usize = 10;
/// Number of fine batches for measuring the memory.
const FINE: usize = 240;
/// Shortest length of a batch \[τ\].
const LENGTH: f64 = 4.0;
/// Largest lag of the sum of autocorrelations \[τ\].
const WINDOW: f64 = 3.0;

/// Fewest numbers whose mean gets a standard error.
const LEAST_NUMBERS: usize = 300;
/// Fewest batches whose means tell the uncertainty of the mean of all numbers.
const LEAST_BATCHES: usize = 10;
/// Quantile 0.975 of Student's law with 29 degrees of freedom, for 30 batches.
const STUDENT_975: f64 = 2.045_229_642_132_703;

/// Division of a series into batches with nearly independent means.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Batches {
    /// Number of batches.
    pub(crate) count: usize,
    /// Factor for the variance of the batch means, which makes up for the remaining correlation.
    pub(crate) correction: f64,
}

/// Reason why a series cannot be divided into enough batches.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum TooFew {
    /// The series has too few numbers.
    Short,
    /// The series is too short for its memory.
    LongMemory {
        /// Integrated autocorrelation time, as a share of the length of the series.
        memory: f64,
        /// Largest memory that allows enough batches, as a share of the length.
        allowed: f64,
    },
}

impl Batches {
    /// Divides a series into at least `least` and at most 30 batches. `deviations` are the values minus their expectation. If all means of fine batches are
    /// within `resolution`, their variation counts as rounding, not as memory.
    pub(crate) fn of(deviations: &[f64], least: usize, resolution: f64) -> Result<Self, TooFew> {
        let most = (deviations.len() / LEAST_LENGTH).min(MOST);
        if most < least {
            return Err(TooFew::Short);
        }
        let length = deviations.len().div_ceil(FINE);
        let fine: Vec<f64> = deviations.chunks_exact(length).filter_map(mean).collect();
        let time = if fine.iter().all(|deviation| deviation.abs() <= resolution) { 1.0 } else { integrated_time(&fine) };
        // `most` is at most 30, so the conversion of counts is exact. The largest suitable number of batches is taken.
        let count_of = (1..=most).rev().find(|&batches| count(batches) * LENGTH * time <= count(fine.len()));
        let Some(batches) = count_of.filter(|batches| *batches >= least) else {
            let share = 1.0 / count(fine.len());
            return Err(TooFew::LongMemory { memory: time * share, allowed: 1.0 / (LENGTH * count(least)) });
        };
        // T/L in units of fine batches: T = (τ − 1)/2, and a batch has `fine.len()`/`batches` fine batches. A series that allows 30 batches gets no correction.
        let left = if batches < MOST { (time - 1.0).max(0.0) / 2.0 * count(batches) / count(fine.len()) } else { 0.0 };
        Ok(Self { count: batches, correction: 1.0 / (1.0 - left) })
    }
}

/// Returns 1 + 2·Σ rₖ, at least a half: chance and negative correlation must not make batches shorter than for independent values.
fn integrated_time(deviations: &[f64]) -> f64 {
    let power: f64 = deviations.iter().map(|deviation| deviation * deviation).sum();
    let mut time = 1.0;
    for lag in 1..deviations.len() / 2 {
        time += 2.0 * deviations.iter().zip(&deviations[lag..]).map(|(one, other)| one * other).sum::<f64>() / power;
        if count(lag) >= WINDOW * time {
            break;
        }
    }
    time.max(0.5)
}

/// Returns a quantile of Student's law. The degrees of freedom are at least one.
pub(crate) fn student(probability: f64, freedom: usize) -> f64 {
    // `StudentsT::new` refuses only a scale or degrees of freedom that are not positive.
    StudentsT::new(0.0, 1.0, count(freedom.max(1))).map_or(f64::INFINITY, |law| law.inverse_cdf(probability))
}

/// Returns the standard error of the mean of a correlated series by batch means: sd/√30 of the means of 30 batches of equal length, nearly independent if a
/// batch is longer than the correlation (Law & Kelton 2000, section 9.5.3).
///
/// A series with a long memory gets fewer batches, see [`Batches`]. The result is then widened by the ratio of Student's 0.975 quantiles, so that for any
/// number of batches the true mean lies within 2.045 standard errors with confidence 0.95 (Student, 29 degrees of freedom). Returns `None` for fewer than
/// 300 numbers or fewer than 10 batches.
pub(crate) fn batch_standard_error(values: &[f64]) -> Option<f64> {
    if values.len() < LEAST_NUMBERS {
        return None;
    }
    let mean_of_all = mean(values)?;
    let deviations: Vec<f64> = values.iter().map(|value| value - mean_of_all).collect();
    let rounding = 4.0 * f64::EPSILON * mean_of_all.abs();
    let Batches { count: number, correction } = Batches::of(&deviations, LEAST_BATCHES, rounding).ok()?;
    let means: Vec<f64> = values.chunks_exact(values.len() / number).take(number).filter_map(mean).collect();
    let widening = if number < MOST { student(0.975, number - 1) / student(0.975, MOST - 1) } else { 1.0 };
    variance(&means).map(|variance| widening * (variance * correction / count(number)).sqrt())
}

/// Returns Wilson's interval at confidence 0.95 for the share of ones in a series of ones and zeros, whose events may depend on each other. The n events
/// count as fewer independent events, as many as give the variance found by batch means. If batch means show more variance than independent events have,
/// Student's quantile replaces the normal quantile. Returns `None` for an empty series, or if the memory is too long for batches.
pub(crate) fn share_interval(indicator: &[f64]) -> Option<[f64; 2]> {
    let happened = u64::try_from(indicator.iter().filter(|happened| **happened > 0.5).count()).unwrap_or(u64::MAX);
    let of = u64::try_from(indicator.len()).unwrap_or(u64::MAX);
    if indicator.len() < LEAST_NUMBERS {
        return wilson(happened, of);
    }
    let as_one = events_as_one(indicator)?;
    wilson_of_effective(happened, of, as_one, if as_one > 1.0 { STUDENT_975 } else { NORMAL_975 })
}

/// Returns the number of events in a series of ones and zeros worth one independent event, at least 1, and 1 for fewer than 300 events. Returns `None` if
/// the memory is too long for batches.
fn events_as_one(indicator: &[f64]) -> Option<f64> {
    if indicator.len() < LEAST_NUMBERS {
        return Some(1.0);
    }
    let error = batch_standard_error(indicator)?;
    let independent = variance(indicator)? / count(indicator.len());
    Some(if independent > 0.0 { (error * error / independent).max(1.0) } else { 1.0 })
}

/// Returns the two order statistics enclosing a quantile with confidence of about 0.95, under any law (Conover 1999, section 3.2): numbers np ±
/// 1.96·√(np(1−p)), both rounded up. `series` has the numbers of `sorted` in order of time. If batch means show more variance of the share below the
/// quantile than independent numbers have, the order statistics lie farther apart by the same factor. Returns `None` if the interval reaches beyond the
/// sample, or if the memory is too long.
pub(crate) fn quantile_interval(sorted: &[u64], series: &[u64], probability: f64) -> Option<[u64; 2]> {
    let n = count(sorted.len());
    let reaches = |half: f64| {
        let [low, high] = [-half, half].map(|away| (n * probability + away).ceil());
        (low >= 1.0 && high <= n).then_some([low, high])
    };
    let half = (n * probability * (1.0 - probability)).sqrt();
    // Checked first without correlation, because most quantiles beyond the sample fail here and need no batches.
    reaches(NORMAL_975 * half)?;
    let middle = sorted[floor((n * probability).ceil()) - 1];
    let as_one = events_as_one(&series.iter().map(|number| f64::from(u8::from(*number <= middle))).collect::<Vec<_>>())?;
    let quantile = if as_one > 1.0 { STUDENT_975 } else { NORMAL_975 };
    reaches(quantile * half * as_one.sqrt()).map(|[low, high]| [sorted[floor(low) - 1], sorted[floor(high) - 1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{TestRng, autoregressive};

    #[test]
    fn a_longer_memory_makes_fewer_batches() {
        let of = |phi: f64| Batches::of(&autoregressive(1, phi, 24_000), 5, 0.0);
        assert_eq!(of(0.0), Ok(Batches { count: 30, correction: 1.0 }));
        // φ = 0.997: τ = (1 + φ)/(1 − φ) = 666 numbers, of which 24 000 are 36: 36/4 = 9 batches, if the memory were known. It is estimated with a
        // standard error of √(2·(2·3 + 1)/36) = 62 % at the most, so that all one can say is that there are fewer.
        assert!(of(0.997).map_or(0, |batches| batches.count) < 15);
        // φ = 0.9999 does not forget in 24 000.
        assert!(matches!(of(0.9999), Err(TooFew::LongMemory { memory, allowed }) if memory > allowed));
        assert_eq!(Batches::of(&[0.0; 40], 5, 0.0), Err(TooFew::Short));
        // Rounding that goes up and down in long waves is no memory.
        let waves: Vec<f64> = (0..2_400).map(|i| if i / 600 % 2 == 0 { 4e-10 } else { -4e-10 }).collect();
        assert_eq!(Batches::of(&waves, 5, 1e-9), Ok(Batches { count: 30, correction: 1.0 }));
    }

    #[test]
    fn student_quantiles_are_the_published_ones() {
        // Tables of Student's law: 28, 9 and 3 degrees of freedom.
        for (probability, freedom, published) in [(0.995, 28, 2.763), (0.975, 9, 2.262), (0.975, 29, 2.045), (0.9995, 3, 12.924)] {
            assert!((student(probability, freedom) - published).abs() < 5e-4, "{freedom}");
        }
    }

    /// Of 600 series for each memory, the true mean lies more than 2.045 of its standard errors away in 5 % (Student, 29 degrees of freedom): more than 54 of
    /// 600 with probability 2.6·10⁻⁵, fewer than 10 of the 500 that are told at least with 1.4·10⁻⁴ (binomial). Lengths from 300 numbers to 20 000;
    /// memories, (1 + φ)/(1 − φ), up to a sixtieth of the length, of which one in six is taken for too long to tell.
    #[test]
    fn batch_means_know_what_correlation_does_to_a_mean() {
        for (n, phi) in [(300, 0.0), (300, 0.4), (1_000, 0.8), (3_000, 0.0), (3_000, 0.9), (3_000, 0.96), (20_000, 0.994)] {
            let mut outside = 0;
            for seed in 0..600 {
                let values = autoregressive(seed * 31 + n as u64, phi, n);
                let Some(error) = batch_standard_error(&values) else { continue };
                outside += u32::from(mean(&values).unwrap().abs() > 2.045 * error);
            }
            assert!((10..=54).contains(&outside), "{n} {phi}: {outside}");
        }
        assert_eq!(batch_standard_error(&[1.0; 299]), None);
        assert_eq!(batch_standard_error(&[1.0; 300]), Some(0.0));
    }

    #[test]
    fn the_interval_of_a_quantile_covers_it_as_often_as_it_says() {
        // 1000 samples of 200 uniform numbers. The interval covers the 0.75 quantile with probability 0.9592 (binomial, 138 to 162 below it);
        // in 1000 trials the count has a standard deviation of 6.3: within 4 of these, from 934 to 984.
        let mut rng = TestRng::new(5);
        let covered = (0..1000)
            .filter(|_| {
                let series: Vec<u64> = (0..200).map(|_| rng.word() >> 1).collect();
                let mut sorted = series.clone();
                sorted.sort_unstable();
                let [low, high] = quantile_interval(&sorted, &series, 0.75).unwrap();
                (low..=high).contains(&((u64::MAX >> 1) / 4 * 3))
            })
            .count();
        assert!((934..=984).contains(&covered), "{covered}");
        assert_eq!(quantile_interval(&[1, 2, 3], &[3, 1, 2], 0.99), None);
    }
}
