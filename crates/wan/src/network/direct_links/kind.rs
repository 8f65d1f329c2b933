//! Data shared by links of one configuration, and the state of each link.

use cohaptic_units::{Instant, Probability};

use super::chains::{Chains, is_below, threshold};
use super::losses::{InTime, Losses, Verdict};
use crate::laws::delay::Law;
use crate::line::direct::Words;
use crate::random::{PacketDraws, Purpose, Stream};
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::delay::{CorrelatedDelays, DelayStage};
use crate::stages::loss::{GilbertElliottState, Loss};
use crate::stages::order::Order;
use crate::stages::queue::{EqualPackets, Load, nanos};

/// A kind of link: a configuration shared by links, prepared for packets of one load.
#[derive(Clone, Debug)]
pub(super) struct Kind {
    /// `true` if the links draw random numbers.
    pub(super) is_random: bool,
    /// `true` if no packet arrives before an earlier packet. The latest arrival stands with the counters of each link.
    pub(super) keeps_order: bool,
    pub(super) loss: Losses,
    delay: Delays,
    pub(super) line: Line,
    /// Computation for eight links at once; `None` without correlated delays, with a rate, or where [`Chains::new`] returns `None`.
    pub(super) chains: Option<Chains>,
    /// `true` if links of this kind have state.
    pub(super) remembers: bool,
    /// `true` if the chain of delays is the only state of links of this kind.
    pub(super) has_only_delays: bool,
    /// Threshold for a loss without state: the packet is lost if the upper 53 bits of its loss word are below the threshold.
    loses_below: u64,
}

/// The transmitter of a link and its queue, for packets of one size.
#[derive(Clone, Copy, Debug)]
pub(super) enum Line {
    /// No packet waits. Each packet takes this time to transmit \[ns\]; 0 without a rate.
    Free(u64),
    /// A queue with tail drop, for packets of one size.
    Queued(EqualPackets),
}

#[derive(Clone, Debug)]
enum Delays {
    Independent(DelayStage),
    Correlated(CorrelatedDelays),
}

/// Chain of delays of a link.
#[derive(Debug)]
pub(super) struct Chain<'a> {
    /// Latest value, NaN before the first packet.
    pub(super) latest: &'a mut f64,
    /// Instant of the latest value.
    pub(super) at: &'a mut Instant,
    /// Next value. Without meaning if the packet's delay is drawn alone.
    pub(super) next: f64,
}

/// State of a link from earlier packets, and a counter for few links.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remembered {
    /// Instant at which the previous packet leaves the queue.
    departure: Instant,
    /// Latest value of the chain of delays, NaN before the first packet.
    normal: f64,
    /// Instant of the latest value or state of the chain that depends on time; the end of time before the first packet.
    at: Instant,
    pub(super) state: GilbertElliottState,
    /// Packets without room in the queue.
    pub(super) found_full: u64,
}

impl Kind {
    /// Makes the kind of links of this configuration, for packets of this load. Returns `None` if [`Remembered`] has too little state for the links.
    pub(super) fn new(config: &LinkConfig, load: Load) -> Option<Self> {
        let loss = match &config.loss {
            Loss::None => Losses::None,
            Loss::Independent(probability) => Losses::Independent(*probability),
            Loss::GilbertElliott(chain) => Losses::GilbertElliott(*chain),
            Loss::GilbertElliottInTime(chain) => Losses::InTime(InTime::new(*chain)),
            Loss::Correlated(_) | Loss::FourState(_) | Loss::Pattern(_) => return None,
        };
        let delay = match CorrelatedDelays::new(&config.delay) {
            Some(correlated) => Delays::Correlated(correlated),
            None => Delays::Independent(DelayStage::new(&config.delay)),
        };
        // `Remembered` has no state for outages, and a single instant, which a chain of losses in time and a chain of delays cannot share.
        if !config.outages.is_empty() || matches!((&loss, &delay), (Losses::InTime(_), Delays::Correlated(_))) {
            return None;
        }
        let line = Line::new(config, load)?;
        let keeps_order = config.order == Order::InOrder;
        // `Chains` adds the delay to the instant of the offer, so the transmitter must take no time, and no packet may wait for another one.
        let chains = match (&delay, line) {
            (Delays::Correlated(delays), Line::Free(0)) if !keeps_order => Chains::new(&loss, delays),
            (Delays::Correlated(_) | Delays::Independent(_), _) => None,
        };
        let remembers = matches!(line, Line::Queued(_))
            || matches!(loss, Losses::GilbertElliott(_) | Losses::InTime(_))
            || matches!(delay, Delays::Correlated(_));
        let loses_alone = matches!(loss, Losses::None | Losses::Independent(_));
        let has_only_delays = matches!((&delay, line), (Delays::Correlated(_), Line::Free(_))) && loses_alone;
        let loses_below = threshold(if let Losses::Independent(probability) = loss { probability } else { Probability::ZERO });
        Some(Self { is_random: config.is_random(), keeps_order, loss, delay, line, chains, remembers, has_only_delays, loses_below })
    }

    /// Returns whether links that take turns between this kind and others need no more state than [`Remembered`]: a chain of delays, or a chain of losses
    /// from packet to packet, would have to begin anew with each turn.
    pub(super) const fn takes_turns(&self) -> bool {
        matches!(self.delay, Delays::Independent(_)) && !matches!(self.loss, Losses::GilbertElliott(_))
    }

    /// Begins a turn of this kind at an instant, after a turn of `before`. A chain of losses in time goes on if `before` is such
    /// a chain, too.
    pub(super) fn begin_turn(&mut self, at: Instant, before: &Losses) {
        if let Losses::InTime(chain) = &mut self.loss {
            chain.since = if let Losses::InTime(before) = before { before.since } else { at };
        }
    }

    /// Returns the state of a link before its first packet.
    pub(super) fn beginning(&self, draws: Stream) -> Remembered {
        Remembered { state: self.initial_state(draws), ..Remembered::NOTHING }
    }

    /// Returns the state of the chain of losses before the first packet: drawn from the stationary distribution.
    pub(super) fn initial_state(&self, draws: Stream) -> GilbertElliottState {
        match &self.loss {
            Losses::GilbertElliott(chain) => chain.stationary_state(draws.packet(0).first(Purpose::InitialState)),
            // A chain in time draws its first state with the first packet.
            Losses::None | Losses::Independent(_) | Losses::InTime(_) => GilbertElliottState::Good,
        }
    }

    /// Returns the instant at which a packet leaves the transmitter of a link without state.
    #[inline(always)]
    pub(super) fn leaves(&self, now: Instant) -> Instant {
        // With a queue, a link has the departure of the packet before as its state.
        if let Line::Free(nanos) = self.line { now.saturating_add_nanos(nanos) } else { now }
    }

    /// Computes the fate of a packet that leaves the transmitter at `leaves`, of a link without state, or with a chain of delays as its only state, which is
    /// changed. `at` is the arrival \[ns\], or [`Law::UNKNOWN`] to draw the delay.
    #[inline(always)]
    pub(super) fn fate(&mut self, leaves: Instant, chain: Option<Chain<'_>>, words: Words, packet: impl Fn() -> PacketDraws, at: u64) -> Verdict {
        if is_below(words[0], self.loses_below) {
            return Verdict::Lost;
        }
        if at == Law::UNKNOWN {
            let (mut latest, mut since) = (f64::NAN, Instant::MAX);
            let chain = chain.map_or((&mut latest, &mut since), |chain| (chain.latest, chain.at));
            return Verdict::Arrives(self.arrival(leaves, chain, words, packet()));
        }
        if let Some(chain) = chain {
            (*chain.latest, *chain.at) = (chain.next, leaves);
        }
        Verdict::Arrives(Instant::from_nanos(at))
    }

    /// Returns the delays of a packet of each of several links \[ns\], or [`Law::UNKNOWN`] where [`Kind::fate`] or [`Kind::verdict`] must draw the delay.
    #[inline(always)]
    fn delays<const N: usize>(&self, words: &[Words; N]) -> [u64; N] {
        let Delays::Independent(delay) = &self.delay else { return [Law::UNKNOWN; N] };
        let mut of_jitter = [0; N];
        for (of_jitter, [_, word]) in of_jitter.iter_mut().zip(words) {
            *of_jitter = *word;
        }
        delay.nanos_at_once(&of_jitter)
    }

    /// Computes the fate of a packet of a link with the state `link`, and changes the state. `delay` is the packet's delay \[ns\] with the value of the chain
    /// of delays, or [`Law::UNKNOWN`] to draw both.
    #[inline(always)]
    pub(super) fn verdict(
        &mut self,
        now: Instant,
        link: &mut Remembered,
        words: Words,
        packet: impl Fn() -> PacketDraws,
        (value, delay): (f64, u64),
    ) -> Verdict {
        if self.loses(now, link, words, &packet) {
            return Verdict::Lost;
        }
        // Lost packets take no time to transmit, because losses come before the queue.
        let leaves = match &self.line {
            Line::Free(nanos) => now.saturating_add_nanos(*nanos),
            Line::Queued(queue) => match queue.offer(now, &mut link.departure) {
                Some(leaves) => leaves,
                None => {
                    link.found_full += 1;
                    return Verdict::Dropped;
                }
            },
        };
        if delay == Law::UNKNOWN {
            return Verdict::Arrives(self.arrival(leaves, link.chain(), words, packet()));
        }
        // A link without a chain of delays may have its instant for a chain of losses.
        if let Delays::Correlated(_) = self.delay {
            (link.normal, link.at) = (value, leaves);
        }
        Verdict::Arrives(leaves.saturating_add_nanos(delay))
    }

    /// Returns whether a packet of a link with the state `link` is lost, and changes the state.
    #[inline(always)]
    pub(super) fn loses(&mut self, now: Instant, link: &mut Remembered, [word, _]: Words, packet: impl Fn() -> PacketDraws) -> bool {
        match &mut self.loss {
            Losses::None => false,
            Losses::Independent(probability) => probability.happens(word),
            Losses::GilbertElliott(chain) => chain.loses(&mut link.state, word, || packet().more(Purpose::Loss).next_word()),
            Losses::InTime(chain) => link.loses_in_time(now, chain, word, packet()),
        }
    }

    /// Returns the latest values of the chains of delays of links with these states, whose packets are offered `now`. A value is NaN where the next value must
    /// be computed by [`Kind::verdict`].
    #[inline(always)]
    pub(super) fn values_of_states<const N: usize>(&self, now: Instant, links: &[Remembered; N]) -> [f64; N] {
        // The delays of chains begin together only where no packet waits.
        if !matches!(self.line, Line::Free(_)) {
            return [f64::NAN; N];
        }
        let (mut latest, mut at) = ([f64::NAN; N], [Instant::MAX; N]);
        for (link, (latest, at)) in links.iter().zip(latest.iter_mut().zip(&mut at)) {
            (*latest, *at) = (link.normal, link.at);
        }
        self.values_of_chains(now, &latest, &at)
    }

    /// Returns the values of [`Kind::values_of_states`] for links with these latest values, of the instants `at`.
    #[inline(always)]
    pub(super) fn values_of_chains<const N: usize>(&self, now: Instant, latest: &[f64; N], at: &[Instant; N]) -> [f64; N] {
        let Delays::Correlated(delays) = &self.delay else { return [f64::NAN; N] };
        let Some(since) = delays.since(self.leaves(now)) else { return *latest };
        let mut values = [0.0; N];
        for (value, (latest, at)) in values.iter_mut().zip(latest.iter().zip(at)) {
            // A NaN has all bits set here. Of a choice between two numbers the compiler made a branch.
            let has_other_weights = u64::from(*at != since);
            *value = f64::from_bits(latest.to_bits() | has_other_weights.wrapping_neg());
        }
        values
    }

    /// Returns the delays of [`Kind::delays`] for links with these values of the chains of delays, and the next values.
    #[inline(always)]
    pub(super) fn delays_of_chains<const N: usize>(&self, chains: &[f64; N], words: &[Words; N]) -> ([f64; N], [u64; N]) {
        let Delays::Correlated(delays) = &self.delay else { return (*chains, self.delays(words)) };
        let mut of_jitter = [0; N];
        for (of_jitter, [_, word]) in of_jitter.iter_mut().zip(words) {
            *of_jitter = *word;
        }
        delays.nanos_at_once(chains, &of_jitter)
    }

    /// Returns the arrival of a packet that leaves the transmitter at `leaves`, without the order of packets. `chain` is the latest value of the link's chain of
    /// delays and the instant of the value, and both are replaced if there is a chain. Not inlined, because most delays are drawn for
    /// several links together.
    #[inline(never)]
    pub(super) fn arrival(&mut self, leaves: Instant, chain: (&mut f64, &mut Instant), [_, word]: Words, packet: PacketDraws) -> Instant {
        leaves.saturating_add_nanos(match &mut self.delay {
            Delays::Independent(delay) => delay.draw_nanos(leaves, word, || packet),
            Delays::Correlated(delays) => delays.draw_nanos(leaves, chain, word, packet),
        })
    }
}

impl Remembered {
    /// The state of a link without state.
    pub(super) const NOTHING: Self =
        Self { departure: Instant::ZERO, normal: f64::NAN, at: Instant::MAX, state: GilbertElliottState::Good, found_full: 0 };

    /// Returns the latest value of the chain of delays and its instant.
    #[inline]
    pub(super) const fn chain(&mut self) -> (&mut f64, &mut Instant) {
        (&mut self.normal, &mut self.at)
    }

    /// Returns whether a packet is lost by a chain in time, and moves the chain. Not inlined, because few links have such a chain.
    #[inline(never)]
    fn loses_in_time(&mut self, now: Instant, chain: &mut InTime, word: u64, packet: PacketDraws) -> bool {
        let is_known = self.at != Instant::MAX && self.at >= chain.since;
        let bad = if is_known {
            chain.bad_after(now.saturating_duration_since(self.at), self.state == GilbertElliottState::Bad)
        } else {
            chain.chain.bad_at_first()
        };
        let bad = bad.happens(word);
        (self.state, self.at) = (if bad { GilbertElliottState::Bad } else { GilbertElliottState::Good }, now);
        chain.chain.loses_in(bad, || packet.more(Purpose::Loss).next_word())
    }
}

impl Line {
    /// Makes the transmitter of a link for packets of this load. Returns `None` if departures depend on more than the state of [`EqualPackets`], or if the
    /// transmitter comes after the delay (the layout of netem).
    pub(super) fn new(config: &LinkConfig, load: Load) -> Option<Self> {
        let Some(bottleneck) = &config.bottleneck else { return Some(Self::Free(0)) };
        if config.layout == Layout::Netem {
            return None;
        }
        // With a long enough gap between packets no packet ever waits, so the queue becomes a constant time.
        match bottleneck.time_without_wait(load) {
            Some(time) => Some(Self::Free(nanos(time))),
            None => EqualPackets::new(bottleneck, load.size).map(Self::Queued),
        }
    }
}
