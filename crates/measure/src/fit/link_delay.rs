//! The delay of the estimated link: a fitting law, or the measured delays themselves.

use std::sync::Arc;

use cohaptic_wan::Distribution;
use cohaptic_wan::law::{Empirical, Law};

use super::distribution::Candidate;
use super::link::FittedLaw;

/// Keys `delay` and `jitter` of a link, without correlation.
pub(super) struct LinkDelay {
    /// Mean \[s\]. The standard deviation \[s\] and the least delay \[s\] follow; the least delay is `None` for zero or for a law without a floor.
    pub(super) mean_s: f64,
    pub(super) sd_s: f64,
    pub(super) floor_s: Option<f64>,
    pub(super) distribution: FittedLaw,
    /// Law of these keys; `None` for a deviation of less than a nanosecond.
    pub(super) law: Option<Law>,
    /// Measured delays; `None` if a law fits.
    pub(super) delays: Option<Arc<Empirical>>,
}

impl LinkDelay {
    /// Uses the best fitting law.
    pub(super) fn of_law(best: &Candidate) -> Self {
        Self {
            mean_s: best.asked.mean,
            sd_s: best.asked.sd,
            floor_s: Some(best.asked.floor).filter(|&floor| floor > 0.0),
            distribution: FittedLaw::Law(best.fit.distribution),
            law: Some(best.law.clone()),
            delays: None,
        }
    }

    /// Uses the delays themselves, or equally spaced quantiles of more delays than a link can hold.
    pub(super) fn of_delays(sorted: &[f64]) -> Self {
        let all = sorted.len();
        let kept = all.min(Empirical::MOST);
        let delays = Empirical::new((0..kept).map(|place| sorted[place * (all - 1) / (kept - 1)]).collect());
        let delays = Arc::new(delays.expect("at least 50 finite delays, of which the ends differ"));
        // A scene has whole nanoseconds. The mean is rounded up and the deviation down, because a least delay below zero would be refused by the link.
        let [mean_s, sd_s] = [(delays.mean() * 1e9).ceil() / 1e9, (delays.sd() * 1e9).floor() / 1e9];
        let law = Law::new(&Distribution::Empirical(Arc::clone(&delays)), mean_s, sd_s, None).ok();
        Self { mean_s, sd_s, floor_s: None, distribution: FittedLaw::Empirical, law, delays: Some(delays) }
    }
}
