//! Kinds of the links of one model: a single kind, or a kind for each state of a modulator.
//!
//! Links of one modulator change state at the same instants, so that all of them share the modulator, and a link keeps only the state that its packets
//! change.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::kind::{Kind, Line, Remembered};
use super::losses::Verdict;
use super::switching::States;
use crate::laws::delay::Law;
use crate::line::direct::Words;
use crate::line::model::LinkModel;
use crate::random::PacketDraws;
use crate::stages::queue::Load;

/// Kinds of the links of one model, with the modulator that chooses among them.
#[derive(Clone, Debug)]
pub(super) struct Kinds {
    model: LinkModel,
    /// Seed of the modulator. Without meaning for a model without a modulator.
    seed: u64,
    /// Instant of the next change, or the end of time.
    next: Instant,
    /// Index of the present kind.
    present: usize,
    /// Indexed by state of the modulator; a single kind without a modulator.
    all: Vec<Kind>,
    /// States of the modulator; `None` for a fixed model.
    states: Option<Box<States>>,
    /// `true` if any of the kinds draws random numbers.
    pub(super) are_random: bool,
    /// `true` if links of any of the kinds have state.
    pub(super) remember: bool,
    /// Latest instant of a packet of any of the links.
    #[cfg(debug_assertions)]
    latest: Instant,
}

impl Kinds {
    /// Returns the kinds of a model for packets of this load. Returns `None` if [`Remembered`] has too little state for the links.
    pub(super) fn new(seed: u64, model: &LinkModel, load: Load) -> Option<Self> {
        let (all, states) = match model {
            LinkModel::Fixed(config) => (Vec::from([Kind::new(config, load)?]), None),
            LinkModel::Modulated(modulated) => {
                let states = States::new(seed, modulated, load)?;
                let all: Vec<Kind> = modulated.configs().iter().map(|config| Kind::new(config, load)).collect::<Option<_>>()?;
                if !all.iter().all(Kind::takes_turns) {
                    return None;
                }
                (all, Some(Box::new(states)))
            }
            LinkModel::Replay(_) | LinkModel::Kernel(_) => return None,
        };
        let (next, present) = states.as_ref().map_or((Instant::MAX, 0), |states| (states.next_change(), states.present()));
        let (are_random, remember) = (all.iter().any(|kind| kind.is_random), all.iter().any(|kind| kind.remembers));
        Some(Self {
            model: model.clone(),
            seed,
            next,
            present,
            all,
            states,
            are_random,
            remember,
            #[cfg(debug_assertions)]
            latest: Instant::ZERO,
        })
    }

    /// Returns whether the links of a model, whose modulator has this seed, are of these kinds.
    pub(super) fn are_of(&self, seed: u64, model: &LinkModel) -> bool {
        (self.states.is_none() || self.seed == seed) && self.model == *model
    }

    /// Returns the kind of links that do not change; `None` for links with a modulator.
    pub(super) fn only(&self) -> Option<&Kind> {
        if self.states.is_none() { self.all.first() } else { None }
    }

    /// Returns whether links of all kinds keep the order of packets.
    pub(super) fn keep_order(&self) -> bool {
        self.all.iter().all(|kind| kind.keeps_order)
    }

    /// Returns the kind of the links for a packet that is offered `now`. Returns `None` if the modulator changes while the packet is in transmission.
    /// Instants must not go back, over all links together: the modulator does not return to a state before.
    #[inline(always)]
    pub(super) fn at(&mut self, now: Instant) -> Option<&mut Kind> {
        #[cfg(debug_assertions)]
        if self.states.is_some() {
            let latest = core::mem::replace(&mut self.latest, now);
            assert!(latest <= now, "a packet at {now:?} came after a packet at {latest:?}, over links of one modulator");
        }
        if self.next <= now {
            self.pass(now);
        }
        let kind = &mut self.all[self.present];
        // A departure at the instant of a change comes before the change.
        let leaves_before = match kind.line {
            Line::Free(nanos) => now.saturating_add_nanos(nanos) <= self.next,
            Line::Queued(_) => true,
        };
        leaves_before.then_some(kind)
    }

    /// Lets all changes up to `now` happen.
    #[cold]
    fn pass(&mut self, now: Instant) {
        let Some(states) = &mut self.states else { return };
        // A modulator without further changes has the last of all instants as the next change.
        while self.next <= now && self.next < Instant::MAX {
            states.change();
            let before = core::mem::replace(&mut self.present, states.present());
            let losses = self.all[before].loss.clone();
            self.all[self.present].begin_turn(self.next, &losses);
            self.next = states.next_change();
        }
    }

    /// Computes the fate of a packet of a link with the state `link`, and changes the state. Also returns whether the packet must not arrive before an
    /// earlier packet: the caller keeps the order.
    #[inline]
    pub(super) fn verdict(&mut self, now: Instant, link: &mut Remembered, words: Words, packet: PacketDraws) -> (Verdict, bool) {
        match self.at(now) {
            Some(kind) => (kind.verdict(now, link, words, || packet, (f64::NAN, Law::UNKNOWN)), kind.keeps_order),
            None => self.verdict_over_changes(now, link, words, packet),
        }
    }

    /// Computes the fate like [`verdict`](Self::verdict) of a packet that is in transmission while the modulator changes.
    #[cold]
    fn verdict_over_changes(&mut self, now: Instant, link: &mut Remembered, words: Words, packet: PacketDraws) -> (Verdict, bool) {
        let kind = &mut self.all[self.present];
        if kind.loses(now, link, words, || packet) {
            return (Verdict::Lost, kind.keeps_order);
        }
        let Some(states) = &self.states else { unreachable!("only a modulator changes the kind") };
        // A copy goes ahead of the other links, which are offered packets `now` too. No packet waits, so that the transmission begins with the offer.
        let mut ahead = (**states).clone();
        let leaves = ahead.departure_over_changes(now, |_, _| ());
        let kind = &mut self.all[ahead.present()];
        (Verdict::Arrives(kind.arrival(leaves, link.chain(), words, packet)), kind.keeps_order)
    }
}
