//! Operators of a scene: models of persons, with the seen object and the expected delay of each person.

use core::time::Duration;

use cohaptic_peer::Hand;
use cohaptic_peer::operator::{OperatorConfig, OperatorLaw, Seen};

use crate::{PeerKind, Scene};

impl Scene {
    /// Returns the model of a person at the hand of a peer; `None` if no modelled person holds the device. `peer` is the index in [`Scene::peers`].
    ///
    /// The arm of the person is that of the hand: [`Hand::arm`]. `OperatorConfig::sees` holds an index in [`Scene::peers`], never that of the peer itself.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn operator(&self, peer: usize) -> Option<&OperatorConfig> {
        self.peers[peer].hand.as_ref().and_then(Hand::operator)
    }

    /// Returns the delay that the person at the hand of a peer expects between a motion of the hand and the same motion of the seen copy, without the visual
    /// delay. As written or, without a number, zero for the own copy, and the mean delays of the ways to the seen peer and back. Zero without a person, and for
    /// a person who expects no delay. `peer` is the index in [`Scene::peers`].
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn expected_delay(&self, peer: usize) -> Duration {
        let Some(OperatorConfig { law: OperatorLaw::Moves(moves), sees, .. }) = self.operator(peer) else { return Duration::ZERO };
        match (moves.expects, sees) {
            (Some(expected), _) => expected,
            (None, Seen::Own) => Duration::ZERO,
            (None, Seen::Peer(other)) => self.mean_delay(peer, *other).saturating_add(self.mean_delay(*other, peer)),
        }
    }

    /// Returns the mean delay of the way from a peer to another: its uplink, the link, and the downlink of the receiver.
    fn mean_delay(&self, from: usize, to: usize) -> Duration {
        let lines = [self.peers[from].uplink.as_deref(), Some(self.links.between(from, to)), self.peers[to].downlink.as_deref()];
        lines.into_iter().flatten().fold(Duration::ZERO, |sum, line| sum.saturating_add(line.mean_delay()))
    }

    /// Returns the first peer whose operator cannot act in this scene, with the reason; `None` if all can.
    pub(crate) fn refused_operator(&self) -> Option<(usize, String)> {
        (0..self.peers.len()).find_map(|peer| {
            let (operator, spec) = (self.operator(peer)?, &self.peers[peer]);
            let refuse = |why: String| Some((peer, format!("peer \"{}\": {why}", spec.name)));
            if matches!(spec.kind, PeerKind::Falcon(..) | PeerKind::Inverse3(..)) {
                let device = if matches!(spec.kind, PeerKind::Falcon(..)) { "a Falcon" } else { "an Inverse3" };
                return refuse(format!("an operator moves a device that is simulated here: expected no operator at {device}"));
            }
            let Seen::Peer(other) = operator.sees else { return None };
            if self.hears(peer, other) {
                return None;
            }
            refuse(format!(
                "an operator cannot see peer \"{}\", of which this peer gets no samples: expected sees = \"own\", or the name of a peer that is heard",
                self.peers[other].name
            ))
        })
    }

    /// Returns whether a peer gets the samples of another peer.
    fn hears(&self, peer: usize, other: usize) -> bool {
        match (&self.topology, self.server()) {
            (Some(topology), _) => topology.has_link(other, peer),
            (None, Some(server)) => peer == server || other == server,
            (None, None) => true,
        }
    }
}
