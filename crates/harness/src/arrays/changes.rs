//! Changes of the timeline in runs in arrays.
//!
//! A run goes in stretches from one change to the next. Nothing changes within a stretch, so the law is a constant of the loop over ticks.

use std::slice;

use cohaptic_peer::coordination::{BuiltIn, Law, LawSettings};
use cohaptic_scene::{Change, ChangeKind, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use super::blocks::law_of_lanes;
use super::{Arrays, Samples};

/// Changes still to come, equal in all runs, and the law of each run after each change.
#[derive(Debug)]
pub(super) struct Changes<'a, const L: usize> {
    to_come: slice::Iter<'a, Change>,
    /// Laws of the runs after each change, in reverse order of time. Empty if the strategies of the scenes are no laws of the registry.
    laws: Vec<[BuiltIn; L]>,
}

impl<'a, const L: usize> Changes<'a, L> {
    /// Returns all changes of runs of these scenes.
    pub(super) fn new(scenes: &[&'a Scene; L]) -> Self {
        let to_come = scenes[0].timeline.iter();
        if to_come.as_slice().is_empty() {
            return Self { to_come, laws: Vec::new() };
        }
        // The first law is the law before any change and is in use already.
        let mut laws = side_by_side(scenes.map(|scene| scene.laws_in_time(0).skip(1)));
        // Reversed, so that each change pops its law from the end.
        laws.reverse();
        Self { to_come, laws }
    }

    /// Returns the instant of the next change; [`Instant::MAX`] if there is none.
    pub(super) fn next_at(&self) -> Instant {
        self.to_come.as_slice().first().map_or(Instant::MAX, |change| change.at)
    }
}

/// Collects the items of the iterators in groups of L, until any iterator ends.
fn side_by_side<T, I: Iterator<Item = T>, const L: usize>(mut iterators: [I; L]) -> Vec<[T; L]> {
    let mut together = Vec::new();
    while let Ok(items) = <[T; L]>::try_from(iterators.iter_mut().map_while(Iterator::next).collect::<Vec<T>>()) {
        together.push(items);
    }
    together
}

impl<const A: usize, const L: usize> Arrays<'_, A, L> {
    /// Returns the tick at or after the next change.
    pub(super) fn next_change(&self) -> u64 {
        self.shape.tick_at(self.changes.next_at())
    }

    /// Applies the changes up to the instant `until`, at the tick `tick` or, at the end of the scene, before this tick. Each change of a link takes effect at
    /// its own instant. Calls `damped` with the scene of the copies' damping from then on.
    #[cold]
    pub(super) fn change(&mut self, tick: u64, until: Instant, damped: &mut dyn FnMut(&Scene)) {
        while self.changes.next_at() <= until
            && let Some(change) = self.changes.to_come.next()
        {
            // One entry for each change of the timeline, so an entry is popped even if this change keeps the law.
            let laws = self.changes.laws.pop();
            match &change.what {
                ChangeKind::Link(link) => self.set_links(tick, change.at, &[(link.from, link.to)], |_, _| &link.config),
                ChangeKind::AllLinks(links) => {
                    let pairs = self.pairs();
                    self.set_links(tick, change.at, &pairs, |from, to| links.between(from, to));
                }
                ChangeKind::Contact { peer, contact } => {
                    if let Some(peer) = self.member(*peer) {
                        self.bodies.blocks_mut().set_contact(peer, *contact);
                    }
                }
                ChangeKind::Hand { peer, hand } => {
                    if let Some(peer) = self.member(*peer) {
                        self.bodies.set_hand(peer, hand.as_ref());
                    }
                }
                ChangeKind::Coordination(_) => {
                    self.law = law_of_lanes(&laws.expect("the shape of a scene says that its own law changes"));
                }
                ChangeKind::Parameters(settings) => {
                    let laws = laws.expect("the shape of a scene says that its own law changes");
                    self.change_parameters(settings, &laws, damped);
                }
                ChangeKind::SendWhen(_) => unreachable!("the shape of a scene says that it has no dead bands"),
                ChangeKind::HandTorque { .. } | ChangeKind::RotationalGains(_) => {
                    unreachable!("the shape of a scene says that its object does not turn")
                }
            }
        }
        // Queues wait for this call, because a packet's fate can depend on a change not applied yet.
        if self.shape.has_queues() {
            self.pass(tick);
        }
    }

    /// Returns the index of a peer of the scene among the members; `None` for a peer in different arrays.
    fn member(&self, peer: usize) -> Option<usize> {
        self.members.contains(&peer).then(|| peer - self.members.start)
    }

    /// Returns the sender and the receiver of each link to a member.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let Samples::PerPacket(samples) = &self.samples else { return Vec::new() };
        self.members.clone().flat_map(|to| samples.senders(to - self.members.start).map(move |from| (from, to))).collect()
    }

    fn set_links<'m>(&mut self, tick: u64, at: Instant, pairs: &[(usize, usize)], model: impl Fn(usize, usize) -> &'m LinkModel) {
        let Samples::PerPacket(samples) = &mut self.samples else { return };
        for &(from, to) in pairs.iter().filter(|(_, to)| self.members.contains(to)) {
            samples.set_link((self.shape.before(tick), at), &self.scenes, (from, to), model(from, to));
        }
    }

    /// Changes the strategy's own parameters, as [`cohaptic_peer::Peer::set_parameters`] does.
    fn change_parameters(&mut self, settings: &LawSettings, laws: &[BuiltIn; L], damped: &mut dyn FnMut(&Scene)) {
        self.law = law_of_lanes(laws);
        if let Some((horizons, leads)) = &mut self.leads {
            for (run, law) in laws.iter().enumerate() {
                // A lead stays valid if the horizon stays the same to the bit.
                if let Some(horizon) = Law::<f64>::horizon(law).filter(|horizon| horizon.to_bits() != horizons[run].to_bits()) {
                    horizons[run] = horizon;
                    leads.iter_mut().for_each(|leads| leads[run] = super::Lead::STALE);
                }
            }
        }
        self.bodies.blocks_mut().set_lag(Law::<f64>::lag(&laws[0]));
        // Own damping is part of the copies' step maps, so the maps are made anew.
        let then = self.scenes.map(|scene| scene.with_parameters(settings));
        self.bodies.blocks_mut().set_damping(&then.each_ref());
        damped(&then[0]);
    }
}
