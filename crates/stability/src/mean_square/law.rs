//! Law of a random link for the second moment: the probability that a sample is lost, and the distribution of the delay of a sample that is not lost.
//!
//! Refused are links whose randomness ties samples together in a way that neither independent arrivals nor a chain of losses describes.

use std::time::Duration;

use cohaptic_wan::law::Law;
use cohaptic_wan::{
    Chance, Checksum, Displacement, Flips, FourState, GilbertElliott, GilbertElliottInTime, Impairments, Layout, LinkConfig, LinkModel, Loss, Order,
};

use super::arrivals::Arrival;

/// Probability of each tail of a law that counts as lying at the end of the remaining part. A law without an end needs infinitely many ticks otherwise.
const TAIL: f64 = 1e-9;

/// Law of the losses and delays of a link's samples.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct LinkLaw {
    /// Chain of losses, if losses depend on each other.
    pub(crate) chain: Option<LossChain>,
    /// Probability that a sample is lost, independently of other samples. Zero if there is a `chain`.
    loss: f64,
    /// Probability that a packet is discarded as corrupted. Original and duplicate are discarded independently.
    discarded: f64,
    /// Probability that a sample is duplicated.
    duplicated: f64,
    /// True for the layout of netem, which loses original and duplicate independently.
    netem: bool,
    /// Constant time added to every delay \[ns\].
    extra: i128,
    /// Mean of the configured delay \[ns\]: every delay without a `law`.
    mean: i128,
    /// Law of the configured delay \[ns\], if the delay has jitter.
    law: Option<Law>,
    /// Probability that a packet is displaced, and the time by which its delay is then longer \[ns\]. `None` as time: the delay is skipped.
    displaced: Option<(f64, Option<i128>)>,
    /// True if the delays of successive packets depend on each other.
    pub(crate) correlated_delays: bool,
    /// True if a sample waits for the samples before.
    pub(crate) in_order: bool,
    /// True if delays are cut at an end of `law`.
    pub(crate) cut: bool,
}

/// Markov chain of losses. The chain gives each sample a state, and the state gives the probability of the sample's loss.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum LossChain {
    GilbertElliott(GilbertElliott),
    InTime(GilbertElliottInTime),
    Correlated(Chance),
    FourState(FourState),
}

impl LossChain {
    /// Returns the states of positive probability. A link begins in the chain's stationary law, so a state with stationary probability zero is never reached.
    /// The position of a state in this list is the number of the state in other functions.
    fn live(&self) -> Vec<usize> {
        let two = |bad: f64| vec![1.0 - bad, bad];
        let stationary = match self {
            // A chain with p = 0 begins and stays in the good state. With r = 0 too, the quotient below would be 0/0.
            Self::GilbertElliott(chain) if chain.p.get() == 0.0 => two(0.0),
            Self::GilbertElliott(chain) => two(chain.p.get() / (chain.p.get() + chain.r.get())),
            Self::InTime(chain) => two(chain.bad_fraction()),
            Self::Correlated(chance) => two(chance.probability().get()),
            Self::FourState(chain) => chain.stationary().to_vec(),
        };
        (0..stationary.len()).filter(|state| stationary[*state] > 0.0).collect()
    }

    /// Returns the number of states of positive probability.
    pub(crate) fn states(&self) -> usize {
        self.live().len()
    }

    /// Returns whether every sample is lost in every state.
    fn loses_all(&self) -> bool {
        (0..self.states()).all(|state| self.lost(state) >= 1.0)
    }

    /// Returns the probability of a loss of a sample in `state`. Of two states the second one is bad.
    pub(crate) fn lost(&self, state: usize) -> f64 {
        let state = self.live()[state];
        match self {
            // The state before a packet's move decides about the packet's loss, and is therefore the state of that packet.
            Self::GilbertElliott(chain) => [1.0 - chain.k.get(), 1.0 - chain.h.get()][state],
            Self::InTime(chain) => [1.0 - chain.k.get(), 1.0 - chain.h.get()][state],
            Self::Correlated(_) => [0.0, 1.0][state],
            // The third and the fourth state lose the packet, within a burst or between bursts.
            Self::FourState(_) => [0.0, 0.0, 1.0, 1.0][state],
        }
    }

    /// Returns the probability of each state of a sample (columns) for each state of the sample before (rows), sent `gap` seconds earlier.
    pub(crate) fn moves(&self, gap: f64) -> Vec<Vec<f64>> {
        let live = self.live();
        live.iter().map(|from| live.iter().map(|to| self.way(*from, *to, gap)).collect()).collect()
    }

    /// Returns the probability of a move between two states of the model, numbered as in the model and not as in [`live`](Self::live).
    fn way(&self, from: usize, to: usize, gap: f64) -> f64 {
        let pick = |to_bad: f64| if to == 1 { to_bad } else { 1.0 - to_bad };
        match self {
            Self::GilbertElliott(chain) => pick([chain.p.get(), 1.0 - chain.r.get()][from]),
            Self::InTime(chain) => {
                let (good, bad) = chain.mean_times();
                let (rate, share) = (1.0 / good.as_secs_f64() + 1.0 / bad.as_secs_f64(), chain.bad_fraction());
                // Forgotten share of the initial state after `gap`: 1 − e^(−rate·gap), without cancellation for a short gap.
                let forgotten = -libm::expm1(-rate * gap);
                pick([share * forgotten, 1.0 - (1.0 - share) * forgotten][from])
            }
            Self::Correlated(chance) => {
                // The next packet repeats the fate of the packet before with probability rho, and is drawn anew otherwise. Rounding may leave [0, 1], hence the
                // clamp.
                let (p, rho) = (chance.probability().get(), chance.correlation());
                pick([p * (1.0 - rho), p + rho * (1.0 - p)][from].clamp(0.0, 1.0))
            }
            Self::FourState(chain) => chain.transitions()[from][to],
        }
    }
}

impl LinkLaw {
    /// Returns the law of a link. `nominal` is the delay of all packets of the same link without randomness.
    ///
    /// # Errors
    ///
    /// A sentence about the part of the link without a law here.
    pub(crate) fn of(model: &LinkModel, nominal: Duration) -> Result<Self, &'static str> {
        let Some(config) = model.as_fixed() else {
            return Err("it is modulated, or a kernel's netem");
        };
        refuse(config)?;
        let (loss, chain) = match &config.loss {
            Loss::None => (0.0, None),
            Loss::Independent(probability) => (probability.get(), None),
            Loss::Correlated(chance) if chance.correlation() == 0.0 => (chance.probability().get(), None),
            Loss::Correlated(chance) => (0.0, Some(LossChain::Correlated(*chance))),
            Loss::GilbertElliott(chain) => (0.0, Some(LossChain::GilbertElliott(*chain))),
            Loss::GilbertElliottInTime(chain) => (0.0, Some(LossChain::InTime(*chain))),
            Loss::FourState(chain) => (0.0, Some(LossChain::FourState(*chain))),
            Loss::Pattern(_) => return Err("its losses are chosen by a pattern and by chance"),
        };
        let discarded = match &config.corruption {
            None => 0.0,
            Some(corruption) => match (corruption.bits, corruption.checksum) {
                (Flips::Bits { packets, count }, Checksum::Discards) if packets.correlation() == 0.0 && corruption.within.is_none() && count > 0 => {
                    packets.probability().get()
                }
                _ => return Err("its packets are corrupted by rate, or are not discarded then"),
            },
        };
        // A copy of netem passes the loss again and would move the chain a second time. The other layouts copy packets after the losses.
        let netem = config.layout == Layout::Netem;
        if config.duplication.correlation() != 0.0 || (netem && chain.is_some() && !config.duplication.is_never()) {
            return Err("its duplicates depend on each other");
        }
        let displaced = match &config.reorder {
            None => None,
            Some(reorder) if reorder.packets.correlation() != 0.0 => return Err("its reordered packets depend on each other"),
            Some(reorder) => match reorder.how {
                Displacement::Jump { gap } if gap.get() == 1 => Some((reorder.packets.probability().get(), None)),
                Displacement::Later { by } => Some((reorder.packets.probability().get(), Some(nanos(by)))),
                Displacement::Jump { .. } => return Err("its packets jump only now and then"),
                Displacement::Behind { .. } => return Err("its packets are held until others have passed"),
            },
        };
        let law = config.delay.law().cloned();
        let correlated = config.delay.jitter().is_some_and(|jitter| jitter.correlation != cohaptic_wan::Correlation::None);
        // A law with values so far from the mean has a tail, and TAIL cuts a part of the tail.
        let cut = law.as_ref().is_some_and(|law| law.survival(law.mean() + 100.0 * law.sd()) > 0.0 || law.cdf(law.mean() - 7.0 * law.sd()) > 0.0);
        Ok(Self {
            chain,
            loss,
            discarded,
            duplicated: config.duplication.probability().get(),
            netem,
            extra: nanos(nominal) - nanos(config.delay.mean()),
            mean: nanos(config.delay.mean()),
            law,
            displaced,
            correlated_delays: correlated,
            in_order: config.order == Order::InOrder,
            cut,
        })
    }

    /// Returns whether no sample ever arrives.
    pub(crate) fn is_silent(&self) -> bool {
        self.within(i128::MAX) <= 0.0 || self.chain.is_some_and(|chain| chain.loses_all())
    }

    /// Returns the probability of a configured delay of at most `nanos` nanoseconds.
    fn delay(&self, nanos: i128) -> f64 {
        let Some(law) = &self.law else {
            return if nanos >= self.mean { 1.0 } else { 0.0 };
        };
        if nanos < 0 {
            return 0.0;
        }
        // The link rounds delays to nanoseconds, so every delay below `nanos + 0.5` counts.
        let at = real(nanos) + 0.5;
        let (below, above) = (law.cdf(at), law.survival(at));
        if above < TAIL {
            1.0
        } else if below < TAIL {
            0.0
        } else {
            below
        }
    }
}

impl Arrival for LinkLaw {
    fn within(&self, nanos: i128) -> f64 {
        // The nominal delay is the mean of the law plus parts without chance, such as a queue. Only the rest of the time is the law's.
        let nanos = nanos.saturating_sub(self.extra);
        if nanos < 0 {
            return 0.0;
        }
        let way = match self.displaced {
            None => self.delay(nanos),
            // A jumping packet takes no configured delay: with probability p it arrives at once.
            Some((p, None)) => p + (1.0 - p) * self.delay(nanos),
            Some((p, Some(by))) => p * self.delay(nanos.saturating_sub(by)) + (1.0 - p) * self.delay(nanos),
        };
        let one = (1.0 - self.discarded) * way;
        // The earlier of two independent arrivals is in time with probability 1 − (1 − one)² = one·(2 − one).
        let copied = |one: f64| (1.0 - self.duplicated) * one + self.duplicated * one * (2.0 - one);
        // netem loses original and duplicate independently. In the other layouts a lost packet has no duplicate.
        if self.netem { copied((1.0 - self.loss) * one) } else { (1.0 - self.loss) * copied(one) }
    }

    fn least(&self) -> i128 {
        let delay = match (&self.law, self.displaced) {
            (_, Some((_, None))) => 0,
            (None, _) => self.mean,
            // One nanosecond less than the quantile, for the rounding of delays to whole nanoseconds.
            (Some(law), _) => whole(law.quantile(TAIL * 0.5)) - 1,
        };
        self.extra + delay.max(0)
    }
}

/// Refuses a configuration with a part without a description in [`LinkLaw`].
fn refuse(config: &LinkConfig) -> Result<(), &'static str> {
    let queues = config.bottleneck.is_some() || config.token_bucket.is_some() || config.limit.is_some();
    let spread = config.delay.jitter().is_some() || config.reorder.is_some() || !config.duplication.is_never();
    if config.outages.random().is_some() {
        return Err("it fails at random");
    }
    if config.slots.is_some() || config.trace.is_some() {
        return Err("it has slots or a recorded path");
    }
    if config.cross_traffic.is_some() {
        return Err("it has cross-traffic");
    }
    if config.listed != Impairments::default() {
        return Err("it has an impairment without a law here");
    }
    if queues && spread {
        return Err("it has a queue together with jitter, reordering or duplicates");
    }
    if config.marks_instead_of_loss {
        return Err("it marks packets instead of losing them");
    }
    Ok(())
}

/// Returns whether losses or delays of a link are random.
pub(crate) fn is_random(model: &LinkModel) -> bool {
    match model {
        LinkModel::Fixed(config) => {
            // A loss of probability zero, or by a pattern, is not random.
            let certain = config.loss == Loss::None || config.loss.mean() == Some(0.0) || matches!(config.loss, Loss::Pattern(_));
            let LinkConfig { loss, .. } = LinkConfig::default();
            let rest = LinkConfig { loss, ..config.clone() };
            !certain || rest.has_chance()
        }
        LinkModel::Replay(_) => false,
        LinkModel::Modulated(_) | LinkModel::Kernel(_) => true,
    }
}

fn nanos(span: Duration) -> i128 {
    i128::try_from(span.as_nanos()).unwrap_or(i128::MAX)
}

#[expect(clippy::cast_precision_loss, reason = "a span enters a law as a real number")]
fn real(nanos: i128) -> f64 {
    nanos as f64
}

#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn whole(nanos: f64) -> i128 {
    libm::floor(nanos) as i128
}
