//! Figures asked of a link: means, quantiles and shares that follow from the configuration of the link.

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_units::Bytes;
use cohaptic_wan::{Correlation, Flips, Layout, LinkConfig, LinkModel, Modulated, Order, Service};
use serde::Serialize;

use crate::series::count_u64;

/// Figures asked of a link for a packet of a steady stream. A figure without a law is `None` or empty.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Asked {
    /// Mean of the propagation delay \[s\], also of a law cut at zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_s: Option<f64>,
    /// Standard deviation of the propagation delay \[s\]; zero for a constant delay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_s: Option<f64>,
    /// Least propagation delay \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_s: Option<f64>,
    /// Quantiles of the propagation delay \[s\], by probability.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub quantiles_s: BTreeMap<&'static str, f64>,
    /// Autocorrelation of the delays at lags of 1 to 10 packets, without losses. Empty for a constant delay.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub autocorrelation: Vec<f64>,
    /// Share of packets lost by the loss model in the long run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<f64>,
    /// Mean number of packets lost in a row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss_run_mean: Option<f64>,
    /// Autocorrelation of losses at lags of 1 to 10 packets. Empty for a model without a simple law.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loss_autocorrelation: Vec<f64>,
    /// Share of packets with a copy made by the link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duplicated: Option<f64>,
    /// Share of packets with bits flipped by the link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damaged: Option<f64>,
    /// Rate of the bottleneck \[bit/s\], framing included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_bit_s: Option<f64>,
    /// Stages of the link, as far as a comparison must know them.
    #[serde(skip)]
    pub(crate) stages: Stages,
}

/// Properties of a link needed to attribute a packet's fate to a stage.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Stages {
    /// Delay of the link; `None` if a packet's delay depends on more than the delay's law.
    pub(crate) delay: Option<cohaptic_wan::Delay>,
    /// `true` if the loss model marks packets instead of dropping packets.
    pub(crate) marks: bool,
    /// `true` if copies are made before losses.
    pub(crate) copies_first: bool,
}

/// Names and probabilities of the quantiles in [`Asked`].
pub(crate) const QUANTILES: [(&str, f64); 7] =
    [("0.01", 0.01), ("0.05", 0.05), ("0.25", 0.25), ("0.5", 0.5), ("0.75", 0.75), ("0.95", 0.95), ("0.99", 0.99)];
const LAGS: u32 = 10;

impl Asked {
    /// Returns the figures asked of a link for packets of `size`, sent `every` so often. A link that follows a modulator has the means over time of its
    /// states, and no other figures. A replay and the kernel's netem have no laws here, and the result is empty.
    #[must_use]
    pub fn of(model: &LinkModel, every: Duration, size: Bytes) -> Self {
        match model {
            LinkModel::Fixed(config) => Self::of_config(config, every, size),
            LinkModel::Modulated(modulated) => Self::of_modulated(modulated, every, size),
            LinkModel::Replay(_) | LinkModel::Kernel(_) => Self::default(),
        }
    }

    /// Returns the means over the time in each state. A steady stream meets a state as often as the state has of the time, so that shares of time are shares of
    /// packets. The least delay is the least of all states.
    fn of_modulated(modulated: &Modulated, every: Duration, size: Bytes) -> Self {
        let Some(shares) = modulated.modulator().shares() else { return Self::default() };
        let states: Vec<Self> = modulated.configs().iter().map(|config| Self::of_config(config, every, size)).collect();
        let mean = |of: fn(&Self) -> Option<f64>| {
            let terms = states.iter().zip(&shares).map(|(state, share)| of(state).map(|value| share * value));
            terms.collect::<Option<Vec<f64>>>().map(|terms| terms.iter().sum::<f64>())
        };
        let mean_s = mean(|state| state.mean_s);
        // The variance of a mixture is the mean of the second moments minus the square of the mean.
        let second = mean(|state| Some(state.sd_s?.powi(2) + state.mean_s?.powi(2)));
        Self {
            mean_s,
            sd_s: second.zip(mean_s).map(|(second, mean)| libm::sqrt((second - mean * mean).max(0.0))),
            least_s: states.iter().map(|state| state.least_s).collect::<Option<Vec<f64>>>().and_then(|least| least.into_iter().reduce(f64::min)),
            loss: mean(|state| state.loss),
            duplicated: mean(|state| state.duplicated),
            damaged: mean(|state| state.damaged),
            rate_bit_s: mean(|state| state.rate_bit_s),
            ..Self::default()
        }
    }

    /// Returns the figures asked of a single configuration, as [`of`](Self::of) does.
    #[must_use]
    pub fn of_config(config: &LinkConfig, every: Duration, size: Bytes) -> Self {
        let law = config.delay.law();
        let seconds = |nanos: f64| nanos / 1e9;
        let traced = config.trace.is_some();
        let listed = config.listed.extra_delay();
        let varied = config.delay.jitter().is_some();
        // Any further stage would add a wait of its own to the delay of the law.
        let alone = config.token_bucket.is_none()
            && config.bottleneck.is_none()
            && config.slots.is_none()
            && config.reorder.is_none()
            && !traced
            && listed.is_none();
        // Waiting for the order changes delays only if delays vary.
        let in_order = config.order == Order::InOrder && varied;
        let damaged = config.corruption.as_ref().map(|corruption| match corruption.bits {
            Flips::Bits { packets, .. } => packets.probability().get(),
            Flips::Rate(rate) => {
                let end = corruption.within.as_ref().map_or_else(|| size.get(), |within| size.get().min(within.end));
                let begin = corruption.within.as_ref().map_or(0, |within| within.start);
                // 1 − (1 − rate)^bits, in a form without cancellation for small rates.
                -libm::expm1(8.0 * count_u64(end.saturating_sub(begin)) * libm::log1p(-rate.get()))
            }
        });
        Self {
            mean_s: (!traced).then(|| {
                let mean = law.map_or_else(|| config.delay.mean().as_secs_f64(), |law| seconds(law.mean()));
                listed.map_or(mean, |listed| mean + listed.mean)
            }),
            sd_s: (!traced).then(|| {
                let sd = law.map_or(0.0, |law| seconds(law.sd()));
                listed.map_or(sd, |listed| libm::sqrt(sd * sd + listed.variance))
            }),
            least_s: (!traced).then(|| config.delay.least().as_secs_f64()),
            // The quantiles and the autocorrelation of a sum of delays do not follow from those of the parts.
            quantiles_s: law
                .filter(|_| listed.is_none())
                .map(|law| QUANTILES.into_iter().map(|(name, p)| (name, seconds(law.quantile(p)))).collect())
                .unwrap_or_default(),
            autocorrelation: if listed.is_none() { autocorrelation(config, every) } else { Vec::new() },
            loss: config.loss.mean().filter(|_| !traced),
            loss_run_mean: config.loss.mean_run().filter(|_| !traced),
            loss_autocorrelation: (1..=LAGS).filter(|_| !traced).map_while(|lag| config.loss.autocorrelation(lag)).collect(),
            duplicated: (!config.duplication.is_never()).then(|| config.duplication.probability().get()),
            damaged,
            rate_bit_s: config.bottleneck.as_ref().and_then(|bottleneck| match &bottleneck.service {
                Service::Rate(rate) => Some(count_u64(rate.as_bits_per_sec())),
                Service::Recorded(_) => None,
            }),
            stages: Stages {
                delay: (alone && !in_order).then(|| config.delay.clone()),
                marks: config.marks_instead_of_loss,
                copies_first: config.layout == Layout::Netem,
            },
        }
    }
}

fn autocorrelation(config: &LinkConfig, every: Duration) -> Vec<f64> {
    let (Some(law), Some(jitter)) = (config.delay.law(), config.delay.jitter()) else { return Vec::new() };
    let in_time = |time: Duration| libm::exp(-every.as_secs_f64() / time.as_secs_f64());
    // Correlation of the normal numbers of two packets in a row, without the share that differs from packet to packet, and the other share.
    let (phi, share) = match jitter.correlation {
        Correlation::None => (0.0, 1.0),
        Correlation::PerPacket(rho) => (law.gaussian_correlation(rho).unwrap_or(0.0), 1.0),
        Correlation::InTime(time) => (in_time(time), 1.0),
        Correlation::PartlyInTime { time, share } => (in_time(time), share),
    };
    if phi == 0.0 {
        return (1..=LAGS).map(|_| 0.0).collect();
    }
    (1..=LAGS).map(|lag| law.correlation(share * libm::pow(phi, f64::from(lag)))).collect()
}

#[cfg(test)]
mod tests {
    use cohaptic_units::Probability;
    use cohaptic_wan::netem::Netem;
    use cohaptic_wan::{Checksum, Corruption, Modulator, ModulatorState, Sojourn};

    use super::*;

    fn asked(words: &str) -> Asked {
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        Asked::of_config(&config, Duration::from_millis(1), Bytes::new(64))
    }

    /// With p = 1 % and r = 25 %, runs have a mean of 4, and the chain forgets by the factor 1 − p − r per packet. DAR(1) with ρ = 0.5 at 5 % has runs of
    /// 1/(0.5·0.95).
    #[test]
    fn runs_of_losses_follow_from_the_chain() {
        let chain = asked("loss gemodel 1% 25%");
        assert_eq!(chain.loss_run_mean, Some(4.0));
        assert!((chain.loss_autocorrelation[1] - 0.74_f64.powi(2)).abs() < 1e-12);
        let correlated = asked("loss 5% 50%");
        assert!((correlated.loss_run_mean.unwrap() - 1.0 / (0.5 * 0.95)).abs() < 1e-12);
        assert!(asked("delay 5ms").loss_autocorrelation.is_empty());
    }

    #[test]
    fn figures_follow_from_the_laws() {
        let asked = asked("delay 40ms 4ms 50% distribution normal loss gemodel 1% 9% duplicate 2% corrupt 3%");
        assert_eq!((asked.mean_s, asked.sd_s), (Some(0.04), Some(0.004)));
        // The autocorrelation of a normal law is ρⁿ, and the quantile 0.95 lies 1.6449 deviations above the mean.
        assert!(asked.autocorrelation.iter().zip(1..).all(|(found, lag)| (found - 0.5_f64.powi(lag)).abs() < 1e-12));
        assert!((asked.quantiles_s["0.95"] - (0.04 + 1.644_853_626_951_472_7 * 0.004)).abs() < 1e-12);
        assert!((asked.loss.unwrap() - 0.1).abs() < 1e-12);
        assert_eq!((asked.duplicated, asked.damaged, asked.rate_bit_s), (Some(0.02), Some(0.03), None));
    }

    #[test]
    fn a_rate_of_flipped_bits_damages_large_packets_more() {
        let corruption = Corruption { bits: Flips::Rate(Probability::new(0.001).unwrap()), within: Some(4..200), checksum: Checksum::Passes };
        let config = LinkConfig { corruption: Some(corruption), ..LinkConfig::default() };
        let asked = Asked::of_config(&config, Duration::from_millis(1), Bytes::new(64));
        assert!((asked.damaged.unwrap() - (1.0 - 0.999_f64.powi(480))).abs() < 1e-12);
        assert_eq!((asked.mean_s, asked.sd_s, asked.loss), (Some(0.0), Some(0.0), Some(0.0)));
    }

    /// Three seconds of four without loss at 10 ms, one with 10 % loss at 30 ms: the mean is 15 ms, the variance 0.75·5² + 0.25·15² ms².
    #[test]
    fn figures_of_a_modulated_link_are_means_over_time() {
        let state =
            |seconds: u64, next: [f64; 2]| ModulatorState { sojourn: Some(Sojourn::Fixed(Duration::from_secs(seconds))), next: next.to_vec() };
        let modulator = Modulator::new("cell", vec![state(3, [0.0, 1.0]), state(1, [1.0, 0.0])]).unwrap();
        let config = |words: &str| Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        let modulated = Modulated::new(modulator, vec![config("delay 10ms"), config("delay 30ms loss 10%")]).unwrap();
        let asked = Asked::of(&modulated.into(), Duration::from_millis(1), Bytes::new(64));
        let figures = [(asked.mean_s, 0.015), (asked.sd_s, 75e-6_f64.sqrt()), (asked.least_s, 0.01), (asked.loss, 0.025)];
        assert!(figures.iter().all(|(found, expected)| (found.unwrap() - expected).abs() < 1e-12), "{figures:?}");
        assert_eq!((asked.rate_bit_s, asked.quantiles_s.len()), (None, 0));
    }

    #[test]
    fn of_what_has_no_law_nothing_is_said() {
        let replay = LinkModel::Replay(std::sync::Arc::default());
        assert_eq!(Asked::of(&replay, Duration::from_millis(1), Bytes::new(64)), Asked::default());
        assert_eq!(serde_json::to_string(&Asked::default()).unwrap(), "{}");
    }
}
