//! The peers, axes and lines in the runs of a campaign, which decide about the columns.

use std::collections::BTreeSet;

use cohaptic_scene::Scene;
use serde::{Deserialize, Serialize};

/// Everybody who takes part in any run. Runs need not have the same peers: a peer that is missing in a run has nothing in its columns.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Roster {
    /// Their names, in the order in which they first appear.
    pub(crate) peers: Vec<String>,
    /// How many of the first of them are in every run.
    pub(crate) always: usize,
    /// The most axes of a run.
    pub(crate) axes: usize,
    /// The fewest axes of a run.
    pub(crate) fewest_axes: usize,
    /// Whether any run has a line that a peer sends or receives through.
    pub(crate) access_lines: bool,
}

impl Roster {
    pub(crate) fn of(scene: &Scene) -> Self {
        let peers: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let axes = scene.axes.count();
        let access_lines = scene.peers.iter().any(|peer| peer.uplink.is_some() || peer.downlink.is_some());
        Self { always: peers.len(), peers, axes, fewest_axes: axes, access_lines }
    }

    /// Takes in what another run has.
    pub(crate) fn add(&mut self, other: &Self) {
        let same = self.peers.iter().zip(&other.peers).take_while(|(one, other)| one == other).count();
        self.always = self.always.min(other.always).min(same);
        if same < other.peers.len() {
            let known: BTreeSet<&String> = self.peers.iter().collect();
            let new: Vec<String> = other.peers[same..].iter().filter(|name| !known.contains(name)).cloned().collect();
            self.peers.extend(new);
        }
        self.axes = self.axes.max(other.axes);
        self.fewest_axes = self.fewest_axes.min(other.fewest_axes);
        self.access_lines |= other.access_lines;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roster(peers: &[&str], axes: usize) -> Roster {
        let peers: Vec<String> = peers.iter().map(|name| (*name).to_owned()).collect();
        Roster { always: peers.len(), peers, axes, fewest_axes: axes, access_lines: false }
    }

    #[test]
    fn everybody_is_there_once_in_the_order_of_appearance() {
        let mut all = roster(&["a", "b"], 1);
        all.add(&roster(&["a", "b", "c"], 2));
        assert_eq!((all.peers.join(" "), all.always, all.axes, all.fewest_axes), ("a b c".to_owned(), 2, 2, 1));
        all.add(&roster(&["a", "d", "b"], 1));
        assert_eq!((all.peers.join(" "), all.always), ("a b c d".to_owned(), 1));
        let before = all.clone();
        all.add(&roster(&["a", "b"], 1));
        assert_eq!(all, before);
    }
}
