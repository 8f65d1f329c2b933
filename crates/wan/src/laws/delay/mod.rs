//! The probability laws of a delay.
//!
//! A [`Law`] is a [`Distribution`] with a mean, a standard deviation and a floor, checked. It is a pure function: of a uniform word
//! ([`Law::draw`]), of a probability ([`Law::quantile`]), of a delay ([`Law::cdf`]), or of a standard normal number ([`Law::at_normal`]), which makes
//! delays correlated in time with exactly this marginal law (a Gaussian copula): with z(n) = φ·z(n − 1) + √(1 − φ²)·ε(n), the delays `at_normal(z(n))`
//! have lag-one correlation ρ if φ is [`Law::gaussian_correlation`] of ρ.
//!
//! Numbers are `f64` in whatever unit the caller counts delays.
//!
//! # What happens at the floor
//!
//! No delay is below the floor, which is zero unless another is given. Mean µ and standard deviation σ are those asked for, exactly, except where a
//! law is *cut*; then [`Law::mean`] and [`Law::sd`] tell those delivered.
//!
//! | law | a delay is | at the floor f |
//! | --- | --- | --- |
//! | normal | µ + σ·z | cut: a draw below f is f, with probability Φ((f − µ)/σ) |
//! | Laplace | µ ± σ/√2·e, e exponential | cut, with probability ½·e^(√2·(f − µ)/σ) |
//! | Pareto-normal | netem's sum of a normal and a Pareto number of one uniform number, standardised | cut |
//! | table | µ + σ·entry/8192, each entry with the same probability, as in netem | cut; the table's own moments are delivered |
//! | uniform | µ ± √3·σ | refused if σ > (µ − f)/√3 |
//! | Pareto | µ + σ·(X − 3/2)/√(3/4), X = (1 − u)^(−1/3) | refused if σ > √3·(µ − f) |
//! | empirical | the given values, shifted and stretched to µ and σ | refused if the least one falls below f |
//! | lognormal, gamma, Weibull | f + X, X > 0 with mean µ − f | begins there; refused if σ > 100·(µ − f) |
//!
//! A law with a least value has a form that a cut would spoil (a uniform law would get a spike), so it is refused with the largest deviation possible;
//! a law without one is always cut somewhere. A standard deviation of zero is a constant.
//!
//! # Accuracy
//!
//! Quantiles agree with a reference of 40 digits to 10⁻¹² of their value between the probabilities 10⁻¹² and 1 − 10⁻¹² (tests). Standard normal
//! numbers beyond ±37.5, a probability of 5·10⁻³⁰⁸, count as ±37.5, so that every delay is finite.
//!
//! ```
//! use cohaptic_wan::law::{Distribution, Law};
//!
//! // Milliseconds: at least 20, on average 24 ± 2.
//! let law = Law::new(&Distribution::Gamma, 24.0, 2.0, Some(20.0))?;
//! assert!((law.cdf(law.quantile(0.9999)) - 0.9999).abs() < 1e-12);
//! assert!(law.quantile(0.9999) > 35.0);
//! # Ok::<(), cohaptic_wan::law::LawError>(())
//! ```

mod correlation;
mod cut;
mod dist_table;
mod empirical;
mod error;
mod fit;
mod gamma_cubics;
mod gamma_map;
mod hermite;
mod pareto_normal;
mod special;
mod standard;
mod tail;

impl Distribution {
    /// The law in a word.
    pub(crate) fn words(&self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Uniform => "uniform",
            Self::Pareto => "Pareto",
            Self::ParetoNormal => "Pareto-normal",
            Self::LogNormal => "lognormal",
            Self::Gamma => "gamma",
            Self::Weibull => "Weibull",
            Self::Laplace => "Laplace",
            Self::Empirical(_) => "measured",
            Self::Table(_) => "tabulated",
        }
    }
}

#[cfg(test)]
mod tests;

use alloc::sync::Arc;

pub(crate) use dist_table::entries as dist_file_entries;
pub use dist_table::{DistTable, DistTableError};
pub use empirical::{Empirical, EmpiricalError};
pub use error::LawError;
use fit::{Asked, Fit, fit};
pub(crate) use gamma_cubics::GammaCubics;
use gamma_map::GammaMap;
use standard::Standard;
use tail::Tail;

/// The form of a law. The table of the [module](self) says what each is and what it does at the floor.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum Distribution {
    /// Normal, cut at the floor.
    #[default]
    Normal,
    /// Uniform over µ ± √3·σ.
    Uniform,
    /// Pareto of tail index 3, as in netem's table, but exact: its standard deviation is the one asked for and its tail has no end.
    Pareto,
    /// netem's ¼ normal and ¾ Pareto, exact, cut at the floor.
    ParetoNormal,
    /// Lognormal from the floor.
    LogNormal,
    /// Gamma from the floor.
    Gamma,
    /// Weibull from the floor.
    Weibull,
    /// Laplace, cut at the floor.
    Laplace,
    /// Values, shifted and stretched to the mean and the deviation asked for.
    Empirical(Arc<Empirical>),
    /// A `.dist` file as netem uses it: σ·entry/8192 around the mean, cut at the floor. What this delivers depends on the table.
    Table(Arc<DistTable>),
}

/// The largest standard deviation of a lognormal, gamma or Weibull law, in units of its mean above the floor.
pub const MAX_VARIATION: f64 = 100.0;

/// Standard normal numbers count up to this size; Φ(−37.5) = 4.6·10⁻³⁰⁸ is a normal `f64`.
const LARGEST_NORMAL: f64 = 37.5;

/// A law of delays: never below its floor, never infinite.
///
/// Cloning is cheap. Making a gamma law takes about 0.1 ms and 13 kB, so links with the same law should share clones of it.
#[derive(Clone, Debug)]
pub struct Law {
    distribution: Distribution,
    asked: Asked,
    fit: Fit,
    least: f64,
}

/// Equal if asked for with the same words: distribution, mean, deviation and floor.
impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        (&self.distribution, self.asked) == (&other.distribution, other.asked)
    }
}

/// A gamma law, for delays that follow each other without a question which law they have.
#[derive(Clone, Debug)]
pub(crate) struct GammaLaw {
    map: Arc<GammaMap>,
    origin: f64,
    scale: f64,
    floor: f64,
}

impl GammaLaw {
    /// [`Law::at_normal`], to the bit.
    #[inline(always)]
    pub(crate) fn at_normal(&self, z: f64) -> f64 {
        let delay = self.origin + self.scale * self.map.at_normal(z);
        // An instruction each, which `f64::max` and `f64::min` are not; a NaN is the floor here as there.
        let delay = if delay > self.floor { delay } else { self.floor };
        if delay < f64::MAX { delay } else { f64::MAX }
    }

    /// Its delays in whole numbers, for several at once, if they come so.
    pub(crate) fn cubics(&self) -> Option<GammaCubics> {
        GammaCubics::new(self)
    }
}

impl Law {
    /// The law with that mean and standard deviation; `floor` is zero if not given.
    ///
    /// # Errors
    ///
    /// [`LawError`] if a number is not finite, the deviation negative, the mean below the floor, or the law cannot stay above the floor (see the table
    /// of the [module](self)).
    pub fn new(distribution: &Distribution, mean: f64, sd: f64, floor: Option<f64>) -> Result<Self, LawError> {
        let floor = floor.unwrap_or(0.0);
        for (quantity, found) in [("mean", mean), ("standard deviation", sd), ("floor", floor)] {
            if !found.is_finite() {
                return Err(LawError::NotFinite { quantity, found });
            }
        }
        if sd < 0.0 {
            return Err(LawError::NegativeDeviation { sd });
        }
        if mean < floor {
            return Err(LawError::FloorAboveMean { mean, floor });
        }
        let asked = Asked { mean, sd, floor };
        let fit = fit(distribution, asked)?;
        let mut law = Self { distribution: distribution.clone(), asked, fit, least: floor };
        law.least = law.at_normal(-LARGEST_NORMAL);
        Ok(law)
    }

    /// F⁻¹(Φ(z)), accurate in both tails: the delay of a standard normal number. Increases with z, but for the last digits.
    #[must_use]
    #[inline]
    pub fn at_normal(&self, z: f64) -> f64 {
        self.delay(self.fit.standard.at_normal(z.clamp(-LARGEST_NORMAL, LARGEST_NORMAL)))
    }

    /// One independent draw from a uniform word. `more` gives further uniform words, of which the normal, lognormal and gamma laws need some in 1.2 %
    /// of the draws and the others none.
    #[must_use]
    #[inline]
    pub fn draw(&self, word: u64, more: impl FnMut() -> u64) -> f64 {
        self.delay(self.fit.standard.draw(word, more))
    }

    /// The least delay that is exceeded with probability at most 1 − p. Finite: p counts as at least 2·10⁻³⁰⁸, and so does 1 − p. A NaN gives a NaN.
    #[must_use]
    pub fn quantile(&self, p: f64) -> f64 {
        if p.is_nan() {
            return p;
        }
        self.at(match Tail::of_probability(p) {
            Tail::Below(p) => Tail::Below(p.max(f64::MIN_POSITIVE)),
            Tail::Above(q) => Tail::Above(q.max(f64::MIN_POSITIVE)),
        })
    }

    /// The probability of a delay of at most x.
    #[must_use]
    pub fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    /// The probability of a delay above x: 1 − cdf, accurate also where it is small.
    #[must_use]
    pub fn survival(&self, x: f64) -> f64 {
        self.tails(x).1
    }

    /// The mean of the delays drawn: the one asked for unless the law is cut at the floor or is a table.
    #[must_use]
    pub const fn mean(&self) -> f64 {
        self.fit.delivered.mean
    }

    /// The standard deviation of the delays drawn: the one asked for unless the law is cut at the floor or is a table.
    #[must_use]
    pub const fn sd(&self) -> f64 {
        self.fit.delivered.sd
    }

    /// No delay is below this: the floor, or the law's own least value, which for a law without one is that at z = −37.5.
    #[must_use]
    pub const fn least(&self) -> f64 {
        self.least
    }

    /// The form of the law.
    #[must_use]
    pub const fn distribution(&self) -> &Distribution {
        &self.distribution
    }

    /// The law as a gamma law, if it is one.
    pub(crate) fn as_gamma(&self) -> Option<GammaLaw> {
        let Standard::Gamma(map) = &self.fit.standard else { return None };
        Some(GammaLaw { map: Arc::clone(map), origin: self.fit.origin, scale: self.fit.scale, floor: self.asked.floor })
    }

    fn at(&self, place: Tail) -> f64 {
        self.delay(self.fit.standard.at(place))
    }

    /// The delay of a number of the standard law.
    #[inline]
    fn delay(&self, x: f64) -> f64 {
        (self.fit.origin + self.fit.scale * x).max(self.asked.floor).min(f64::MAX)
    }

    fn tails(&self, x: f64) -> (f64, f64) {
        if x < self.asked.floor {
            (0.0, 1.0)
        } else if self.fit.scale == 0.0 {
            self.fit.standard.tails(x - self.fit.origin)
        } else {
            self.fit.standard.tails((x - self.fit.origin) / self.fit.scale)
        }
    }
}
