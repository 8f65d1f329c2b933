//! Figures of a series of numbers, and how certain they are.

use crate::batches::{self, Batches, student};

/// With fewer numbers than this a mean has no standard error.
const LEAST_NUMBERS: usize = 300;
/// With fewer batches than this their means say little of how certain the mean of all is.
const LEAST_BATCHES: usize = 10;
/// The 0.975 quantile of the standard normal law.
pub(crate) const NORMAL_975: f64 = 1.959_963_984_540_054;
/// The 0.975 quantile of Student's law with 29 degrees of freedom, those of 30 batches.
const STUDENT_975: f64 = 2.045_229_642_132_703;

#[expect(clippy::cast_precision_loss, reason = "counts below 2^53 are exact, and none is larger")]
pub(crate) const fn count(n: usize) -> f64 {
    n as f64
}

#[expect(clippy::cast_precision_loss, reason = "counts below 2^53 are exact, and none is larger")]
pub(crate) const fn count_u64(n: u64) -> f64 {
    n as f64
}

/// A span or an instant counted in nanoseconds, in seconds.
pub(crate) const fn seconds(nanos: u64) -> f64 {
    count_u64(nanos) / 1e9
}

/// The arithmetic mean; `None` of nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    // About the first value, so that a large common part costs no digits.
    let &first = values.first()?;
    Some(first + values.iter().map(|value| value - first).sum::<f64>() / count(values.len()))
}

/// The variance Σ(x − x̄)²/(n − 1); `None` of fewer than two.
pub(crate) fn variance(values: &[f64]) -> Option<f64> {
    let mean = mean(values)?;
    (values.len() > 1).then(|| values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count(values.len() - 1))
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
    let widening = if number < batches::MOST { student(0.975, number - 1) / student(0.975, batches::MOST - 1) } else { 1.0 };
    variance(&means).map(|variance| widening * (variance * correction / count(number)).sqrt())
}

/// The autocorrelation at lags 1 to `lags` of a series in which some values are missing: the mean product of deviations over the pairs of which both
/// are there, divided by the variance over all (Parzen 1963, Sankhyā A 25(4)). Empty if the series does not vary; shorter if no pair is that far
/// apart.
pub(crate) fn autocorrelation(series: &[Option<f64>], lags: usize) -> Vec<f64> {
    let present: Vec<f64> = series.iter().filter_map(|value| *value).collect();
    let Some(mean) = mean(&present) else { return Vec::new() };
    let power = present.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count(present.len());
    if power <= 0.0 {
        return Vec::new();
    }
    let at_lag = |lag: usize| {
        let pairs = series.iter().zip(series.iter().skip(lag)).filter_map(|(one, other)| Some((one.as_ref()?, other.as_ref()?)));
        let (sum, pairs) = pairs.fold((0.0, 0_usize), |(sum, pairs), (one, other)| (sum + (one - mean) * (other - mean), pairs + 1));
        (pairs > 0).then(|| sum / count(pairs) / power)
    };
    (1..=lags).map_while(at_lag).collect()
}

/// Wilson's interval for a proportion at confidence 0.95 (Wilson 1927, JASA 22(158)): the probabilities p for which the share found is within 1.96
/// standard deviations √(p(1−p)/n) of p. It holds for independent events. `None` of no trials.
pub(crate) fn wilson(happened: u64, of: u64) -> Option<[f64; 2]> {
    wilson_of_effective(happened, of, 1.0, NORMAL_975)
}

/// Wilson's interval for dependent events, a number of which say as much as one independent event, with the quantile that fits how that number was found.
fn wilson_of_effective(happened: u64, of: u64, as_one: f64, quantile: f64) -> Option<[f64; 2]> {
    if of == 0 {
        return None;
    }
    let (n, z2) = (count_u64(of) / as_one, quantile * quantile);
    let share = count_u64(happened) / count_u64(of);
    let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = quantile / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    // At the ends the exact bound is 0 or 1, which rounding misses.
    Some([if happened == 0 { 0.0 } else { middle - half }, if happened == of { 1.0 } else { middle + half }])
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

/// How far Wilson's interval reaches from the share found to its farther end, in units of 1.96: an error that covers it also where little happened, or all.
/// Zero of no trials.
pub(crate) fn share_error(happened: u64, of: u64) -> f64 {
    let share = count_u64(happened) / count_u64(of);
    wilson(happened, of).map_or(0.0, |[low, high]| (share - low).max(high - share) / NORMAL_975)
}

/// The quantile by linear interpolation between order statistics, type 7 of Hyndman & Fan (1996, The American Statistician 50(4)).
///
/// `sorted` is not empty and `probability` lies in 0..=1.
pub(crate) fn quantile(sorted: &[u64], probability: f64) -> f64 {
    let place = probability * count(sorted.len() - 1);
    let below = floor(place);
    let low = sorted[below];
    let high = sorted[(below + 1).min(sorted.len() - 1)];
    count_u64(low) + (place - count(below)) * count_u64(high - low)
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

/// A place in a list: not negative, and far below 2⁵³.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and no longer than a list")]
const fn floor(place: f64) -> usize {
    place as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rng::{TestRng, autoregressive};

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
    fn autocorrelation_is_found_through_gaps() {
        // 40 % of the values are missing. The variance of r_k of an AR(1) process is ((1+φ²)(1−φ²ᵏ)/(1−φ²) − 2kφ²ᵏ)/n (Bartlett 1946) with all values;
        // with a share 0.36 of the pairs the standard error is at most 1/0.6 of that. Tolerance 4 of these.
        let mut rng = TestRng::new(9);
        let series: Vec<_> = autoregressive(4, 0.8, 20_000).into_iter().map(|value| (rng.unit() > 0.4).then_some(value)).collect();
        let found = autocorrelation(&series, 3);
        for (lag, found) in (1..=3).zip(found) {
            let phi_2k = 0.8_f64.powi(2 * lag);
            let standard_error = ((1.64 * (1.0 - phi_2k) / 0.36 - 2.0 * f64::from(lag) * phi_2k) / 20_000.0).sqrt() / 0.6;
            assert!((found - 0.8_f64.powi(lag)).abs() < 4.0 * standard_error, "{lag}: {found}");
        }
        assert!(autocorrelation(&[Some(1.0); 5], 3).is_empty());
        assert_eq!(autocorrelation(&[Some(1.0), Some(2.0)], 3).len(), 1);
        assert!(autocorrelation(&[None, None], 3).is_empty());
    }

    #[test]
    fn wilson_gives_the_published_intervals() {
        // Newcombe (1998, Statistics in Medicine 17), table I, method 3.
        let rounded = |happened, of| wilson(happened, of).unwrap().map(|bound| (bound * 1e4).round() / 1e4);
        assert_eq!(rounded(81, 263), [0.2553, 0.3662]);
        assert_eq!(rounded(15, 148), [0.0624, 0.1605]);
        assert_eq!(rounded(0, 20), [0.0, 0.1611]);
        assert_eq!(rounded(1, 29), [0.0061, 0.1718]);
        assert_eq!(rounded(20, 20)[1], 1.0);
        assert_eq!(wilson(0, 0), None);
    }

    #[test]
    fn quantiles_are_those_of_type_7() {
        // R: quantile(c(1, 2, 4, 8, 16), c(0, 0.1, 0.5, 0.9, 1)).
        let sample = [1, 2, 4, 8, 16];
        let expected = [1.0, 1.4, 4.0, 12.8, 16.0];
        for (probability, expected) in [0.0, 0.1, 0.5, 0.9, 1.0].into_iter().zip(expected) {
            assert!((quantile(&sample, probability) - expected).abs() < 1e-12);
        }
        assert_eq!(quantile(&[7], 0.99), 7.0);
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

    #[test]
    fn means_keep_their_digits_far_from_zero() {
        let values: Vec<f64> = (0..1000).map(|i| 1e9 + f64::from(i % 2)).collect();
        assert_eq!(mean(&values), Some(1e9 + 0.5));
        assert!((variance(&values).unwrap() - 0.25 * 1000.0 / 999.0).abs() < 1e-12);
        assert_eq!((mean(&[]), variance(&[1.0])), (None, None));
    }
}
