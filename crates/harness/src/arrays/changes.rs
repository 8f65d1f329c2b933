//! The changes of a timeline. A run in arrays goes in stretches from one to the next: in a stretch nothing changes, and the law is a constant of the loop.

use std::slice;

use cohaptic_peer::coordination::{BuiltIn, Law, LawSettings};
use cohaptic_scene::{Change, ChangeKind, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use super::blocks::law_of_lanes;
use super::{Arrays, Samples};

/// The changes to come, which are the same in all runs, and what follows from them in each.
#[derive(Debug)]
pub(super) struct Changes<'a, const L: usize> {
    to_come: slice::Iter<'a, Change>,
    /// The laws of the scenes after each of them, the next ones last; empty if their strategies are no laws.
    laws: Vec<[BuiltIn; L]>,
}

impl<'a, const L: usize> Changes<'a, L> {
    /// All of them, of runs of these scenes.
    pub(super) fn new(scenes: &[&'a Scene; L]) -> Self {
        let to_come = scenes[0].timeline.iter();
        if to_come.as_slice().is_empty() {
            return Self { to_come, laws: Vec::new() };
        }
        let mut laws = side_by_side(scenes.map(|scene| scene.laws_in_time(0).skip(1)));
        laws.reverse();
        Self { to_come, laws }
    }

    /// When something changes next; never, if nothing does.
    pub(super) fn next_at(&self) -> Instant {
        self.to_come.as_slice().first().map_or(Instant::MAX, |change| change.at)
    }
}

/// What iterators give together, until one of them ends.
fn side_by_side<T, I: Iterator<Item = T>, const L: usize>(mut iterators: [I; L]) -> Vec<[T; L]> {
    let mut together = Vec::new();
    while let Ok(items) = <[T; L]>::try_from(iterators.iter_mut().map_while(Iterator::next).collect::<Vec<T>>()) {
        together.push(items);
    }
    together
}

impl<const A: usize, const L: usize> Arrays<'_, A, L> {
    /// The tick at which something changes next.
    pub(super) fn next_change(&self) -> u64 {
        self.shape.tick_at(self.changes.next_at())
    }

    /// Makes the changes up to an instant, those of links each at an instant of its own, at that tick or at the end of the scene before that tick. Tells `damped` of the
    /// scene whose damping the copies have from then on.
    #[cold]
    pub(super) fn change(&mut self, tick: u64, until: Instant, damped: &mut dyn FnMut(&Scene)) {
        while self.changes.next_at() <= until
            && let Some(change) = self.changes.to_come.next()
        {
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
        if self.shape.has_queues() {
            self.pass(tick);
        }
    }

    /// The place here of a peer of the scene.
    fn member(&self, peer: usize) -> Option<usize> {
        self.members.contains(&peer).then(|| peer - self.members.start)
    }

    /// The links to the peers that are here.
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

    /// As [`cohaptic_peer::Peer::set_parameters`] does.
    fn change_parameters(&mut self, settings: &LawSettings, laws: &[BuiltIn; L], damped: &mut dyn FnMut(&Scene)) {
        self.law = law_of_lanes(laws);
        if let Some((horizons, leads)) = &mut self.leads {
            for (run, law) in laws.iter().enumerate() {
                if let Some(horizon) = Law::<f64>::horizon(law).filter(|horizon| horizon.to_bits() != horizons[run].to_bits()) {
                    horizons[run] = horizon;
                    leads.iter_mut().for_each(|leads| leads[run] = super::Lead::STALE);
                }
            }
        }
        self.bodies.blocks_mut().set_lag(Law::<f64>::lag(&laws[0]));
        let then = self.scenes.map(|scene| scene.with_parameters(settings));
        self.bodies.blocks_mut().set_damping(&then.each_ref());
        damped(&then[0]);
    }
}
