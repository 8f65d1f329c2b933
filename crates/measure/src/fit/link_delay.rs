//! The delays of a link as it is told them: a law that fits, or the delays themselves.

use std::sync::Arc;

use cohaptic_wan::law::{Distribution, Empirical, Law};

use super::distribution::Candidate;
use super::link::FittedLaw;

/// The keys `delay` and `jitter` of a link, without correlation.
pub(super) struct LinkDelay {
    /// The mean \[s\]; further \[s\] the deviation and the least delay, where a law begins at one above zero.
    pub(super) mean_s: f64,
    pub(super) sd_s: f64,
    pub(super) floor_s: Option<f64>,
    pub(super) distribution: FittedLaw,
    /// The law of these keys; `None` of a deviation that is zero in nanoseconds.
    pub(super) law: Option<Law>,
    /// The measured delays, where they are the law.
    pub(super) delays: Option<Arc<Empirical>>,
}

impl LinkDelay {
    /// The law that fits best.
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

    /// The law of the delays themselves, or of quantiles at equal steps if they are more than a link takes.
    pub(super) fn of_delays(sorted: &[f64]) -> Self {
        let all = sorted.len();
        let kept = all.min(Empirical::MOST);
        let delays = Empirical::new((0..kept).map(|place| sorted[place * (all - 1) / (kept - 1)]).collect());
        let delays = Arc::new(delays.expect("at least 50 finite delays, of which the ends differ"));
        // Whole nanoseconds, which a scene has. Later and narrower by less than one, so that the least delay does not fall below zero, where a link refuses it.
        let [mean_s, sd_s] = [(delays.mean() * 1e9).ceil() / 1e9, (delays.sd() * 1e9).floor() / 1e9];
        let law = Law::new(&Distribution::Empirical(Arc::clone(&delays)), mean_s, sd_s, None).ok();
        Self { mean_s, sd_s, floor_s: None, distribution: FittedLaw::Empirical, law, delays: Some(delays) }
    }
}
