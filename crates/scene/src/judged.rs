//! Peers whose copies a task judges, and the end of runs with a task.

use cohaptic_peer::Contact;

use crate::model::{ChangeKind, Scene};
use crate::task::{Judged, TaskEnd, TaskSpec};

impl TaskSpec {
    /// Returns the peers whose copies are judged, by index, in the order of the scene.
    #[must_use]
    pub fn judged(&self, scene: &Scene) -> Vec<usize> {
        match self.who {
            Judged::All | Judged::Any => (0..scene.peers.len()).filter(|peer| scene.touches(*peer)).collect(),
            Judged::Peer(peer) => vec![peer],
        }
    }
}

impl Scene {
    /// Returns whether a run of the scene ends at the outcome of its task.
    #[must_use]
    pub fn ends_with_task(&self) -> bool {
        self.task.as_ref().is_some_and(|task| task.end == TaskEnd::Stop)
    }

    /// Returns whether the device of a peer touches the object at any time of the scene.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn touches(&self, peer: usize) -> bool {
        let touches_later =
            |what: &ChangeKind| matches!(what, ChangeKind::Contact { peer: changed, contact } if *changed == peer && *contact != Contact::None);
        self.peers[peer].contact != Contact::None || self.timeline.iter().any(|change| touches_later(&change.what))
    }
}
