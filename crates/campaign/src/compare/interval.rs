//! Means and shares with their intervals at a confidence of 95 %.

use core::cmp::Ordering;

use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// The 0.975 quantile of the normal law: 5 % of the probability lies beyond ±this value.
const NORMAL_975: f64 = 1.959_963_984_540_054;

/// A mean with Student's interval.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Estimate {
    /// Number of values.
    pub count: u64,
    /// Mean of the values.
    pub mean: f64,
    /// Half of the width of Student's interval of 95 %, t·s/√n with n − 1 degrees of freedom; `None` for one value.
    pub half_width: Option<f64>,
}

impl Estimate {
    /// Estimates the mean of these values; `None` for an empty slice. Equal values give exactly that mean and a half width of 0, without the rounding error of
    /// a sum.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let first = *values.first()?;
        let n = count(values.len() as u64);
        // The sum of equal values is rounded, so the general formula would give a small deviation in place of 0.
        let is_constant = values.iter().all(|value| value.total_cmp(&first) == Ordering::Equal);
        let mean = if is_constant { first } else { values.iter().sum::<f64>() / n };
        let half_width = (values.len() > 1).then(|| {
            if is_constant {
                return 0.0;
            }
            let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
            student_975(n - 1.0) * libm::sqrt(variance / n)
        });
        Some(Self { count: values.len() as u64, mean, half_width })
    }

    /// Returns the lower end of the interval; the mean itself for one value.
    #[must_use]
    pub fn low(&self) -> f64 {
        self.mean - self.half_width.unwrap_or(0.0)
    }

    /// Returns the upper end of the interval; the mean itself for one value.
    #[must_use]
    pub fn high(&self) -> f64 {
        self.mean + self.half_width.unwrap_or(0.0)
    }

    /// Returns the side of zero on which the whole interval lies; [`Ordering::Equal`] if the interval contains zero, or if there is no interval.
    #[must_use]
    pub fn side(&self) -> Ordering {
        match self.half_width {
            Some(_) if self.high() < 0.0 => Ordering::Less,
            Some(_) if self.low() > 0.0 => Ordering::Greater,
            Some(_) | None => Ordering::Equal,
        }
    }
}

/// Returns the 0.975 quantile of Student's law. `freedom`: degrees of freedom, at least 1.
fn student_975(freedom: f64) -> f64 {
    // The constructor fails only below one degree of freedom.
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |law| law.inverse_cdf(0.975))
}

/// A share of runs with Wilson's interval of 95 % (Wilson 1927, JASA 22(158)).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Share {
    /// Number of runs with the event.
    pub count: u64,
    /// Number of all runs; at least 1.
    pub of: u64,
    /// Lower end of the interval, from 0 to 1.
    pub low: f64,
    /// Upper end of the interval, from 0 to 1.
    pub high: f64,
}

impl Share {
    /// Returns the share of `happened` runs in `of` runs; `None` if `of` is 0.
    #[must_use]
    pub fn of(happened: u64, of: u64) -> Option<Self> {
        if of == 0 {
            return None;
        }
        let (n, share, z2) = (count(of), count(happened) / count(of), NORMAL_975 * NORMAL_975);
        let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = NORMAL_975 / (1.0 + z2 / n) * libm::sqrt(share * (1.0 - share) / n + z2 / (4.0 * n * n));
        // The exact bounds at the ends are 0 and 1, which rounding misses.
        let low = if happened == 0 { 0.0 } else { middle - half };
        let high = if happened == of { 1.0 } else { middle + half };
        Some(Self { count: happened, of, low, high })
    }

    /// Returns the observed share, from 0 to 1.
    #[must_use]
    pub fn value(&self) -> f64 {
        count(self.count) / count(self.of)
    }
}

#[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
const fn count(number: u64) -> f64 {
    number as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sources: NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.2, to three decimals. Closed forms: tan(0.475·π) for 1 degree of freedom, √(2·0.95²/(1
    /// − 0.95²)) for 2.
    #[test]
    fn quantiles_of_student_are_those_of_closed_forms_and_tables() {
        let one = libm::tan(0.475 * core::f64::consts::PI);
        let two = libm::sqrt(2.0 * 0.95 * 0.95 / (1.0 - 0.95 * 0.95));
        for (freedom, expected, tolerance) in [
            (1.0, one, 1e-8),
            (2.0, two, 1e-8),
            (3.0, 3.182, 5e-4),
            (7.0, 2.365, 5e-4),
            (15.0, 2.131, 5e-4),
            (30.0, 2.042, 5e-4),
            (100.0, 1.984, 5e-4),
        ] {
            assert!((student_975(freedom) - expected).abs() < tolerance * expected, "{freedom}: {} and {expected}", student_975(freedom));
        }
        // The law tends to the normal law: t ≈ z + (z³ + z)/(4ν), Abramowitz & Stegun 26.7.5, with the next term below 3/ν².
        let (z, freedom) = (NORMAL_975, 1e4);
        assert!((student_975(freedom) - (z + (z * z * z + z) / (4.0 * freedom))).abs() < 3.0 / (freedom * freedom));
    }

    /// Gosset's own data (Student 1908, Biometrika 6(1), section IX): additional hours of sleep by two drugs, ten patients. R 4.3: `t.test(sleep$extra[1:10])`
    /// gives 0.75 and (−0.5297804, 2.0297804); the paired differences give 1.58 and (0.7001142, 2.4598858).
    #[test]
    fn the_interval_of_a_mean_is_that_of_student() {
        let first = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0];
        let second = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];
        let alone = Estimate::of(&first).unwrap();
        assert!(
            (alone.mean - 0.75).abs() < 1e-12 && (alone.low() + 0.529_780_4).abs() < 1e-6 && (alone.high() - 2.029_780_4).abs() < 1e-6,
            "{alone:?}"
        );
        let differences: Vec<f64> = second.iter().zip(&first).map(|(second, first)| second - first).collect();
        let paired = Estimate::of(&differences).unwrap();
        assert!(
            (paired.mean - 1.58).abs() < 1e-12 && (paired.low() - 0.700_114_2).abs() < 1e-6 && (paired.high() - 2.459_885_8).abs() < 1e-6,
            "{paired:?}"
        );
        assert_eq!((alone.side(), paired.side(), paired.count), (Ordering::Equal, Ordering::Greater, 10));
    }

    #[test]
    fn one_value_has_no_interval_and_equal_values_have_one_of_no_width() {
        assert_eq!(Estimate::of(&[]), None);
        assert_eq!(Estimate::of(&[-2.0]), Some(Estimate { count: 1, mean: -2.0, half_width: None }));
        assert_eq!(Estimate::of(&[-2.0]).unwrap().side(), Ordering::Equal);
        // In binary, the sum of three times 0.1, divided by three, is not 0.1.
        assert_eq!(Estimate::of(&[0.1; 3]), Some(Estimate { count: 3, mean: 0.1, half_width: Some(0.0) }));
        assert_eq!(Estimate::of(&[-0.1; 3]).unwrap().side(), Ordering::Less);
    }

    /// Source: Newcombe (1998, Statistics in Medicine 17), table I, method 3.
    #[test]
    fn the_interval_of_a_share_is_that_of_wilson() {
        let rounded = |happened, of| Share::of(happened, of).map(|share| [share.low, share.high].map(|bound| (bound * 1e4).round() / 1e4));
        assert_eq!(rounded(81, 263), Some([0.2553, 0.3662]));
        assert_eq!(rounded(15, 148), Some([0.0624, 0.1605]));
        assert_eq!(rounded(0, 20), Some([0.0, 0.1611]));
        assert_eq!(rounded(1, 29), Some([0.0061, 0.1718]));
        assert_eq!(rounded(20, 20).map(|[_, high]| high), Some(1.0));
        assert_eq!(rounded(0, 0), None);
        // Both ends are the roots of (p − share)² = z²·p·(1 − p)/n.
        let share = Share::of(7, 30).unwrap();
        for end in [share.low, share.high] {
            let (left, right) = ((end - share.value()).powi(2), NORMAL_975 * NORMAL_975 * end * (1.0 - end) / 30.0);
            assert!((left - right).abs() < 1e-15, "{end}");
        }
    }
}
