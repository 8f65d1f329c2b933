//! Links with a modulator under a load so easy that no packet waits in any state: the modulator, and links with more state than a [kind](super::kind) has.
//!
//! The changes of state are a function of the seed and the name of the modulator, so that the departure of a packet is certain at its offer, also where the
//! rate changes while the packet is in transmission.

use alloc::boxed::Box;
use alloc::sync::Arc;

use cohaptic_units::{Instant, Rate};

use crate::line::direct::Direct;
use crate::line::name::LinkName;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::modulation::{Modulated, ModulationStage};
use crate::stages::queue::{Discipline, Load, Service, giga_bits, nanos};

/// Modulator of one link, and the transmitter of the link in each state. Numbers that every packet reads stand here, and the rest is boxed, so that a mesh of
/// such links reads fewer cache lines.
#[derive(Clone, Debug)]
pub(super) struct Switching {
    /// Instant of the next change, or the end of time.
    next: Instant,
    /// Departure of the latest packet.
    departure: Instant,
    /// Transmission time of a packet in the present state \[ns\].
    time: u64,
    states: Box<States>,
}

/// States of a modulator, and the transmitter of a link in each state.
#[derive(Clone, Debug)]
pub(super) struct States {
    stage: ModulationStage,
    /// Indexed by state.
    transmitters: Arc<[Transmitter]>,
}

/// Transmitter of a link in one state, for packets of one size.
#[derive(Clone, Copy, Debug)]
struct Transmitter {
    /// `None` if a packet takes no time.
    rate: Option<Rate>,
    /// Size of a packet in transmission, framing included \[10⁻⁹ bit\].
    bits: u128,
    /// Transmission time of a packet \[ns\].
    time: u64,
}

/// Time \[ns\] by which a transmission must be shorter than the gap of the load. Each change of the rate within a transmission rounds the rest up to a
/// nanosecond, and a thousand changes within a gap do not happen: see [`Switching::takes`].
const MARGIN: u64 = 1_000;

impl Switching {
    /// Returns whether no packet of the load waits on such a link, and all stages decide at once.
    pub(super) fn takes(modulated: &Modulated, load: Load) -> bool {
        Transmitter::of_states(modulated, load).is_some()
    }

    /// Returns the modulator of a link, and the direct stages of the link at the begin of time. Returns `None` if [`takes`](Self::takes) refuses the link.
    pub(super) fn new(seed: u64, name: &LinkName, modulated: &Modulated, load: Load) -> Option<(Self, Direct)> {
        let states = Box::new(States::new(seed, modulated, load)?);
        // As in the general pipeline, where a change of the configuration at the begin of time brings the first state.
        let mut direct = Direct::new(seed, name, &LinkConfig::default());
        direct.reconfigure(Instant::ZERO, states.stage.config());
        Some((Self { next: states.next_change(), departure: Instant::ZERO, time: states.transmitter().time, states }, direct))
    }

    /// Lets all changes up to `now` happen.
    #[inline]
    pub(super) fn pass(&mut self, now: Instant, direct: &mut Direct) {
        while self.next <= now {
            self.change(direct);
        }
    }

    /// Returns the departure of a packet that is offered `now`, and lets the changes before the departure happen.
    #[inline]
    pub(super) fn departure(&mut self, now: Instant, direct: &mut Direct) -> Instant {
        let begin = now.max(self.departure);
        let leaves = begin.saturating_add_nanos(self.time);
        // A departure at the instant of a change comes before the change.
        self.departure = if leaves <= self.next { leaves } else { self.departure_over_changes(begin, direct) };
        self.departure
    }

    #[cold]
    fn departure_over_changes(&mut self, since: Instant, direct: &mut Direct) -> Instant {
        let leaves = self.states.departure_over_changes(since, |at, config| direct.reconfigure(at, config));
        (self.next, self.time) = (self.states.next_change(), self.states.transmitter().time);
        leaves
    }

    #[cold]
    fn change(&mut self, direct: &mut Direct) {
        self.states.change();
        direct.reconfigure(self.next, self.states.stage.config());
        (self.next, self.time) = (self.states.next_change(), self.states.transmitter().time);
    }
}

impl States {
    /// Returns the modulator at the begin of time. Returns `None` if [`Switching::takes`] refuses the link.
    pub(super) fn new(seed: u64, modulated: &Modulated, load: Load) -> Option<Self> {
        let transmitters = Transmitter::of_states(modulated, load)?;
        Some(Self { stage: ModulationStage::new(seed, modulated.clone(), Instant::ZERO), transmitters })
    }

    /// Returns the index of the present state.
    pub(super) const fn present(&self) -> usize {
        self.stage.state()
    }

    /// Returns the instant of the next change, or the end of time.
    pub(super) fn next_change(&self) -> Instant {
        self.stage.next_change().unwrap_or(Instant::MAX)
    }

    /// Moves to the next state.
    pub(super) fn change(&mut self) {
        self.stage.change();
    }

    /// Returns the departure of a packet whose transmission begins at `since`, and lets the changes before the departure happen. `changed` is called with
    /// the instant and the configuration of each change.
    pub(super) fn departure_over_changes(&mut self, mut since: Instant, mut changed: impl FnMut(Instant, &LinkConfig)) -> Instant {
        let mut left = self.transmitter().bits;
        loop {
            // Either every state has a rate or none, and without a rate a packet takes no time and meets no change.
            let Some(rate) = self.transmitter().rate else { return since };
            let (leaves, next) = (since.saturating_add(rate.transmission_time(left)), self.next_change());
            if leaves <= next {
                return leaves;
            }
            // The bits sent at the old rate stay sent.
            left = left.saturating_sub(rate.bits_sent(next.saturating_duration_since(since)));
            since = next;
            self.change();
            changed(since, self.stage.config());
        }
    }

    fn transmitter(&self) -> &Transmitter {
        &self.transmitters[self.stage.state()]
    }
}

impl Transmitter {
    /// Returns the transmitters, indexed by state. Returns `None` if a packet can wait, or if a stage does not decide at once.
    fn of_states(modulated: &Modulated, load: Load) -> Option<Arc<[Self]>> {
        let transmitters: Arc<[Self]> = modulated.configs().iter().map(|config| Self::new(config, load)).collect::<Option<_>>()?;
        // With equal bits a packet that begins at one rate and ends at another takes no longer than the slower of the two.
        let are_alike = transmitters.windows(2).all(|pair| pair[0].bits == pair[1].bits);
        // A state lasts for a gap on average, so that a transmission sees few changes.
        let last = modulated.modulator().states().iter().all(|state| state.sojourn.is_none_or(|sojourn| sojourn.mean() >= load.gap));
        (are_alike && last).then_some(transmitters)
    }

    fn new(config: &LinkConfig, load: Load) -> Option<Self> {
        // A bucket keeps tokens from one state to the next.
        if !config.is_direct_but_for_queue(load) || config.token_bucket.is_some() || config.layout == Layout::Netem {
            return None;
        }
        let Some(bottleneck) = &config.bottleneck else { return Some(Self { rate: None, bits: 0, time: 0 }) };
        let Service::Rate(rate) = bottleneck.service else { return None };
        // RED remembers packets that did not wait.
        if matches!(bottleneck.discipline, Discipline::Red(_)) {
            return None;
        }
        let time = nanos(bottleneck.time_without_wait(load)?);
        let bits = giga_bits(bottleneck.framing.on_the_line(load.size));
        (time.saturating_add(MARGIN) <= nanos(load.gap)).then_some(Self { rate: Some(rate), bits, time })
    }
}
