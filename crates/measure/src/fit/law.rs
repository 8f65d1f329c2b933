//! Laws of delay: what they are, and how likely they make measurements.

use serde::Serialize;
use statrs::function::{erf, gamma};

/// A family of laws by the name that scenes give it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DelayLaw {
    /// Normal.
    Normal,
    /// Uniform between two ends.
    Uniform,
    /// Laplace: two exponentials back to back.
    Laplace,
    /// A floor and a lognormal law above it.
    Lognormal,
    /// A floor and a gamma law above it.
    Gamma,
    /// A floor and a Weibull law above it.
    Weibull,
}

impl DelayLaw {
    /// Every law.
    pub const ALL: [Self; 6] = [Self::Normal, Self::Uniform, Self::Laplace, Self::Lognormal, Self::Gamma, Self::Weibull];

    /// The name in scenes and JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Uniform => "uniform",
            Self::Laplace => "laplace",
            Self::Lognormal => "lognormal",
            Self::Gamma => "gamma",
            Self::Weibull => "weibull",
        }
    }
}

impl From<DelayLaw> for cohaptic_wan::Distribution {
    fn from(law: DelayLaw) -> Self {
        match law {
            DelayLaw::Normal => Self::Normal,
            DelayLaw::Uniform => Self::Uniform,
            DelayLaw::Laplace => Self::Laplace,
            DelayLaw::Lognormal => Self::LogNormal,
            DelayLaw::Gamma => Self::Gamma,
            DelayLaw::Weibull => Self::Weibull,
        }
    }
}

/// A law with its parameters \[s\].
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Law {
    Normal { mean: f64, sd: f64 },
    Uniform { low: f64, high: f64 },
    Laplace { middle: f64, spread: f64 },
    Lognormal { floor: f64, mean_log: f64, sd_log: f64 },
    Gamma { floor: f64, shape: f64, scale: f64 },
    Weibull { floor: f64, shape: f64, scale: f64 },
}

/// The standard normal distribution function.
pub(super) fn normal_below(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// The standard normal quantile of a probability in (0, 1).
pub(super) fn normal_quantile(p: f64) -> f64 {
    -std::f64::consts::SQRT_2 * erf::erfc_inv(2.0 * p)
}

impl Law {
    pub(super) const fn name(&self) -> DelayLaw {
        match self {
            Self::Normal { .. } => DelayLaw::Normal,
            Self::Uniform { .. } => DelayLaw::Uniform,
            Self::Laplace { .. } => DelayLaw::Laplace,
            Self::Lognormal { .. } => DelayLaw::Lognormal,
            Self::Gamma { .. } => DelayLaw::Gamma,
            Self::Weibull { .. } => DelayLaw::Weibull,
        }
    }

    pub(super) fn mean(&self) -> f64 {
        match *self {
            Self::Normal { mean, .. } => mean,
            Self::Uniform { low, high } => f64::midpoint(low, high),
            Self::Laplace { middle, .. } => middle,
            Self::Lognormal { floor, mean_log, sd_log } => floor + (mean_log + sd_log * sd_log / 2.0).exp(),
            Self::Gamma { floor, shape, scale } => floor + shape * scale,
            Self::Weibull { floor, shape, scale } => floor + scale * gamma::ln_gamma(1.0 + 1.0 / shape).exp(),
        }
    }

    pub(super) fn sd(&self) -> f64 {
        match *self {
            Self::Normal { sd, .. } => sd,
            Self::Uniform { low, high } => (high - low) / 12.0_f64.sqrt(),
            Self::Laplace { spread, .. } => std::f64::consts::SQRT_2 * spread,
            Self::Lognormal { mean_log, sd_log, .. } => (mean_log + sd_log * sd_log / 2.0).exp() * (sd_log * sd_log).exp_m1().sqrt(),
            Self::Gamma { shape, scale, .. } => shape.sqrt() * scale,
            Self::Weibull { shape, scale, .. } => {
                let moment = |order: f64| gamma::ln_gamma(1.0 + order / shape).exp();
                scale * (moment(2.0) - moment(1.0).powi(2)).max(0.0).sqrt()
            }
        }
    }

    /// The least delay that the law has, if it has one.
    pub(super) const fn floor(&self) -> Option<f64> {
        match *self {
            Self::Normal { .. } | Self::Laplace { .. } => None,
            Self::Uniform { low, .. } => Some(low),
            Self::Lognormal { floor, .. } | Self::Gamma { floor, .. } | Self::Weibull { floor, .. } => Some(floor),
        }
    }

    /// The shape: that of the gamma and Weibull laws, the deviation of the logarithm of the lognormal law.
    pub(super) const fn shape(&self) -> Option<f64> {
        match *self {
            Self::Normal { .. } | Self::Uniform { .. } | Self::Laplace { .. } => None,
            Self::Lognormal { sd_log, .. } => Some(sd_log),
            Self::Gamma { shape, .. } | Self::Weibull { shape, .. } => Some(shape),
        }
    }

    /// The probability of a delay of at most `x`.
    pub(super) fn below(&self, x: f64) -> f64 {
        match *self {
            Self::Normal { mean, sd } => normal_below((x - mean) / sd),
            Self::Uniform { low, high } => ((x - low) / (high - low)).clamp(0.0, 1.0),
            Self::Laplace { middle, spread } => {
                let half = 0.5 * (-(x - middle).abs() / spread).exp();
                if x < middle { half } else { 1.0 - half }
            }
            Self::Lognormal { floor, .. } | Self::Gamma { floor, .. } | Self::Weibull { floor, .. } if x <= floor => 0.0,
            Self::Lognormal { floor, mean_log, sd_log } => normal_below(((x - floor).ln() - mean_log) / sd_log),
            // Arguments are positive and finite, which is all that can be refused.
            Self::Gamma { floor, shape, scale } => gamma::checked_gamma_lr(shape, (x - floor) / scale).unwrap_or(0.0),
            Self::Weibull { floor, shape, scale } => -(-((x - floor) / scale).powf(shape)).exp_m1(),
        }
    }

    /// The logarithm of the density at `x`, which lies inside the law \[ln 1/s\].
    pub(super) fn log_density(&self, x: f64) -> f64 {
        match *self {
            Self::Normal { mean, sd } => -0.5 * ((x - mean) / sd).powi(2) - sd.ln() - LN_SQRT_2PI,
            Self::Uniform { low, high } => -(high - low).ln(),
            Self::Laplace { middle, spread } => -(x - middle).abs() / spread - (2.0 * spread).ln(),
            Self::Lognormal { floor, mean_log, sd_log } => {
                let log = (x - floor).ln();
                -0.5 * ((log - mean_log) / sd_log).powi(2) - log - sd_log.ln() - LN_SQRT_2PI
            }
            Self::Gamma { floor, shape, scale } => {
                let y = (x - floor) / scale;
                (shape - 1.0) * y.ln() - y - gamma::ln_gamma(shape) - scale.ln()
            }
            Self::Weibull { floor, shape, scale } => {
                let y = (x - floor) / scale;
                shape.ln() - scale.ln() + (shape - 1.0) * y.ln() - y.powf(shape)
            }
        }
    }
}

/// ln √(2π).
const LN_SQRT_2PI: f64 = 0.918_938_533_204_672_8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_densities_belong_to_the_distribution_function() {
        let laws = [
            Law::Normal { mean: 3.0, sd: 0.7 },
            Law::Uniform { low: 2.0, high: 3.5 },
            Law::Laplace { middle: 3.0, spread: 0.3 },
            Law::Lognormal { floor: 2.0, mean_log: -0.5, sd_log: 0.4 },
            Law::Gamma { floor: 2.0, shape: 3.3, scale: 0.2 },
            Law::Weibull { floor: 2.0, shape: 1.7, scale: 0.6 },
        ];
        for law in laws {
            // Stieltjes sums over a grid of step 10⁻³ on −7..13: the error of the middle rule is of the order of the step squared.
            let (mut mean, mut square, mut kink) = (0.0, 0.0, 0.0_f64);
            for i in -7_000..13_000 {
                let (x, h) = (f64::from(i) * 1e-3, 1e-3);
                let mass = law.below(x + h) - law.below(x);
                let middle = x + h / 2.0;
                mean += middle * mass;
                square += middle * middle * mass;
                let smooth = law.floor().is_none_or(|floor| x > floor + 0.05) && (x - 3.0).abs() > 0.01 && (x - 3.5).abs() > 0.01;
                if mass > 1e-6 && smooth {
                    kink = kink.max((law.log_density(middle).exp() / (mass / h) - 1.0).abs());
                }
            }
            assert!((law.mean() - mean).abs() < 1e-5, "{law:?}");
            assert!((law.sd() - (square - mean * mean).sqrt()).abs() < 1e-5, "{law:?}");
            assert!(kink < 1e-3, "{law:?} {kink}");
        }
    }

    #[test]
    fn normal_quantiles_are_the_published_ones() {
        assert!((normal_quantile(0.975) - 1.959_963_984_540_054).abs() < 1e-12);
        assert!((normal_quantile(1e-9) + 5.997_807_015_007_687).abs() < 1e-9);
        assert!((normal_below(-3.0) - 0.001_349_898_031_630_094_5).abs() < 1e-15);
    }
}
