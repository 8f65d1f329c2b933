//! The correlation of delays made from correlated Gaussians, and back.

use alloc::vec::Vec;

use super::hermite::Series;
use super::special::root;
use super::standard::Standard;
use super::tail::Tail;
use super::{Empirical, Law, LawError, pareto_normal};

/// ρ(φ) of a law.
enum Transfer {
    /// ρ = φ: a normal law that is not cut, or a law whose delays do not vary, of which a correlation says nothing.
    Identity,
    /// ρ = 6/π·asin(φ/2) (Pearson 1907).
    Uniform,
    /// ρ = (e^(φσ²) − 1)/(e^(σ²) − 1).
    LogNormal { variance: f64 },
    /// By Hermite coefficients.
    Series(Series),
}

impl Transfer {
    fn at(&self, phi: f64) -> f64 {
        match self {
            Self::Identity => phi,
            Self::Uniform => 6.0 / core::f64::consts::PI * libm::asin(0.5 * phi),
            Self::LogNormal { variance } => libm::expm1(phi * variance) / libm::expm1(*variance),
            Self::Series(series) => series.at(phi),
        }
    }

    /// φ, for a ρ that the law can have. ρ(φ) increases, since g does: its derivative is E[g′(X)·g′(Y)] (Price 1958).
    fn inverse(&self, rho: f64) -> f64 {
        match self {
            Self::Identity => rho,
            Self::Uniform => 2.0 * libm::sin(rho * core::f64::consts::FRAC_PI_6),
            Self::LogNormal { variance } => libm::log1p(rho * libm::expm1(*variance)) / variance,
            Self::Series(series) => root::increasing(|phi| series.at(phi) - rho, -1.0, 1.0),
        }
    }
}

/// A normal law is cut with a probability of 10⁻²³ at most: nothing is seen of it.
const UNCUT: f64 = -10.0;
/// More knots than this are thinned out before their kinks are integrated between.
const MOST_KNOTS: usize = 4096;

impl Law {
    /// The correlation of two delays `at_normal(x)` and `at_normal(y)` of standard normals x and y with correlation φ; φ is believed to lie in [−1, 1].
    ///
    /// Closed forms for the normal, uniform and lognormal laws; otherwise Hermite coefficients, computed anew at each call, which takes milliseconds.
    /// The error is below 10⁻⁹ for smooth laws (10⁻⁷ if the deviation is above ten times the mean), 10⁻⁵ for cut ones, tables and empirical ones; for
    /// empirical ones of more than 4096 values, which are thinned out, 10⁻³. A constant has ρ = φ.
    #[must_use]
    pub fn correlation(&self, phi: f64) -> f64 {
        self.transfer().at(phi.clamp(-1.0, 1.0))
    }

    /// φ, the correlation of the standard normals whose delays have correlation ρ: the inverse of [`correlation`](Self::correlation).
    ///
    /// # Errors
    ///
    /// [`LawError::NotACorrelation`] if ρ is not in [−1, 1], [`LawError::TooNegative`] if two variables with this law cannot have it.
    pub fn gaussian_correlation(&self, rho: f64) -> Result<f64, LawError> {
        if !(-1.0..=1.0).contains(&rho) {
            return Err(LawError::NotACorrelation { found: rho });
        }
        let transfer = self.transfer();
        let least = transfer.at(-1.0);
        if rho < least - 1e-12 {
            return Err(LawError::TooNegative { asked: rho, least });
        }
        Ok(transfer.inverse(rho).clamp(-1.0, 1.0))
    }

    fn transfer(&self) -> Transfer {
        let cut = self.cut();
        if self.fit.delivered.sd == 0.0 {
            return Transfer::Identity;
        }
        match &self.fit.standard {
            Standard::Constant => Transfer::Identity,
            Standard::Normal if cut < UNCUT => Transfer::Identity,
            Standard::Normal => Transfer::Series(Series::of_cut_normal(cut, self.fit.delivered.sd / self.fit.scale)),
            Standard::Uniform => Transfer::Uniform,
            Standard::LogNormal { sigma } => Transfer::LogNormal { variance: sigma * sigma },
            Standard::Table(_) => Transfer::Series(Series::of_jumps(&self.jumps(cut))),
            Standard::Laplace => {
                let cut_at = Tail::Below(0.5 * libm::exp(cut * core::f64::consts::SQRT_2)).normal();
                self.series([cut_at, 0.0].into_iter())
            }
            Standard::ParetoNormal => self.series([pareto_normal::normal_of(cut)].into_iter()),
            Standard::Pareto | Standard::Gamma(_) | Standard::Weibull { .. } => self.series(core::iter::empty()),
            Standard::Empirical(values) => self.series(knots(values).into_iter()),
        }
    }

    /// The floor as a number of the standard law.
    fn cut(&self) -> f64 {
        (self.asked.floor - self.fit.origin) / self.fit.scale
    }

    fn series(&self, breaks: impl Iterator<Item = f64>) -> Transfer {
        let (cut, scale) = (self.cut(), self.fit.scale);
        let mean = (self.fit.delivered.mean - self.fit.origin) / scale;
        let sd = self.fit.delivered.sd / scale;
        Transfer::Series(Series::of_function(|z| (self.fit.standard.at_normal(z).max(cut) - mean) / sd, breaks))
    }

    /// Where the delays of a table jump, and by how many standard deviations.
    fn jumps(&self, cut: f64) -> Vec<(f64, f64)> {
        let Standard::Table(table) = &self.fit.standard else { return Vec::new() };
        let unit = self.fit.scale / self.fit.delivered.sd;
        let entries = table.entries();
        let pairs = entries.windows(2).zip(1..);
        pairs
            .filter(|(pair, _): &(&[i16], usize)| pair[0] != pair[1] && f64::from(pair[1]) > cut)
            .map(|(pair, index)| {
                let height = (f64::from(pair[1]) - f64::from(pair[0]).max(cut)) * unit;
                (Tail::of_probability(ratio(index, entries.len())).normal(), height)
            })
            .collect()
    }
}

/// The standard normal numbers of the inner knots, or of equally many between them.
fn knots(values: &Empirical) -> Vec<f64> {
    let cells = values.knots().len() - 1;
    let stride = cells.div_ceil(MOST_KNOTS);
    (1..cells).step_by(stride).map(|i| Tail::of_probability(ratio(i, cells)).normal()).collect()
}

#[expect(clippy::cast_precision_loss, reason = "there are at most 2^20 values")]
fn ratio(i: usize, count: usize) -> f64 {
    i as f64 / count as f64
}
