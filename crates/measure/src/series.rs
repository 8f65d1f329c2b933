//! Figures of a series of numbers, with standard errors and intervals for independent numbers.

/// Quantile 0.975 of the standard normal law.
pub(crate) const NORMAL_975: f64 = 1.959_963_984_540_054;
#[expect(clippy::cast_precision_loss, reason = "counts below 2^53 are exact, and none is larger")]
pub(crate) const fn count(n: usize) -> f64 {
    n as f64
}

#[expect(clippy::cast_precision_loss, reason = "counts below 2^53 are exact, and none is larger")]
pub(crate) const fn count_u64(n: u64) -> f64 {
    n as f64
}

/// Converts nanoseconds to seconds.
pub(crate) const fn seconds(nanos: u64) -> f64 {
    count_u64(nanos) / 1e9
}

/// Returns the arithmetic mean; `None` for an empty list.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    // Sums differences from the first value, so that a large common part costs no digits.
    let &first = values.first()?;
    Some(first + values.iter().map(|value| value - first).sum::<f64>() / count(values.len()))
}

/// Returns the variance Σ(x − x̄)²/(n − 1); `None` for fewer than two values.
pub(crate) fn variance(values: &[f64]) -> Option<f64> {
    let mean = mean(values)?;
    (values.len() > 1).then(|| values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count(values.len() - 1))
}

/// Returns the autocorrelation at lags 1 to `lags` of a series with missing values: the mean product of deviations over pairs with both values, divided by
/// the variance over all values (Parzen 1963, Sankhyā A 25(4)), or by the variance within the pairs where the quotient would be beyond ±1. Empty for a constant
/// series; shorter than `lags` if no pair is that far apart.
pub(crate) fn autocorrelation(series: &[Option<f64>], lags: usize) -> Vec<f64> {
    let present: Vec<f64> = series.iter().filter_map(|value| *value).collect();
    let Some(mean) = mean(&present) else { return Vec::new() };
    let power = present.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count(present.len());
    if power <= 0.0 {
        return Vec::new();
    }
    let deviations: Vec<Option<f64>> = series.iter().map(|value| value.map(|value| value - mean)).collect();
    (1..=lags).map_while(|lag| correlation_of_pairs(&deviations, power, lag).map(|(correlation, _)| correlation)).collect()
}

/// Returns the correlation of deviations from the mean that are `lag` apart, and the number of pairs with both values; `None` without a pair. `power` is the mean
/// square of all deviations.
///
/// Pairs may vary more than all values: the values at both ends have one neighbour only, and a value beside a gap may have none. The mean product can then exceed
/// `power`, but never the geometric mean of the mean squares of the earlier and of the later values of the pairs (Cauchy and Schwarz), which is the divisor then.
pub(crate) fn correlation_of_pairs(deviations: &[Option<f64>], power: f64, lag: usize) -> Option<(f64, f64)> {
    let pairs = deviations.iter().zip(deviations.iter().skip(lag)).filter_map(|(one, other)| Some(((*one)?, (*other)?)));
    let (mut product, mut earlier, mut later, mut number) = (0.0, 0.0, 0.0, 0_usize);
    for (one, other) in pairs {
        product += one * other;
        earlier += one * one;
        later += other * other;
        number += 1;
    }
    let pairs = count(number);
    let whole = pairs * power;
    let whole = if product.abs() > whole { (earlier * later).sqrt() } else { whole };
    // The sums are rounded, so that a result could still be beyond 1 by its last digit.
    (number > 0).then(|| ((product / whole).clamp(-1.0, 1.0), pairs))
}

/// Returns Wilson's interval at confidence 0.95 for a proportion of independent events (Wilson 1927, JASA 22(158)): all probabilities p such that the found
/// share is within 1.96 standard deviations √(p(1−p)/n) of p. `None` for no trials.
pub(crate) fn wilson(happened: u64, of: u64) -> Option<[f64; 2]> {
    wilson_of_effective(happened, of, 1.0, NORMAL_975)
}

/// Returns Wilson's interval for dependent events. `as_one` events are worth one independent event; `quantile` fits the way of finding `as_one`.
pub(crate) fn wilson_of_effective(happened: u64, of: u64, as_one: f64, quantile: f64) -> Option<[f64; 2]> {
    if of == 0 {
        return None;
    }
    let (n, z2) = (count_u64(of) / as_one, quantile * quantile);
    let share = count_u64(happened) / count_u64(of);
    let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = quantile / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    // At the ends the exact bound is 0 or 1, which rounding would miss.
    Some([if happened == 0 { 0.0 } else { middle - half }, if happened == of { 1.0 } else { middle + half }])
}

/// Returns the distance from the found share to the farther end of Wilson's interval, divided by 1.96. As a standard error, the result covers the interval
/// even if nearly no or nearly all events happened. Zero for no trials.
pub(crate) fn share_error(happened: u64, of: u64) -> f64 {
    let share = count_u64(happened) / count_u64(of);
    wilson(happened, of).map_or(0.0, |[low, high]| (share - low).max(high - share) / NORMAL_975)
}

/// Returns a quantile by linear interpolation between order statistics, type 7 of Hyndman & Fan (1996, The American Statistician 50(4)).
///
/// `sorted` must not be empty; `probability` must be from 0 to 1.
pub(crate) fn quantile(sorted: &[u64], probability: f64) -> f64 {
    let place = probability * count(sorted.len() - 1);
    let below = floor(place);
    let low = sorted[below];
    let high = sorted[(below + 1).min(sorted.len() - 1)];
    count_u64(low) + (place - count(below)) * count_u64(high - low)
}

/// Rounds a position in a list down. The position is not negative and far below 2⁵³.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and no longer than a list")]
pub(crate) const fn floor(place: f64) -> usize {
    place as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{TestRng, autoregressive};

    #[test]
    fn autocorrelation_is_found_through_gaps() {
        // 40 % of the values are missing. With all values, the variance of r_k of an AR(1) process is ((1+φ²)(1−φ²ᵏ)/(1−φ²) − 2kφ²ᵏ)/n (Bartlett 1946).
        // With a share of 0.36 of the pairs, the standard error is at most 1/0.6 times as large. The tolerance is four standard errors.
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

    /// A wave of 100 values that begins at its mean: the sum of the products is cos(2π/100) times the sum of the squares, but there are 99 products only, so that
    /// the mean product is 1.008 times the variance.
    #[test]
    fn no_autocorrelation_is_beyond_one() {
        let wave: Vec<_> = (0..100).map(|place| Some((core::f64::consts::TAU * f64::from(place) / 100.0).sin())).collect();
        let found = autocorrelation(&wave, 1)[0];
        assert!((found - (core::f64::consts::TAU / 100.0).cos()).abs() < 1e-4, "{found}");
        // The only pair has the two values that are farthest from the mean.
        assert_eq!(autocorrelation(&[Some(2.0), Some(2.0), None, Some(0.0), None, Some(0.0), None, Some(0.0)], 1), [1.0]);
        assert_eq!(autocorrelation(&[Some(2.0), Some(-2.0), None, Some(0.0), None, Some(0.0)], 1), [-1.0]);
        // Results elsewhere are divided by the variance of all values, also where the pairs vary more: by √30/4 = 1.37 here, where the variance is 1.2.
        assert_eq!(autocorrelation(&[Some(0.0), Some(2.0), Some(0.0), Some(-1.0), Some(-1.0)], 1), [0.25 / 1.2]);
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
    fn means_keep_their_digits_far_from_zero() {
        let values: Vec<f64> = (0..1000).map(|i| 1e9 + f64::from(i % 2)).collect();
        assert_eq!(mean(&values), Some(1e9 + 0.5));
        assert!((variance(&values).unwrap() - 0.25 * 1000.0 / 999.0).abs() < 1e-12);
        assert_eq!((mean(&[]), variance(&[1.0])), (None, None));
    }
}
