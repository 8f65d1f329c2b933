//! Which law do the delays follow?
//!
//! A delay x that a clock of resolution r shows is the interval x − r/2 to x + r/2. For each law that a link has ([`cohaptic_wan::law`]), mean, standard
//! deviation and, for the lognormal, gamma and Weibull laws, the floor are those which make the intervals most probable,
//!
//! ```text
//! ln L = Σ ln(F(x + r/2) − F(x − r/2)),
//! ```
//!
//! among those whose mean and standard deviation lie within one standard error of the sample's: sd/√m for the mean, sd·√((κ − 1)/4m) for the deviation,
//! with the kurtosis κ of the sample and m independent delays that say as much. A law that is chosen for its form therefore never has other moments than the
//! measurement. No law gains without bound at the least delay, because no interval has a probability above 1. Uniform laws reach from end to end: the part of the law
//! beyond the inner end of the outermost interval is the share of the delays there, which is unbiased for a fine clock.
//!
//! A law fits if its distribution function is nowhere farther from that of the delays than 0.02 + 1.63/√m at ends of intervals (Kolmogorov): 1.63/√m is the 0.99
//! quantile of the distance for the true law, and 0.02 is a difference that no application of a link notices. m counts as at least 50 here. A law with more parameters
//! than two fewer than there are intervals could not fail and is left out. Among the laws that fit, Akaike's criterion, 2k − 2·ln L with k parameters, chooses; the least is
//! best. Correlation makes the differences larger than they should be, but does not move them systematically to one of the laws.

use cohaptic_wan::law::Law;
use serde::Serialize;

use super::cells::Cells;
use super::law::DelayLaw;
use super::search::climb;
use crate::series::{self, count};

/// One law fitted to the delays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct LawFit {
    /// The law.
    pub distribution: DelayLaw,
    /// Its mean \[s\].
    pub mean_s: f64,
    /// Its standard deviation \[s\].
    pub sd_s: f64,
    /// Its least delay \[s\]; `None` if it has none or if the data show none above zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor_s: Option<f64>,
    /// Its shape: that of the gamma and Weibull laws, the standard deviation of the logarithm of the lognormal law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<f64>,
    /// ln L of the intervals, as if delays were independent; not above zero.
    pub log_likelihood: f64,
    /// Akaike's criterion; less is better, and a difference of 10 is plain (Burnham & Anderson 2002).
    pub aic: f64,
    /// The largest distance between the distribution functions of the data and of the law, at ends of intervals (Kolmogorov).
    pub kolmogorov: f64,
    /// The probability of a distance that is larger, if the law were true and its parameters not fitted: 2·Σ(−1)ᵏ⁻¹·e^(−2k²mD²) for m independent delays
    /// (Smirnov 1948, The Annals of Mathematical Statistics 19(2)). It is too large for fitted parameters.
    pub p_value: f64,
    /// `true` if the distance is within the limit ([`Goodness::kolmogorov_limit`](super::Goodness::kolmogorov_limit)).
    pub fits: bool,
}

/// A law that a link can have.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) fit: LawFit,
    pub(super) law: Law,
    pub(super) asked: Asked,
}

/// Parameters of a law as a link is told them \[s\]. A law that is cut at zero has other moments.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Asked {
    pub(super) mean: f64,
    pub(super) sd: f64,
    pub(super) floor: f64,
}

/// The moments of the sample, and their standard errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) mean_error: f64,
    pub(super) sd: f64,
    pub(super) sd_error: f64,
}

/// A distance of distribution functions that does not matter.
const NEAR: f64 = 0.02;
/// The 0.99 quantile of Kolmogorov's law.
const KOLMOGOROV_99: f64 = 1.627_624;
/// Few independent delays prove nothing against a law, and nothing for it either: no larger distance is passed over than with this many.
const LEAST_EFFECTIVE: f64 = 50.0;
/// A delay that a law excludes counts as one of this probability: such a law is far behind, and still compared.
const EXCLUDED: f64 = 1e-300;

impl Moments {
    /// Of at least two delays that are not all equal, as good as `effective` independent ones.
    pub(super) fn of(delays: &[f64], effective: f64) -> Option<Self> {
        let (mean, sd) = (series::mean(delays)?, series::variance(delays)?.sqrt());
        let kurtosis = delays.iter().map(|delay| ((delay - mean) / sd).powi(4)).sum::<f64>() / count(delays.len());
        let sd_error = sd * ((kurtosis - 1.0).max(0.0) / (4.0 * effective)).sqrt();
        // Half of all at most, so that a deviation stays above zero: few independent delays of which one is far out.
        Some(Self { mean, mean_error: sd / effective.sqrt(), sd, sd_error: sd_error.min(sd / 2.0) })
    }

    /// The place of these moments in units of their errors, moved within one of them.
    fn within(&self, [mean, sd]: [f64; 2]) -> [f64; 2] {
        [self.mean + self.mean_error * mean.clamp(-1.0, 1.0), self.sd + self.sd_error * sd.clamp(-1.0, 1.0)]
    }

    /// Returns whether the law delivers these moments: one that is cut at zero has others than it was asked for. Rounding is granted.
    fn has(&self, law: &Law) -> bool {
        let near = |found: f64, wanted: f64, error: f64| (found - wanted).abs() <= error + 1e-9 * self.sd;
        near(law.mean(), self.mean, self.mean_error) && near(law.sd(), self.sd, self.sd_error)
    }
}

/// The largest distance from the data at which a law fits.
pub(super) fn limit(effective: f64) -> f64 {
    NEAR + KOLMOGOROV_99 / effective.max(LEAST_EFFECTIVE).sqrt()
}

/// The laws that fit and then the others, each in order from the best. `cells` hold delays that are not all equal and none of which is negative.
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

/// Returns whether the floor of a law is a parameter of its own.
const fn begins_at_floor(name: DelayLaw) -> bool {
    matches!(name, DelayLaw::Lognormal | DelayLaw::Gamma | DelayLaw::Weibull)
}

fn law(name: DelayLaw, Asked { mean, sd, floor }: Asked) -> Option<Law> {
    Law::new(&name.into(), mean, sd, Some(floor)).ok()
}

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

fn shape(name: DelayLaw, law: &Law, Asked { mean, sd, floor }: Asked) -> Option<f64> {
    let above = mean - floor;
    let variation = sd / above;
    match name {
        DelayLaw::Normal | DelayLaw::Uniform | DelayLaw::Laplace => None,
        DelayLaw::Lognormal => Some((variation * variation).ln_1p().sqrt()),
        DelayLaw::Gamma => Some(1.0 / (variation * variation)),
        DelayLaw::Weibull => {
            // −ln S grows as the distance from the floor to the power of the shape.
            let hazard = |x: f64| -law.survival(floor + x).ln();
            Some((hazard(above) / hazard(above / 2.0)).log2())
        }
    }
}

fn log_likelihood(law: &Law, Cells { cells, n }: &Cells) -> f64 {
    let mut before = 0.0;
    let logarithm = |cell: &super::cells::Cell| {
        // A difference of the smaller tail keeps its digits.
        let lower_half = before + cell.count / 2.0 < n / 2.0;
        let probability = if lower_half { law.cdf(cell.high) - law.cdf(cell.low) } else { law.survival(cell.low) - law.survival(cell.high) };
        before += cell.count;
        cell.count * probability.max(EXCLUDED).ln()
    };
    cells.iter().map(logarithm).sum()
}

fn kolmogorov(law: &Law, Cells { cells, n }: &Cells) -> f64 {
    let mut before = 0.0;
    let distance = |cell: &super::cells::Cell| {
        let at_low = (law.cdf(cell.low) - before / n).abs();
        before += cell.count;
        at_low.max((law.cdf(cell.high) - before / n).abs())
    };
    cells.iter().map(distance).fold(0.0, f64::max)
}

/// The probability that Kolmogorov's law is above x.
fn farther(x: f64) -> f64 {
    if x < 0.2 {
        // Above 1 − 10⁻¹², where the series needs many terms.
        return 1.0;
    }
    let term = |k: u32| (-2.0 * (f64::from(k) * x).powi(2)).exp();
    // Pairs of terms of opposite signs; beyond 40 terms nothing is left.
    (2.0 * (1..40).step_by(2).map(|k| term(k) - term(k + 1)).sum::<f64>()).clamp(0.0, 1.0)
}

/// The most probable law of that name; `None` if no law of that name has the moments.
fn fit(name: DelayLaw, cells: &Cells, moments: &Moments, effective: f64) -> Option<Asked> {
    if name == DelayLaw::Uniform {
        return uniform(cells, moments, effective);
    }
    let likelihood = |asked: Asked| {
        let law = law(name, asked).filter(|law| moments.has(law));
        law.map_or(f64::NEG_INFINITY, |law| log_likelihood(&law, cells))
    };
    // Sines stay within one error and have no flat part beyond it, on which a simplex would settle.
    if !begins_at_floor(name) {
        let of = |at: [f64; 2]| {
            let [mean, sd] = moments.within(at.map(f64::sin));
            Asked { mean, sd, floor: 0.0 }
        };
        return climb([0.0; 2], [0.5; 2], |at| likelihood(of(at))).map(|(at, _)| of(at));
    }
    // The floor by the logarithm of its distance below the upper end of the least interval, beyond which no floor can lie.
    let top = cells.cells.first()?.high;
    let of = |[mean, sd, log_distance]: [f64; 3]| {
        let [mean, sd] = moments.within([mean.sin(), sd.sin()]);
        Asked { mean, sd, floor: (top - log_distance.exp()).max(0.0) }
    };
    // From a tenth of a cell to a hundred deviations below, where each of these laws is nearly normal: the likelihood may have several tops.
    let nearest = (top - cells.cells.first()?.low) / 10.0;
    let farthest = (100.0 * moments.sd).min(top).max(2.0 * nearest);
    let starts = (0..=STARTS).map(|i| [0.0, 0.0, nearest.ln() + (farthest / nearest).ln() * f64::from(i) / f64::from(STARTS)]);
    let start = starts.map(|at| (at, likelihood(of(at)))).max_by(|one, other| one.1.total_cmp(&other.1))?.0;
    climb(start, [0.5; 3], |at| likelihood(of(at))).map(|(at, _)| of(at))
}

/// Floors that are tried first.
const STARTS: u32 = 24;

fn uniform(cells: &Cells, moments: &Moments, effective: f64) -> Option<Asked> {
    let (first, last) = (cells.cells.first()?, cells.cells.last()?);
    // The part of the law beyond the inner end of the outermost interval.
    let beyond = |cell: &super::cells::Cell| (cell.count / (cells.n + 1.0)).max(1.0 / (effective + 1.0));
    let width = (last.low - first.high) / (1.0 - beyond(first) - beyond(last));
    if !(width.is_finite() && width > 0.0) {
        return None;
    }
    let (low, high) = ((first.high - beyond(first) * width).max(0.0), last.low + beyond(last) * width);
    let place = |value: f64, at: f64, error: f64| if error > 0.0 { (value - at) / error } else { 0.0 };
    let [mean, _] = moments.within([place(f64::midpoint(low, high), moments.mean, moments.mean_error), 0.0]);
    // A mean that had to be moved: the law still reaches over both ends, if its deviation may be that large.
    let half = (mean - low).max(high - mean);
    let [mean, sd] = moments.within([place(mean, moments.mean, moments.mean_error), place(half / 3.0_f64.sqrt(), moments.sd, moments.sd_error)]);
    Some(Asked { mean, sd, floor: 0.0 })
}

#[cfg(test)]
mod tests;
