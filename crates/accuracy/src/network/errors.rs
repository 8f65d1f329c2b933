//! Distance between the delivered distribution of a method and its law, computed without sampling.
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "counts are small, and equal entries of a table are equal numbers"
)]

use cohaptic_wan::law::Law;

use super::ways::{MEAN, SD};

/// Errors of a method.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Errors {
    /// Largest difference between the delivered and the true distribution function (Kolmogorov).
    pub distance: f64,
    /// Error of the quantile asked for, relative to its distance from the mean.
    pub tail: f64,
    /// Delivered mean minus requested mean, in requested standard deviations.
    pub mean: f64,
    /// Delivered standard deviation divided by the requested one, minus 1.
    pub sd: f64,
}

/// Resolution of the computation of errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Look {
    /// Probability below the quantile of [`Errors::tail`]: 0.9999 for the delay exceeded once in ten thousand.
    pub quantile: f64,
    /// Number of evaluated places in each cell between two entries of a table with linear interpolation.
    pub places_a_cell: u32,
    /// Number of evaluated places on either side of the middle of a law, from 0 to 8 standard normal deviations.
    pub places_a_side: i32,
}

impl Look {
    /// Resolution of `docs/measured-samplers.md`.
    pub const CLOSE: Self = Self { quantile: 0.9999, places_a_cell: 16, places_a_side: 40_000 };

    fn tail_error(self, law: &Law, found: f64) -> f64 {
        let exact = law.quantile(self.quantile);
        (found - exact) / (exact - MEAN)
    }

    /// Returns the errors of equally probable delays, in ascending order.
    ///
    /// # Panics
    ///
    /// If `delays` is empty.
    #[must_use]
    pub fn steps(self, law: &Law, delays: &[f64]) -> Errors {
        let n = delays.len() as f64;
        let mut distance = 0.0_f64;
        let mut begin = 0;
        for group in delays.chunk_by(|a, b| a == b) {
            let end = begin + group.len();
            // The delivered distribution function jumps at the group, so both sides of the jump are compared.
            let true_share = law.cdf(group[0]);
            distance = distance.max((true_share - begin as f64 / n).abs()).max((true_share - end as f64 / n).abs());
            begin = end;
        }
        let mean = delays.iter().sum::<f64>() / n;
        // The population variance: the delays are the whole distribution, not a sample.
        let sd = (delays.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
        let exceeded = delays[(n * self.quantile) as usize];
        Errors { distance, tail: self.tail_error(law, exceeded), mean: (mean - MEAN) / SD, sd: sd / SD - 1.0 }
    }

    /// Returns the errors of linear interpolation between equally spaced quantiles.
    ///
    /// # Panics
    ///
    /// If there are fewer than two quantiles.
    #[must_use]
    pub fn lines(self, law: &Law, delays: &[f64]) -> Errors {
        let cells = (delays.len() - 1) as f64;
        let at = |p: f64| {
            let cell = (p * cells).floor();
            let [left, right] = [cell, cell + 1.0].map(|i| delays[delays.len().min(i as usize + 1) - 1]);
            left + (p * cells - cell) * (right - left)
        };
        // No delay is delivered beyond the first and the last quantile.
        let ends = law.cdf(delays[0]).max(law.survival(delays[delays.len() - 1]));
        let places = f64::from(self.places_a_cell);
        // Within a cell the difference has its maximum at an unknown place, so several places are compared.
        let points = (0..(delays.len() - 1) * self.places_a_cell as usize).map(|i| i as f64 / (places * cells));
        let distance = points.map(|p| (law.cdf(at(p)) - p).abs()).fold(ends, f64::max);
        let average = |f: &dyn Fn(f64, f64) -> f64| delays.windows(2).map(|pair| f(pair[0], pair[1])).sum::<f64>() / cells;
        let mean = average(&|a, b| 0.5 * (a + b));
        // Second moment of a uniform density between a and b, about the mean.
        let sd = average(&|a, b| ((a - mean) * (a - mean) + (a - mean) * (b - mean) + (b - mean) * (b - mean)) / 3.0).sqrt();
        Errors { distance, tail: self.tail_error(law, at(self.quantile)), mean: (mean - MEAN) / SD, sd: sd / SD - 1.0 }
    }

    /// Returns the errors of a delay that is a function of a standard normal number up to `end`. Moments use the trapezoidal rule, whose only error for
    /// smooth functions on the whole line is that of the end. `normal` is the normal law with the mean and deviation of all laws.
    #[must_use]
    pub fn exact(self, law: &Law, end: f64, delay: impl Fn(f64) -> f64, normal: &Law) -> Errors {
        const STEPS: f64 = 64.0;
        let moment = |k: i32| {
            let term = |i: i32| {
                let z = f64::from(i) / STEPS;
                ((law.at_normal(z) - MEAN) / SD).powi(k) * (-0.5 * z * z).exp()
            };
            (-13 * 64..=(end * STEPS) as i32).map(term).sum::<f64>() / STEPS / (2.0 * std::f64::consts::PI).sqrt()
        };
        let (mean, square) = (moment(1), moment(2));
        let tail = self.tail_error(law, delay((normal.quantile(self.quantile) - MEAN) / SD));
        Errors { distance: self.distance(law, delay, normal), tail, mean, sd: (square - mean * mean).sqrt() - 1.0 }
    }

    /// Returns the largest |F(delay(z)) − Φ(z)|.
    #[must_use]
    pub fn distance(self, law: &Law, delay: impl Fn(f64) -> f64, normal: &Law) -> f64 {
        let places = (-self.places_a_side..self.places_a_side).map(|i| f64::from(i) * 8.0 / f64::from(self.places_a_side));
        places.map(|z| (law.cdf(delay(z)) - probability(normal, z)).abs()).fold(0.0, f64::max)
    }
}

/// Returns Φ(z), from the normal law with the mean and deviation of all laws.
#[must_use]
pub fn probability(normal: &Law, z: f64) -> f64 {
    normal.cdf(MEAN + SD * z)
}
