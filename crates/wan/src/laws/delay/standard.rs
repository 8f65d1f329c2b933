//! Standard laws: the laws before shift and stretch.

use alloc::sync::Arc;

use super::gamma_map::GammaMap;
use super::special::{gamma, gamma_inverse, normal};
use super::tail::Tail;
use super::{DistTable, Empirical, pareto_normal};
use crate::laws::normal::standard_normal;

/// Law of a number X with a form only. A delay is origin + scale·X.
#[derive(Clone, Debug)]
pub(super) enum Standard {
    /// Constant zero.
    Constant,
    Normal,
    /// Uniform on [−√3, √3].
    Uniform,
    /// Pareto from 1 on, with tail index 3.
    Pareto,
    /// Mixture of [`pareto_normal`].
    ParetoNormal,
    /// Laplace of mean 0 and standard deviation 1.
    Laplace,
    /// Lognormal, e^(σ·z).
    LogNormal {
        sigma: f64,
    },
    /// Gamma of scale 1.
    Gamma(Arc<GammaMap>),
    /// Weibull of scale 1: e^t, where e is exponential and t is the inverse shape.
    Weibull {
        inverse_shape: f64,
    },
    Empirical(Arc<Empirical>),
    /// Entries of a table, unchanged.
    Table(Arc<DistTable>),
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

impl Standard {
    /// Returns F⁻¹(Φ(z)).
    pub(super) fn at_normal(&self, z: f64) -> f64 {
        match self {
            Self::Normal => z,
            // The closed form in z is faster than the way over a probability.
            Self::LogNormal { sigma } => libm::exp(sigma * z),
            Self::Gamma(map) => map.at_normal(z),
            Self::ParetoNormal => pareto_normal::at(z, normal::below(-z)),
            // Laws given as functions of the probability need Φ(z) first.
            Self::Constant | Self::Uniform | Self::Pareto | Self::Laplace | Self::Weibull { .. } | Self::Empirical(_) | Self::Table(_) => {
                self.at(Tail::of_normal(z))
            }
        }
    }

    /// Returns F⁻¹ at a place of the law.
    pub(super) fn at(&self, place: Tail) -> f64 {
        match self {
            Self::Constant => 0.0,
            Self::Normal => place.normal(),
            Self::Uniform => match place {
                Tail::Below(p) => SQRT_3 * (2.0 * p - 1.0),
                Tail::Above(q) => SQRT_3 * (1.0 - 2.0 * q),
            },
            // F⁻¹(u) = (1 − u)^(−1/3).
            Self::Pareto => 1.0 / libm::cbrt(place.above()),
            Self::ParetoNormal => pareto_normal::at(place.normal(), place.above()),
            Self::Laplace => match place {
                // Each half is an exponential law of the scale 1/√2.
                Tail::Below(p) => libm::log(2.0 * p) * core::f64::consts::FRAC_1_SQRT_2,
                Tail::Above(q) => -libm::log(2.0 * q) * core::f64::consts::FRAC_1_SQRT_2,
            },
            Self::LogNormal { sigma } => libm::exp(sigma * place.normal()),
            Self::Gamma(map) => gamma_inverse::inverse(map.shape(), place, place.normal()),
            // The exponential number −ln(1 − u), raised to the inverse shape.
            Self::Weibull { inverse_shape } => libm::pow(-place.log_above(), *inverse_shape),
            Self::Empirical(values) => values.at(place),
            Self::Table(table) => table.at(place),
        }
    }

    /// Returns one draw. Forms computed from a normal number draw this number by the ziggurat, which rarely needs words from `more`.
    pub(super) fn draw(&self, word: u64, more: impl FnMut() -> u64) -> f64 {
        match self {
            Self::Normal => standard_normal(word, more),
            // The ziggurat is faster than the inverse of Φ.
            Self::LogNormal { .. } | Self::Gamma(_) => self.at_normal(standard_normal(word, more)),
            Self::Constant
            | Self::Uniform
            | Self::Pareto
            | Self::ParetoNormal
            | Self::Laplace
            | Self::Weibull { .. }
            | Self::Empirical(_)
            | Self::Table(_) => self.at(Tail::of_word(word)),
        }
    }

    /// Returns the probabilities of at most x and of more than x, each accurate even if small.
    pub(super) fn tails(&self, x: f64) -> (f64, f64) {
        let of_normal = |z: f64| (normal::below(z), normal::below(-z));
        match self {
            Self::Constant => {
                if x < 0.0 {
                    (0.0, 1.0)
                } else {
                    (1.0, 0.0)
                }
            }
            Self::Normal => of_normal(x),
            Self::Uniform => {
                // Both probabilities are computed separately, because 1 − p would lose the digits of a small tail.
                let above = (0.5 * (1.0 - x / SQRT_3)).clamp(0.0, 1.0);
                ((0.5 * (1.0 + x / SQRT_3)).clamp(0.0, 1.0), above)
            }
            Self::Pareto if x <= 1.0 => (0.0, 1.0),
            Self::Pareto => (-libm::expm1(-3.0 * libm::log(x)), 1.0 / (x * x * x)),
            Self::ParetoNormal => of_normal(pareto_normal::normal_of(x)),
            Self::Laplace => {
                // The probability beyond |x| on the side of x.
                let shorter = 0.5 * libm::exp(-x.abs() * core::f64::consts::SQRT_2);
                if x < 0.0 { (shorter, 1.0 - shorter) } else { (1.0 - shorter, shorter) }
            }
            Self::LogNormal { .. } | Self::Gamma(_) | Self::Weibull { .. } if x <= 0.0 => (0.0, 1.0),
            Self::LogNormal { sigma } => of_normal(libm::log(x) / sigma),
            Self::Gamma(map) => {
                let at = gamma::incomplete(map.shape(), x);
                (at.below, at.above)
            }
            Self::Weibull { inverse_shape } => {
                // Cumulative hazard x^k, with k the shape.
                let hazard = libm::pow(x, 1.0 / inverse_shape);
                (-libm::expm1(-hazard), libm::exp(-hazard))
            }
            Self::Empirical(values) => values.tails(x),
            Self::Table(table) => table.tails(x),
        }
    }
}
