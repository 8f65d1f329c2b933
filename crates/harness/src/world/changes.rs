//! Applies the changes of the scene's timeline to a running world: links, contacts, hands, gains and parameters.

use cohaptic_peer::Strategy;
use cohaptic_peer::coordination::{BuiltIn, LawValues};
use cohaptic_peer::rotation::Triple;
use cohaptic_scene::{Change, ChangeKind, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::{LinkModel, NodeId};

use super::member::DeviceModel;
use super::{Remote, World};

/// New values of the strategy's own parameters, computed from the scene before the run.
pub(super) struct ParameterChange {
    own: LawValues,
    /// Own damping β of the strategy and total damping of the copy with β \[N·s/m\], indexed by peer.
    damping: Vec<(f64, f64)>,
    /// Law of the turns, β about each axis and total damping of the copy's turns with β \[N·m·s/rad\], indexed by peer. Empty if the object does not turn.
    turns: Vec<(BuiltIn, Triple, Triple)>,
}

/// Returns the new values of each `ChangeKind::Parameters` of the timeline, in reverse order of time.
pub(super) fn parameter_changes(scene: &Scene) -> Vec<ParameterChange> {
    let change = |change: &Change| {
        let ChangeKind::Parameters(settings) = &change.what else { return None };
        let then = scene.with_parameters(settings);
        let damping = (0..then.peers.len()).map(|place| (then.own_damping(place), then.copy_config(place).damping)).collect();
        let turns = |place: usize| Some((then.turn_law(place)?, then.own_rotational_damping(place), then.damped_spin(place)?.damping));
        let turns = (0..then.peers.len()).filter_map(turns).collect();
        Some(ParameterChange { own: *settings.of(scene.coordination.strategy), damping, turns })
    };
    scene.timeline.iter().rev().filter_map(change).collect()
}

impl<const A: usize, S: Strategy<A>, E: Remote<A>> World<A, S, E> {
    /// Applies the changes of the timeline up to and including `now`, each at its own instant.
    #[inline(never)]
    pub(super) fn change(&mut self, now: Instant) {
        while let Some(change) = self.changes.pop_if(|change| change.at <= now) {
            match change.what {
                ChangeKind::Link(link) => self.set_link(change.at, link.from, link.to, &link.config),
                ChangeKind::AllLinks(links) => {
                    let pairs: Vec<(usize, usize)> = match &self.topology {
                        Some(topology) => topology.pairs().collect(),
                        None => {
                            let places = 0..self.members.len();
                            places.clone().flat_map(|from| places.clone().map(move |to| (from, to))).filter(|(from, to)| from != to).collect()
                        }
                    };
                    for (from, to) in pairs {
                        self.set_link(change.at, from, to, links.between(from, to));
                    }
                }
                ChangeKind::Contact { peer, contact } => {
                    self.members[peer].peer.set_contact(contact);
                    for (place, member) in self.members.iter_mut().enumerate().filter(|(place, _)| *place != peer) {
                        // A strategy counts the other peers without its own peer, so a peer after its own has an index lower by one.
                        member.peer.strategy_mut().set_contact(if peer < place { peer } else { peer - 1 }, contact);
                    }
                }
                ChangeKind::Hand { peer, hand } => match self.members[peer].peer.device_mut() {
                    DeviceModel::Simulated(device) => device.set_hand(hand.as_ref()),
                    // A device without simulation has no hand.
                    DeviceModel::Unsimulated(_) => {}
                },
                ChangeKind::HandTorque { peer, torque } => {
                    if let Some(rotation) = self.members[peer].peer.rotation_mut() {
                        rotation.set_hand(torque);
                    }
                }
                ChangeKind::SendWhen(when) => self.send_when = Some(when),
                ChangeKind::Parameters(_) => {
                    // `parameter_changes` made one entry for each of these changes, in the same order.
                    let ParameterChange { own, damping, turns } = self.parameters.pop().expect("there is one for each of these changes");
                    for (rotation, (law, own_damping, damping)) in self.members.iter_mut().filter_map(|member| member.peer.rotation_mut()).zip(turns)
                    {
                        rotation.set_law(&law, own_damping, damping);
                    }
                    for (member, (own_damping, damping)) in self.members.iter_mut().zip(damping) {
                        member.peer.set_parameters(&own, own_damping, damping);
                    }
                    self.horizon = self.members[0].peer.strategy().horizon();
                }
                ChangeKind::Coordination(gains) => {
                    for (member, factor) in self.members.iter_mut().zip(self.coordination_factors.iter().cycle()) {
                        member.peer.strategy_mut().set_gains(gains.scaled(*factor));
                    }
                    self.change_gains_of_turns();
                }
                ChangeKind::RotationalGains(_) => self.change_gains_of_turns(),
            }
        }
    }

    fn change_gains_of_turns(&mut self) {
        if let Some(gains) = self.turning.as_mut().and_then(|turning| turning.next_gains()) {
            self.members.iter_mut().filter_map(|member| member.peer.rotation_mut()).for_each(|rotation| rotation.set_gains(gains));
        }
    }

    pub(super) fn set_link(&mut self, at: Instant, from: usize, to: usize, link: &LinkModel) {
        self.network.set_link(at, NodeId::new(from), NodeId::new(to), link.clone()).expect("changes are in order of time");
    }
}
