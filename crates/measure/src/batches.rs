//! How certain figures of a correlated series are, by the means of batches; and into how many batches it may be cut so that their means are nearly
//! independent.
//!
//! The means of batches tell how certain the mean of a series is, whatever its law, as long as a batch is much longer than the memory of the series. The
//! memory is the integrated autocorrelation time τ = 1 + 2·Σ rₖ of the means of up to 240 fine batches, summed up to the first lag of 3τ or more (Sokal
//! 1997, "Monte Carlo methods in statistical mechanics", section 3). A batch is 4τ long or longer, so that neighbours of a series that forgets
//! exponentially, e^(−t/T), for which τ = 2T, are correlated by 7 % at most; what that takes off the variance of a mean of length L, the share T/L, is put back.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::series::{NORMAL_975, count, floor, mean, variance, wilson, wilson_of_effective};

/// More batches are never needed: Schmeiser (1982, Operations Research 30(3)) found 10 to 30 to be right for any length.
pub(crate) const MOST: usize = 30;
/// With fewer numbers than this in a batch, its mean is no summary of anything.
const LEAST_LENGTH: usize = 10;
/// Fine batches, of which the memory is measured.
const FINE: usize = 240;
/// How long a batch is at least \[τ\].
const LENGTH: f64 = 4.0;
/// How far autocorrelations are summed up \[τ\].
const WINDOW: f64 = 3.0;

/// With fewer numbers than this a mean has no standard error.
const LEAST_NUMBERS: usize = 300;
/// With fewer batches than this their means say little of how certain the mean of all is.
const LEAST_BATCHES: usize = 10;
/// The 0.975 quantile of Student's law with 29 degrees of freedom, those of 30 batches.
const STUDENT_975: f64 = 2.045_229_642_132_703;

/// Batches whose means are nearly independent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Batches {
    pub(crate) count: usize,
    /// What the variance of their means is to be multiplied by for what correlation is left.
    pub(crate) correction: f64,
}

/// Why a series has too few.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum TooFew {
    /// It is short.
    Short,
    /// It is short for its memory.
    LongMemory {
        /// Its integrated autocorrelation time, in shares of its length.
        memory: f64,
        /// The greatest memory that would do, likewise.
        allowed: f64,
    },
}

impl Batches {
    /// At least `least` and at most 30 for a series whose values deviate from their expectation by that. Deviations of up to `resolution` are rounding and
    /// no memory.
    pub(crate) fn of(deviations: &[f64], least: usize, resolution: f64) -> Result<Self, TooFew> {
        let most = (deviations.len() / LEAST_LENGTH).min(MOST);
        if most < least {
            return Err(TooFew::Short);
        }
        let length = deviations.len().div_ceil(FINE);
        let fine: Vec<f64> = deviations.chunks_exact(length).filter_map(mean).collect();
        let time = if fine.iter().all(|deviation| deviation.abs() <= resolution) { 1.0 } else { integrated_time(&fine) };
        // Nothing below `most` is too large for a `usize`.
        let count_of = (1..=most).rev().find(|&batches| count(batches) * LENGTH * time <= count(fine.len()));
        let Some(batches) = count_of.filter(|batches| *batches >= least) else {
            let share = 1.0 / count(fine.len());
            return Err(TooFew::LongMemory { memory: time * share, allowed: 1.0 / (LENGTH * count(least)) });
        };
        let left = if batches < MOST { (time - 1.0).max(0.0) / 2.0 * count(batches) / count(fine.len()) } else { 0.0 };
        Ok(Self { count: batches, correction: 1.0 / (1.0 - left) })
    }
}

/// 1 + 2·Σ rₖ, not below a half: what chance and negative correlation take off must not make batches shorter than they are for independent values.
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

/// The quantile of Student's law with a number of degrees of freedom, at least one.
pub(crate) fn student(probability: f64, freedom: usize) -> f64 {
    // The scale and the degrees of freedom are positive, which is all that can be refused.
    StudentsT::new(0.0, 1.0, count(freedom.max(1))).map_or(f64::INFINITY, |law| law.inverse_cdf(probability))
}

/// The standard error of the mean of a correlated series by batch means: the series is cut into 30 batches of equal length, and their means, which
/// are nearly independent where the correlation is shorter than a batch, give sd/√30 (Law & Kelton 2000, section 9.5.3).
///
/// A series with a long memory is cut into fewer, see [`Batches`]. What they give is then widened by the ratio of Student's 0.975 quantiles, so that the true
/// mean lies within 2.045 of these errors with confidence 0.95 (Student, 29 degrees of freedom) whatever the number of batches. `None` of fewer than 300
/// numbers, and where there are fewer than 10 batches.
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

/// Wilson's interval at confidence 0.95 for the share of ones in a series of ones and zeros that may depend on each other: n events count as fewer independent
/// ones as have the variance that batch means give the share, and with Student's quantile instead of the normal one where these tell of more variance than
/// independent events have. `None` of nothing, and where the memory is too long for batches.
pub(crate) fn share_interval(indicator: &[f64]) -> Option<[f64; 2]> {
    let happened = u64::try_from(indicator.iter().filter(|happened| **happened > 0.5).count()).unwrap_or(u64::MAX);
    let of = u64::try_from(indicator.len()).unwrap_or(u64::MAX);
    if indicator.len() < LEAST_NUMBERS {
        return wilson(happened, of);
    }
    let as_one = events_as_one(indicator)?;
    wilson_of_effective(happened, of, as_one, if as_one > 1.0 { STUDENT_975 } else { NORMAL_975 })
}

/// How many events of a series of ones and zeros say as much about their share as one independent event, at least 1; 1 of fewer than 300. `None` where the
/// memory is too long for batches.
fn events_as_one(indicator: &[f64]) -> Option<f64> {
    if indicator.len() < LEAST_NUMBERS {
        return Some(1.0);
    }
    let error = batch_standard_error(indicator)?;
    let independent = variance(indicator)? / count(indicator.len());
    Some(if independent > 0.0 { (error * error / independent).max(1.0) } else { 1.0 })
}

/// The order statistics that enclose the quantile with confidence of about 0.95, whatever the law (Conover 1999, section 3.2): those at
/// np ± 1.96·√(np(1−p)), both rounded up. `series` are the same numbers in the order in which they came: where they hang together, so that the share of them
/// that is not above the quantile has more variance by batch means than that of independent ones, the order statistics lie as much farther apart. `None`
/// where the sample does not reach that far, or remembers too long.
pub(crate) fn quantile_interval(sorted: &[u64], series: &[u64], probability: f64) -> Option<[u64; 2]> {
    let n = count(sorted.len());
    let reaches = |half: f64| {
        let [low, high] = [-half, half].map(|away| (n * probability + away).ceil());
        (low >= 1.0 && high <= n).then_some([low, high])
    };
    let half = (n * probability * (1.0 - probability)).sqrt();
    // Most of those that do not reach far enough need no batches.
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
