//! Names of the compared laws of delay, and the normal law. The laws are defined in [`cohaptic_wan::law`].

use serde::Serialize;
use statrs::function::erf;

/// Family of laws, by its name in scenes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DelayLaw {
    /// Normal law.
    Normal,
    /// Uniform law between two ends.
    Uniform,
    /// Laplace law: exponential on both sides of the mean.
    Laplace,
    /// Lognormal law above a floor.
    Lognormal,
    /// Gamma law above a floor.
    Gamma,
    /// Weibull law above a floor.
    Weibull,
}

impl DelayLaw {
    /// All families.
    pub(crate) const ALL: [Self; 6] = [Self::Normal, Self::Uniform, Self::Laplace, Self::Lognormal, Self::Gamma, Self::Weibull];

    /// Returns the name in scenes and JSON.
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

/// Returns the standard normal distribution function at z.
#[cfg(test)]
pub(super) fn normal_below(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// Returns the standard normal quantile of a probability between 0 and 1, both excluded.
pub(super) fn normal_quantile(p: f64) -> f64 {
    -std::f64::consts::SQRT_2 * erf::erfc_inv(2.0 * p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_quantiles_are_the_published_ones() {
        assert!((normal_quantile(0.975) - 1.959_963_984_540_054).abs() < 1e-12);
        assert!((normal_quantile(1e-9) + 5.997_807_015_007_687).abs() < 1e-9);
        assert!((normal_below(-3.0) - 0.001_349_898_031_630_094_5).abs() < 1e-15);
    }
}
