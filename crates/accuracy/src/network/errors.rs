//! How far what a way delivers is from the law: computed, not sampled.
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "counts are small, and equal entries of a table are equal numbers"
)]

use cohaptic_wan::law::Law;

use super::ways::{MEAN, SD};

/// What a way gets wrong.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Errors {
    /// The largest difference between the distribution function delivered and the true one (Kolmogorov).
    pub distance: f64,
    /// The error of the delay exceeded with the probability asked about, relative to its distance from the mean.
    pub tail: f64,
    /// What the mean delivered is above the one asked for, in standard deviations asked for.
    pub mean: f64,
    /// What the standard deviation delivered is above the one asked for, relative to it.
    pub sd: f64,
}

/// How closely errors are looked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Look {
    /// The probability below the quantile whose error is told: 0.9999 for the delay exceeded once in ten thousand.
    pub quantile: f64,
    /// The places in each cell between two entries of a table with straight lines between.
    pub places_a_cell: u32,
    /// The places on either side of the middle of a law, from 0 to 8 standard normal deviations.
    pub places_a_side: i32,
}

impl Look {
    /// As `docs/measured-samplers.md` has it.
    pub const CLOSE: Self = Self { quantile: 0.9999, places_a_cell: 16, places_a_side: 40_000 };

    fn tail_error(self, law: &Law, found: f64) -> f64 {
        let exact = law.quantile(self.quantile);
        (found - exact) / (exact - MEAN)
    }

    /// Of equally probable delays, in ascending order.
    ///
    /// # Panics
    ///
    /// If there are none.
    #[must_use]
    pub fn steps(self, law: &Law, delays: &[f64]) -> Errors {
        let n = delays.len() as f64;
        let mut distance = 0.0_f64;
        let mut begin = 0;
        for group in delays.chunk_by(|a, b| a == b) {
            let end = begin + group.len();
            let true_share = law.cdf(group[0]);
            distance = distance.max((true_share - begin as f64 / n).abs()).max((true_share - end as f64 / n).abs());
            begin = end;
        }
        let mean = delays.iter().sum::<f64>() / n;
        let sd = (delays.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
        let exceeded = delays[(n * self.quantile) as usize];
        Errors { distance, tail: self.tail_error(law, exceeded), mean: (mean - MEAN) / SD, sd: sd / SD - 1.0 }
    }

    /// Of straight lines between equally spaced quantiles.
    ///
    /// # Panics
    ///
    /// If there are fewer than two.
    #[must_use]
    pub fn lines(self, law: &Law, delays: &[f64]) -> Errors {
        let cells = (delays.len() - 1) as f64;
        let at = |p: f64| {
            let cell = (p * cells).floor();
            let [left, right] = [cell, cell + 1.0].map(|i| delays[delays.len().min(i as usize + 1) - 1]);
            left + (p * cells - cell) * (right - left)
        };
        // Beyond the last quantiles there is nothing.
        let ends = law.cdf(delays[0]).max(law.survival(delays[delays.len() - 1]));
        let places = f64::from(self.places_a_cell);
        let points = (0..(delays.len() - 1) * self.places_a_cell as usize).map(|i| i as f64 / (places * cells));
        let distance = points.map(|p| (law.cdf(at(p)) - p).abs()).fold(ends, f64::max);
        let average = |f: &dyn Fn(f64, f64) -> f64| delays.windows(2).map(|pair| f(pair[0], pair[1])).sum::<f64>() / cells;
        let mean = average(&|a, b| 0.5 * (a + b));
        let sd = average(&|a, b| ((a - mean) * (a - mean) + (a - mean) * (b - mean) + (b - mean) * (b - mean)) / 3.0).sqrt();
        Errors { distance, tail: self.tail_error(law, at(self.quantile)), mean: (mean - MEAN) / SD, sd: sd / SD - 1.0 }
    }

    /// Of a delay that is a function of a standard normal number up to `end`, moments by the trapezoidal rule, which for smooth functions on the whole
    /// line has no error but that of the end. `normal` is a normal law with the mean and deviation of all.
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

    /// The largest of |F(delay(z)) − Φ(z)|.
    #[must_use]
    pub fn distance(self, law: &Law, delay: impl Fn(f64) -> f64, normal: &Law) -> f64 {
        let places = (-self.places_a_side..self.places_a_side).map(|i| f64::from(i) * 8.0 / f64::from(self.places_a_side));
        places.map(|z| (law.cdf(delay(z)) - probability(normal, z)).abs()).fold(0.0, f64::max)
    }
}

/// Φ(z), from a normal law with the mean and deviation of all.
#[must_use]
pub fn probability(normal: &Law, z: f64) -> f64 {
    normal.cdf(MEAN + SD * z)
}
