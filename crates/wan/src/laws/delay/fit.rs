//! Fit of a law: the parameters of a law for a given mean, deviation and floor.

use alloc::sync::Arc;

use super::cut::{self, Moments};
use super::error::LawError;
use super::gamma_map::GammaMap;
use super::special::log_gamma::log_gamma_ratio;
use super::special::root;
use super::standard::Standard;
use super::{DistTable, Distribution, MAX_VARIATION, pareto_normal};

/// Law of the draws, max(floor, origin + scale·X), and the moments of the draws.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) standard: Standard,
    pub(super) origin: f64,
    pub(super) scale: f64,
    pub(super) delivered: Moments,
}

/// Moments and floor asked for. `sd` is not negative, `mean` is at or above `floor`, and all are finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Asked {
    pub(super) mean: f64,
    pub(super) sd: f64,
    pub(super) floor: f64,
}

/// Standard deviation of the Pareto law of tail index 3 on [1, ∞), with the variance 3/4 and the mean 3/2.
const PARETO_SD: f64 = 0.866_025_403_784_438_6;
const PARETO_MEAN: f64 = 1.5;

/// Returns the law of the form `distribution` with the moments and the floor of `asked`.
pub(super) fn fit(distribution: &Distribution, asked: Asked) -> Result<Fit, LawError> {
    if asked.sd == 0.0 {
        return Ok(Fit { standard: Standard::Constant, origin: asked.mean, scale: 0.0, delivered: Moments { mean: asked.mean, sd: 0.0 } });
    }
    match distribution {
        Distribution::Normal => Ok(asked.cut(Standard::Normal, cut::normal)),
        Distribution::Laplace => Ok(asked.cut(Standard::Laplace, cut::laplace)),
        Distribution::ParetoNormal => {
            Ok(asked.standardised(Standard::ParetoNormal, pareto_normal::MEAN, pareto_normal::SD, pareto_normal::cut_moments))
        }
        Distribution::Table(table) => Ok(asked.table(table)),
        Distribution::Uniform => asked.bounded("uniform", Standard::Uniform, 0.0, 1.0),
        Distribution::Pareto => asked.bounded("Pareto", Standard::Pareto, PARETO_MEAN, PARETO_SD),
        Distribution::Empirical(values) => asked.bounded("empirical", Standard::Empirical(Arc::clone(values)), values.mean(), values.sd()),
        Distribution::LogNormal => {
            // σ² = ln(1 + CV²), and the mean of e^(σz) is e^(σ²/2).
            let variance = libm::log1p(asked.squared_variation("lognormal")?);
            Ok(asked.begin_at_the_floor(Standard::LogNormal { sigma: libm::sqrt(variance) }, libm::exp(0.5 * variance)))
        }
        Distribution::Gamma => {
            // A gamma law of scale 1 has mean a and variance a, so CV² = 1/a.
            let shape = 1.0 / asked.squared_variation("gamma")?;
            if shape > NORMAL_SHAPE {
                return Ok(asked.cut(Standard::Normal, cut::normal));
            }
            Ok(asked.begin_at_the_floor(Standard::Gamma(Arc::new(GammaMap::new(shape))), shape))
        }
        Distribution::Weibull => {
            let inverse_shape = inverse_weibull_shape(libm::sqrt(asked.squared_variation("Weibull")?));
            // The mean of a Weibull law of scale 1 is Γ(1 + 1/k).
            Ok(asked.begin_at_the_floor(Standard::Weibull { inverse_shape }, libm::tgamma(1.0 + inverse_shape)))
        }
    }
}

/// Shape bound of the gamma law: from here on the law is drawn as a normal law. The mean is 10⁹ deviations above the floor, and the two laws differ by less
/// than an `f64` of the mean resolves.
const NORMAL_SHAPE: f64 = 1e18;

impl Asked {
    /// Returns the fit of X with mean 0 and deviation 1 and without a least value, cut at the floor.
    fn cut(self, standard: Standard, moments: impl Fn(f64) -> Moments) -> Fit {
        self.standardised(standard, 0.0, 1.0, moments)
    }

    /// Returns the fit of X with the given mean and deviation. `moments` returns the moments of the standardised law with a cut.
    fn standardised(self, standard: Standard, mean: f64, sd: f64, moments: impl Fn(f64) -> Moments) -> Fit {
        let scale = self.sd / sd;
        let cut = moments((self.floor - self.mean) / self.sd);
        let delivered = Moments { mean: self.mean + self.sd * cut.mean, sd: self.sd * cut.sd };
        Fit { standard, origin: self.mean - scale * mean, scale, delivered }
    }

    /// Returns the fit of a table. As in netem, entries are scaled without regard to the mean and the deviation of the table.
    fn table(self, table: &Arc<DistTable>) -> Fit {
        let scale = self.sd / DistTable::ONE_DEVIATION;
        let (mean, sd) = table.moments((self.floor - self.mean) / scale);
        // Without the floor, rounding would put the mean of a table that is cut altogether just below the least delay.
        let delivered = Moments { mean: (self.mean + scale * mean).max(self.floor), sd: scale * sd };
        Fit { standard: Standard::Table(Arc::clone(table)), origin: self.mean, scale, delivered }
    }

    /// Returns the fit of X with the given mean and deviation and a least value. The least value must not fall below the floor.
    fn bounded(self, law: &'static str, standard: Standard, mean: f64, sd: f64) -> Result<Fit, LawError> {
        let fit = self.standardised(standard, mean, sd, |_| Moments::STANDARD);
        // Distance of the least value from the mean, in deviations.
        let below_mean = (mean - fit.standard.at(super::tail::Tail::Below(0.0))) / sd;
        let Self { mean, sd, floor } = self;
        let least = mean - sd * below_mean;
        // The tolerance accepts a law with its begin at the floor except for rounding.
        if floor - least > 1e-12 * (mean.abs() + sd) {
            return Err(LawError::ReachesBelowFloor { law, mean, sd, least, floor, largest_sd: (mean - floor) / below_mean });
        }
        Ok(fit)
    }

    /// Returns (sd/(mean − floor))².
    fn squared_variation(self, law: &'static str) -> Result<f64, LawError> {
        let above_floor = self.mean - self.floor;
        let largest_sd = MAX_VARIATION * above_floor;
        if self.sd > largest_sd {
            return Err(LawError::TooVaried { law, above_floor, sd: self.sd, largest_sd });
        }
        let variation = self.sd / above_floor;
        // An underflow of the square to zero would give an infinite shape. The least positive number stands for the square.
        Ok((variation * variation).max(f64::MIN_POSITIVE))
    }

    /// Returns the fit of X ≥ 0 with the given mean, for a form with the right ratio of deviation to mean.
    fn begin_at_the_floor(self, standard: Standard, mean: f64) -> Fit {
        let delivered = Moments { mean: self.mean, sd: self.sd };
        Fit { standard, origin: self.floor, scale: (self.mean - self.floor) / mean, delivered }
    }
}

/// Returns 1/k of the Weibull law with a standard deviation of `variation` times its mean, for 0 < variation ≤ 100: 1 + CV² = Γ(1 + 2/k)/Γ(1 + 1/k)². The
/// right side increases with 1/k from 1 without bound, so there is exactly one solution.
fn inverse_weibull_shape(variation: f64) -> f64 {
    let target = libm::log1p(variation * variation);
    // The logarithm of the right side is π²/6·t² for small t and below 2·ln 2·t for large t. The bracket of the root holds both estimates.
    let small = variation * libm::sqrt(6.0) / core::f64::consts::PI;
    root::increasing(|t| log_gamma_ratio(t) - target, 0.1 * small, 2.0 * small + target + 1.0)
}
