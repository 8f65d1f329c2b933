//! Probability laws of a delay.
//!
//! A [`Law`] is a checked [`Distribution`] with a mean, a standard deviation and a floor. A law is a pure function of a uniform word ([`Law::draw`]), of a
//! probability ([`Law::quantile`]), of a delay ([`Law::cdf`]), or of a standard normal number ([`Law::at_normal`]). The last function makes delays that are
//! correlated in time and have exactly this marginal law (a Gaussian copula): with z(n) = φ·z(n − 1) + √(1 − φ²)·ε(n), the delays `at_normal(z(n))` have the
//! lag-one correlation ρ if φ is [`Law::gaussian_correlation`] of ρ.
//!
//! Numbers are `f64` in the caller's unit of delays.
//!
//! # What happens at the floor
//!
//! No delay is below the floor, which is zero unless another floor is given. Mean µ and standard deviation σ are exactly as given, except for a *cut* law;
//! [`Law::mean`] and [`Law::sd`] then return the moments of the drawn delays.
//!
//! | law | a delay is | at the floor f |
//! | --- | --- | --- |
//! | normal | µ + σ·z | cut: a draw below f is f, with probability Φ((f − µ)/σ) |
//! | Laplace | µ ± σ/√2·e, e exponential | cut, with probability ½·e^(√2·(f − µ)/σ) |
//! | Pareto-normal | netem's sum of a normal and a Pareto number of one uniform number, standardised | cut |
//! | table | µ + σ·entry/8192, each entry with the same probability, as in netem | cut; the table's own moments are delivered |
//! | uniform | µ ± √3·σ | refused if σ > (µ − f)/√3 |
//! | Pareto | µ + σ·(X − 3/2)/√(3/4), X = (1 − u)^(−1/3) | refused if σ > √3·(µ − f) |
//! | empirical | the given values, shifted and stretched to µ and σ | refused if the least value falls below f |
//! | lognormal, gamma, Weibull | f + X, X > 0 with mean µ − f | begins there; refused if σ > 100·(µ − f) |
//!
//! A cut would spoil the form of a law with a least value (a uniform law would get a spike), so such a law is refused, and the error tells the largest
//! possible deviation. A law without a least value is always cut. With a standard deviation of zero every delay is the mean.
//!
//! # Accuracy
//!
//! Quantiles agree with a reference of 40 digits to 10⁻¹² of their value between the probabilities 10⁻¹² and 1 − 10⁻¹² (tests). Standard normal
//! numbers beyond ±37.5, a probability of 5·10⁻³⁰⁸, count as ±37.5, so every delay is finite.
//!
//! ```
//! use cohaptic_wan::Distribution;
//! use cohaptic_wan::law::Law;
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
pub(crate) mod distribution;
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
mod whole;

#[cfg(test)]
mod tests;

use alloc::sync::Arc;

pub(crate) use dist_table::entries as dist_file_entries;
pub use dist_table::{DistTable, DistTableError};
pub(crate) use distribution::Distribution;
pub use empirical::{Empirical, EmpiricalError};
pub use error::LawError;
use fit::{Asked, Fit, fit};
pub(crate) use gamma_cubics::GammaCubics;
use gamma_map::GammaMap;
use standard::Standard;
use tail::Tail;

/// Largest standard deviation of a lognormal, gamma or Weibull law, in units of its mean above the floor.
const MAX_VARIATION: f64 = 100.0;

/// Largest size of standard normal numbers; Φ(−37.5) = 4.6·10⁻³⁰⁸ is still a normal `f64`.
const LARGEST_NORMAL: f64 = 37.5;

/// Law of delays, never below its floor and never infinite.
///
/// Cloning a law is cheap. A gamma law has 13 kB of tables that take time to compute, so links with the same law should share clones.
#[derive(Clone, Debug)]
pub struct Law {
    distribution: Distribution,
    asked: Asked,
    fit: Fit,
    /// Least delay of all draws.
    least: f64,
}

/// Two laws are equal if distribution, mean, deviation and floor are equal.
impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        (&self.distribution, self.asked) == (&other.distribution, other.asked)
    }
}

/// Gamma law without the choice between forms, for loops over many delays of one law.
#[derive(Clone, Debug)]
pub(crate) struct GammaLaw {
    map: Arc<GammaMap>,
    origin: f64,
    scale: f64,
    floor: f64,
}

impl GammaLaw {
    /// Returns the delay of [`Law::at_normal`], equal in every bit.
    #[inline(always)]
    pub(crate) fn at_normal(&self, z: f64) -> f64 {
        let delay = self.origin + self.scale * self.map.at_normal(z);
        // Each comparison is one instruction, which `f64::max` and `f64::min` are not. NaN becomes the floor in both ways.
        let delay = if delay > self.floor { delay } else { self.floor };
        if delay < f64::MAX { delay } else { f64::MAX }
    }

    /// Returns the cubics that give most delays in whole nanoseconds for several numbers at once, or `None` if the law has none.
    pub(crate) fn cubics(&self) -> Option<GammaCubics> {
        GammaCubics::new(self)
    }
}

impl Law {
    /// Returns the law with the given mean, standard deviation and floor. The floor is zero if not given.
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
        // `at_normal` does not use `least`, so the law can compute its own least delay.
        law.least = law.at_normal(-LARGEST_NORMAL);
        Ok(law)
    }

    /// Returns F⁻¹(Φ(z)), the delay of a standard normal number, accurate in both tails. The delay increases with z, except in its last digits.
    #[must_use]
    #[inline]
    pub fn at_normal(&self, z: f64) -> f64 {
        self.delay(self.fit.standard.at_normal(z.clamp(-LARGEST_NORMAL, LARGEST_NORMAL)))
    }

    /// Returns one independent draw for a uniform word. `more` gives further uniform words. The normal, lognormal and gamma laws need further words in 1.2 %
    /// of the draws, and the other laws need none.
    #[must_use]
    pub fn draw(&self, word: u64, more: impl FnMut() -> u64) -> f64 {
        self.delay(self.fit.standard.draw(word, more))
    }

    /// Returns the least delay that is exceeded with probability at most 1 − p. The delay is finite, because p and 1 − p count as at least 2·10⁻³⁰⁸. Returns
    /// NaN for NaN.
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

    /// Returns the probability of a delay of at most x.
    #[must_use]
    pub fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    /// Returns the probability of a delay above x: 1 − cdf, accurate also where it is small.
    #[must_use]
    pub fn survival(&self, x: f64) -> f64 {
        self.tails(x).1
    }

    /// Returns the mean of the delays drawn, which is the given mean unless the law is cut at the floor or is a table.
    #[must_use]
    pub const fn mean(&self) -> f64 {
        self.fit.delivered.mean
    }

    /// Returns the standard deviation of the delays drawn, which is the given deviation unless the law is cut at the floor or is a table.
    #[must_use]
    pub const fn sd(&self) -> f64 {
        self.fit.delivered.sd
    }

    /// Returns the least delay: the floor, or the law's own least value. The least value of a law without one is the delay at z = −37.5.
    #[must_use]
    pub const fn least(&self) -> f64 {
        self.least
    }

    /// Returns the form of the law.
    #[must_use]
    pub const fn distribution(&self) -> &Distribution {
        &self.distribution
    }

    /// Returns the law as a gamma law, or `None` if the law has another form.
    pub(crate) fn as_gamma(&self) -> Option<GammaLaw> {
        let Standard::Gamma(map) = &self.fit.standard else { return None };
        Some(GammaLaw { map: Arc::clone(map), origin: self.fit.origin, scale: self.fit.scale, floor: self.asked.floor })
    }

    /// Returns the delay at a place of the law.
    fn at(&self, place: Tail) -> f64 {
        self.delay(self.fit.standard.at(place))
    }

    /// Returns the delay of a number of the standard law.
    fn delay(&self, x: f64) -> f64 {
        (self.fit.origin + self.fit.scale * x).max(self.asked.floor).min(f64::MAX)
    }

    /// Returns the probabilities of at most x and of more than x, each accurate where it is small.
    fn tails(&self, x: f64) -> (f64, f64) {
        if x < self.asked.floor {
            (0.0, 1.0)
        // A constant has the scale zero, by which the distance cannot be divided.
        } else if self.fit.scale == 0.0 {
            self.fit.standard.tails(x - self.fit.origin)
        } else {
            self.fit.standard.tails((x - self.fit.origin) / self.fit.scale)
        }
    }
}
