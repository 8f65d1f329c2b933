//! Correlation of delays made from correlated Gaussian numbers, and the inverse.

use alloc::vec::Vec;

use super::hermite::Series;
use super::special::root;
use super::standard::Standard;
use super::tail::Tail;
use super::{Empirical, Law, LawError, pareto_normal};

/// Function ρ(φ) of a law.
enum Transfer {
    /// ρ = φ: an uncut normal law, or a law of constant delays, without correlation.
    Identity,
    /// ρ = 6/π·asin(φ/2) (Pearson 1907).
    Uniform,
    /// ρ = (e^(φσ²) − 1)/(e^(σ²) − 1).
    LogNormal { variance: f64 },
    /// Function given by Hermite coefficients.
    Series(Series),
}

impl Transfer {
    /// Returns ρ.
    fn at(&self, phi: f64) -> f64 {
        match self {
            Self::Identity => phi,
            Self::Uniform => 6.0 / core::f64::consts::PI * libm::asin(0.5 * phi),
            // `expm1` keeps the digits for small variances.
            Self::LogNormal { variance } => libm::expm1(phi * variance) / libm::expm1(*variance),
            Self::Series(series) => series.at(phi),
        }
    }

    /// Returns φ for a possible ρ of the law. ρ(φ) increases, because g increases: its derivative is E[g′(X)·g′(Y)] (Price 1958).
    fn inverse(&self, rho: f64) -> f64 {
        match self {
            Self::Identity => rho,
            Self::Uniform => 2.0 * libm::sin(rho * core::f64::consts::FRAC_PI_6),
            Self::LogNormal { variance } => libm::log1p(rho * libm::expm1(*variance)) / variance,
            Self::Series(series) => root::increasing(|phi| series.at(phi) - rho, -1.0, 1.0),
        }
    }
}

/// Bound \[standard deviations\] of cuts: below, a normal law counts as uncut. A draw falls below this cut with a probability of at most 10⁻²³.
const UNCUT: f64 = -10.0;
/// Largest number of knots for the integration of an empirical law, with a kink at each knot. Of more knots only some are used.
const MOST_KNOTS: usize = 4096;

impl Law {
    /// Returns the correlation of two delays `at_normal(x)` and `at_normal(y)` of standard normals x and y with correlation `phi`. A `phi` outside of [−1, 1]
    /// counts as the nearer end.
    ///
    /// The normal, uniform and lognormal laws have closed forms. Other laws use Hermite coefficients, computed anew at each call, which takes milliseconds.
    /// The error is below 10⁻⁹ for smooth laws (10⁻⁷ if the deviation is above ten times the mean), 10⁻⁵ for cut laws, tables and empirical laws, and 10⁻³
    /// for empirical laws of more than 4096 values, because only some values are used. A constant has ρ = φ.
    #[must_use]
    pub fn correlation(&self, phi: f64) -> f64 {
        self.transfer().at(phi.clamp(-1.0, 1.0))
    }

    /// Returns φ, the correlation of the standard normals for delays with the correlation `rho`: the inverse of [`correlation`](Self::correlation).
    ///
    /// # Errors
    ///
    /// [`LawError::NotACorrelation`] if `rho` is not in [−1, 1], [`LawError::TooNegative`] if two variables with this law cannot have the correlation.
    pub fn gaussian_correlation(&self, rho: f64) -> Result<f64, LawError> {
        if !(-1.0..=1.0).contains(&rho) {
            return Err(LawError::NotACorrelation { found: rho });
        }
        let transfer = self.transfer();
        // Delays at z and −z are as opposite as the law allows.
        let least = transfer.at(-1.0);
        // The least correlation itself is accepted in spite of rounding.
        if rho < least - 1e-12 {
            return Err(LawError::TooNegative { asked: rho, least });
        }
        Ok(transfer.inverse(rho).clamp(-1.0, 1.0))
    }

    /// Returns the function ρ(φ) of this law.
    fn transfer(&self) -> Transfer {
        let cut = self.cut();
        // A law cut as a whole has constant delays.
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
                // The kink of the cut, and the kink of the Laplace law at its centre.
                let cut_at = Tail::Below(0.5 * libm::exp(cut * core::f64::consts::SQRT_2)).normal();
                self.series([cut_at, 0.0].into_iter())
            }
            Standard::ParetoNormal => self.series([pareto_normal::normal_of(cut)].into_iter()),
            Standard::Pareto | Standard::Gamma(_) | Standard::Weibull { .. } => self.series(core::iter::empty()),
            Standard::Empirical(values) => self.series(knots(values).into_iter()),
        }
    }

    /// Returns the floor as a number of the standard law.
    fn cut(&self) -> f64 {
        (self.asked.floor - self.fit.origin) / self.fit.scale
    }

    /// Returns the function of a smooth law with kinks at the standard normal numbers `breaks`, in ascending order.
    fn series(&self, breaks: impl Iterator<Item = f64>) -> Transfer {
        let (cut, scale) = (self.cut(), self.fit.scale);
        let mean = (self.fit.delivered.mean - self.fit.origin) / scale;
        let sd = self.fit.delivered.sd / scale;
        Transfer::Series(Series::of_function(|z| (self.fit.standard.at_normal(z).max(cut) - mean) / sd, breaks))
    }

    /// Returns the jumps of a table's delays: the standard normal number of each jump, and its height \[standard deviations\].
    fn jumps(&self, cut: f64) -> Vec<(f64, f64)> {
        let Standard::Table(table) = &self.fit.standard else { return Vec::new() };
        let unit = self.fit.scale / self.fit.delivered.sd;
        let entries = table.entries();
        let pairs = entries.windows(2).zip(1..);
        pairs
            // Equal neighbours have no jump between them, and a jump below the cut is cut away.
            .filter(|(pair, _): &(&[i16], usize)| pair[0] != pair[1] && f64::from(pair[1]) > cut)
            .map(|(pair, index)| {
                // A jump across the cut begins at the cut.
                let height = (f64::from(pair[1]) - f64::from(pair[0]).max(cut)) * unit;
                (Tail::of_probability(ratio(index, entries.len())).normal(), height)
            })
            .collect()
    }
}

/// Returns the standard normal numbers of the inner knots, or of every n-th knot if there are more than [`MOST_KNOTS`].
fn knots(values: &Empirical) -> Vec<f64> {
    let cells = values.knots().len() - 1;
    // Fewer knots bound the time; the kinks between are then integrated as if smooth.
    let stride = cells.div_ceil(MOST_KNOTS);
    (1..cells).step_by(stride).map(|i| Tail::of_probability(ratio(i, cells)).normal()).collect()
}

#[expect(clippy::cast_precision_loss, reason = "there are at most 2^20 values")]
fn ratio(i: usize, count: usize) -> f64 {
    i as f64 / count as f64
}
