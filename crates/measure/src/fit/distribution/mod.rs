//! Fits laws to delays, and chooses the best.
//!
//! Input is the delays as cells ([`Cells`]) and their moments; output is all possible laws, the best first. A delay x shown by a clock of resolution r is
//! the interval x − r/2 to x + r/2. For each law of a link ([`cohaptic_wan::law`]), mean, standard deviation and (for the lognormal, gamma and Weibull
//! laws) floor are chosen to make the intervals most probable,
//!
//! ```text
//! ln L = Σ ln(F(x + r/2) − F(x − r/2)),
//! ```
//!
//! with the mean and the standard deviation within one standard error of the sample's: sd/√m for the mean and sd·√((κ − 1)/4m) for the deviation, for the
//! kurtosis κ of the sample and m independent delays of the same information. So a law chosen for its form never has other moments than the measurement. No
//! law gains without bound at the least delay, because the probability of an interval is at most 1. A uniform law reaches from end to end: the part of the
//! law beyond the inner end of an outermost interval equals the share of the delays there, which is unbiased for a fine clock.
//!
//! A law fits if its distribution function differs from the function of the delays by at most 0.02 + 1.63/√m at all ends of intervals (Kolmogorov). 1.63/√m
//! is the 0.99 quantile of the distance for the true law, and a difference of 0.02 matters to no application of a link. m counts as at least 50 here. A law
//! with more parameters than the number of intervals minus two could not fail, and is left out. Among the fitting laws, Akaike's criterion 2k − 2·ln L with
//! k parameters decides; the least value is best. Correlation makes the differences of the criterion larger than they should be, but favours no law.

use cohaptic_wan::law::Law;
use serde::Serialize;

use super::cells::Cells;
use super::law::DelayLaw;
use super::search::climb;
use crate::series::{self, count};

/// A law fitted to the delays, with its goodness.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct LawFit {
    /// Family of the law.
    pub distribution: DelayLaw,
    /// Mean \[s\].
    pub mean_s: f64,
    /// Standard deviation \[s\].
    pub sd_s: f64,
    /// Least delay \[s\]; `None` for a law without a floor, or a floor of zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor_s: Option<f64>,
    /// Shape parameter of a gamma or Weibull law, or standard deviation of the logarithm of a lognormal law; `None` for other laws.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<f64>,
    /// ln L of the intervals, computed as for independent delays; never positive.
    pub log_likelihood: f64,
    /// Akaike's criterion. The least value is best, and a difference of 10 is clear (Burnham & Anderson 2002).
    pub aic: f64,
    /// Largest distance between the distribution functions of the data and of the law, at ends of intervals (Kolmogorov).
    pub kolmogorov: f64,
    /// Probability of a larger distance for a true law with parameters not fitted: 2·Σ(−1)ᵏ⁻¹·e^(−2k²mD²) for m independent delays (Smirnov 1948, The
    /// Annals of Mathematical Statistics 19(2)). Too large for fitted parameters.
    pub p_value: f64,
    /// `true` if the distance is at most [`Goodness::kolmogorov_limit`](super::Goodness::kolmogorov_limit).
    pub fits: bool,
}

/// A fitted law with its parameters for a link.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) fit: LawFit,
    pub(super) law: Law,
    pub(super) asked: Asked,
}

/// Parameters of a law, as written for a link \[s\]. The moments of a law cut at zero differ from these parameters.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Asked {
    pub(super) mean: f64,
    pub(super) sd: f64,
    pub(super) floor: f64,
}

/// Moments of the sample \[s\], and their standard errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) mean_error: f64,
    pub(super) sd: f64,
    pub(super) sd_error: f64,
}

/// Distance of distribution functions that does not matter.
const NEAR: f64 = 0.02;
/// Quantile 0.99 of Kolmogorov's law.
const KOLMOGOROV_99: f64 = 1.627_624;
/// Least number of independent delays in the limit of the distance. Fewer delays would widen the limit until every law fits.
const LEAST_EFFECTIVE: f64 = 50.0;
/// Probability counted for a delay excluded by a law. Such a law is far from the best, and can still be compared.
const EXCLUDED: f64 = 1e-300;

impl Moments {
    /// Computes the moments of delays worth `effective` independent ones. Returns `None` for fewer than two delays. The delays must not all be equal.
    pub(super) fn of(delays: &[f64], effective: f64) -> Option<Self> {
        let (mean, sd) = (series::mean(delays)?, series::variance(delays)?.sqrt());
        let kurtosis = delays.iter().map(|delay| ((delay - mean) / sd).powi(4)).sum::<f64>() / count(delays.len());
        let sd_error = sd * ((kurtosis - 1.0).max(0.0) / (4.0 * effective)).sqrt();
        // The error is at most half of the deviation, so that a fitted deviation stays positive. A few independent delays with an outlier would exceed this
        // bound.
        Some(Self { mean, mean_error: sd / effective.sqrt(), sd, sd_error: sd_error.min(sd / 2.0) })
    }

    /// Returns mean and deviation, moved from the sample's by the given numbers of standard errors, each limited to ±1.
    fn within(&self, [mean, sd]: [f64; 2]) -> [f64; 2] {
        [self.mean + self.mean_error * mean.clamp(-1.0, 1.0), self.sd + self.sd_error * sd.clamp(-1.0, 1.0)]
    }

    /// Returns whether a law has these moments, up to one standard error and rounding. A law cut at zero may not.
    fn has(&self, law: &Law) -> bool {
        let near = |found: f64, wanted: f64, error: f64| (found - wanted).abs() <= error + 1e-9 * self.sd;
        near(law.mean(), self.mean, self.mean_error) && near(law.sd(), self.sd, self.sd_error)
    }
}

/// Returns the largest distance of a fitting law from the data.
pub(super) fn limit(effective: f64) -> f64 {
    NEAR + KOLMOGOROV_99 / effective.max(LEAST_EFFECTIVE).sqrt()
}

/// Fits all laws. Returns fitting laws first, then the others, each group from the best to the worst. The delays in `cells` must not all be equal, and none
/// may be negative.
pub(super) fn fit_all(cells: &Cells, moments: &Moments, effective: f64) -> Vec<Candidate> {
    let (coarse, judged) = (cells.coarse(), cells.judged());
    let of_law = |name: DelayLaw| {
        let asked = fit(name, &coarse, moments, effective)?;
        let law = law(name, asked).filter(|law| moments.has(law))?;
        let parameters = if begins_at_floor(name) && asked.floor > 0.0 { 3.0 } else { 2.0 };
        (parameters <= count(cells.cells.len()) - 2.0).then(|| Candidate {
            fit: judge(name, asked, &law, parameters, &judged, effective),
            law,
            asked,
        })
    };
    let mut all: Vec<Candidate> = DelayLaw::ALL.into_iter().filter_map(of_law).collect();
    all.sort_by(|one, other| other.fit.fits.cmp(&one.fit.fits).then(one.fit.aic.total_cmp(&other.fit.aic)));
    all
}

/// Returns whether a law has a floor as a parameter of its own.
const fn begins_at_floor(name: DelayLaw) -> bool {
    matches!(name, DelayLaw::Lognormal | DelayLaw::Gamma | DelayLaw::Weibull)
}

/// Makes the law of a link; `None` for parameters refused by links.
fn law(name: DelayLaw, Asked { mean, sd, floor }: Asked) -> Option<Law> {
    Law::new(&name.into(), mean, sd, Some(floor)).ok()
}

/// Computes the goodness of a law.
fn judge(name: DelayLaw, asked: Asked, law: &Law, parameters: f64, judged: &Cells, effective: f64) -> LawFit {
    let log_likelihood = log_likelihood(law, judged);
    let kolmogorov = kolmogorov(law, judged);
    let least = if name == DelayLaw::Uniform { law.least() } else { asked.floor };
    LawFit {
        distribution: name,
        mean_s: law.mean(),
        sd_s: law.sd(),
        floor_s: Some(least).filter(|&floor| floor > 0.0),
        shape: shape(name, law, asked),
        log_likelihood,
        aic: 2.0 * parameters - 2.0 * log_likelihood,
        kolmogorov,
        p_value: farther(effective.sqrt() * kolmogorov),
        fits: kolmogorov <= limit(effective),
    }
}

/// Returns the shape parameter of a law, from the moments above the floor.
fn shape(name: DelayLaw, law: &Law, Asked { mean, sd, floor }: Asked) -> Option<f64> {
    let above = mean - floor;
    let variation = sd / above;
    match name {
        DelayLaw::Normal | DelayLaw::Uniform | DelayLaw::Laplace => None,
        DelayLaw::Lognormal => Some((variation * variation).ln_1p().sqrt()),
        DelayLaw::Gamma => Some(1.0 / (variation * variation)),
        DelayLaw::Weibull => {
            // −ln S of a Weibull law is proportional to the distance from the floor raised to the shape, so a ratio at two distances gives the shape.
            let hazard = |x: f64| -law.survival(floor + x).ln();
            Some((hazard(above) / hazard(above / 2.0)).log2())
        }
    }
}

/// Returns ln L of the intervals.
fn log_likelihood(law: &Law, Cells { cells, n }: &Cells) -> f64 {
    let mut before = 0.0;
    let logarithm = |cell: &super::cells::Cell| {
        // The difference is taken in the smaller tail, where the digits are.
        let lower_half = before + cell.count / 2.0 < n / 2.0;
        let probability = if lower_half { law.cdf(cell.high) - law.cdf(cell.low) } else { law.survival(cell.low) - law.survival(cell.high) };
        before += cell.count;
        cell.count * probability.max(EXCLUDED).ln()
    };
    cells.iter().map(logarithm).sum()
}

/// Returns Kolmogorov's distance at the ends of the intervals.
fn kolmogorov(law: &Law, Cells { cells, n }: &Cells) -> f64 {
    let mut before = 0.0;
    let distance = |cell: &super::cells::Cell| {
        let at_low = (law.cdf(cell.low) - before / n).abs();
        before += cell.count;
        at_low.max((law.cdf(cell.high) - before / n).abs())
    };
    cells.iter().map(distance).fold(0.0, f64::max)
}

/// Returns the probability that Kolmogorov's law exceeds x.
fn farther(x: f64) -> f64 {
    if x < 0.2 {
        // The probability is above 1 − 10⁻¹² here, and the series would need many terms.
        return 1.0;
    }
    let term = |k: u32| (-2.0 * (f64::from(k) * x).powi(2)).exp();
    // Terms of opposite signs in pairs. Terms beyond the 40th are below 10⁻⁵⁵ for these x, and change no digit of the sum.
    (2.0 * (1..40).step_by(2).map(|k| term(k) - term(k + 1)).sum::<f64>()).clamp(0.0, 1.0)
}

/// Returns the parameters of the most probable law of a family; `None` if no law of the family has the moments.
fn fit(name: DelayLaw, cells: &Cells, moments: &Moments, effective: f64) -> Option<Asked> {
    if name == DelayLaw::Uniform {
        return uniform(cells, moments, effective);
    }
    let likelihood = |asked: Asked| {
        let law = law(name, asked).filter(|law| moments.has(law));
        law.map_or(f64::NEG_INFINITY, |law| log_likelihood(&law, cells))
    };
    // The sine maps the simplex's unlimited coordinates to ±1 standard error. Limiting by clamping would make a flat part, on which a simplex ends early.
    if !begins_at_floor(name) {
        let of = |at: [f64; 2]| {
            let [mean, sd] = moments.within(at.map(f64::sin));
            Asked { mean, sd, floor: 0.0 }
        };
        return climb([0.0; 2], [0.5; 2], |at| likelihood(of(at))).map(|(at, _)| of(at));
    }
    // The floor is searched as the logarithm of its distance from the upper end of the least interval, since no floor can be above that end.
    let top = cells.cells.first()?.high;
    let of = |[mean, sd, log_distance]: [f64; 3]| {
        let [mean, sd] = moments.within([mean.sin(), sd.sin()]);
        Asked { mean, sd, floor: (top - log_distance.exp()).max(0.0) }
    };
    // Starts from a tenth of a cell to a hundred deviations below, where these laws are nearly normal. Several starts, because the likelihood may have
    // several maxima.
    let nearest = (top - cells.cells.first()?.low) / 10.0;
    let farthest = (100.0 * moments.sd).min(top).max(2.0 * nearest);
    let starts = (0..=STARTS).map(|i| [0.0, 0.0, nearest.ln() + (farthest / nearest).ln() * f64::from(i) / f64::from(STARTS)]);
    let start = starts.map(|at| (at, likelihood(of(at)))).max_by(|one, other| one.1.total_cmp(&other.1))?.0;
    climb(start, [0.5; 3], |at| likelihood(of(at))).map(|(at, _)| of(at))
}

/// Number of steps between the floors of the first trial.
const STARTS: u32 = 24;

/// Returns the uniform law whose parts beyond the outermost intervals' inner ends equal the shares of delays there.
fn uniform(cells: &Cells, moments: &Moments, effective: f64) -> Option<Asked> {
    let (first, last) = (cells.cells.first()?, cells.cells.last()?);
    // Part of the law beyond the inner end of an outermost interval.
    let beyond = |cell: &super::cells::Cell| (cell.count / (cells.n + 1.0)).max(1.0 / (effective + 1.0));
    let width = (last.low - first.high) / (1.0 - beyond(first) - beyond(last));
    if !(width.is_finite() && width > 0.0) {
        return None;
    }
    let (low, high) = ((first.high - beyond(first) * width).max(0.0), last.low + beyond(last) * width);
    let place = |value: f64, at: f64, error: f64| if error > 0.0 { (value - at) / error } else { 0.0 };
    let [mean, _] = moments.within([place(f64::midpoint(low, high), moments.mean, moments.mean_error), 0.0]);
    // If the mean had to move, the law still reaches both ends, as far as the deviation allows.
    let half = (mean - low).max(high - mean);
    let [mean, sd] = moments.within([place(mean, moments.mean, moments.mean_error), place(half / 3.0_f64.sqrt(), moments.sd, moments.sd_error)]);
    Some(Asked { mean, sd, floor: 0.0 })
}

#[cfg(test)]
mod tests;
