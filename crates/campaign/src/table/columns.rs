//! Which columns the table of a campaign has, and the peers, axes and lines that decide about them.

use std::collections::BTreeSet;

use cohaptic_scene::{Measure, Scene, Scope};
use cohaptic_wan::DropCause;
use serde::{Deserialize, Serialize};

use super::{Column, Kind};
use crate::vary::Variation;

/// The letters of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The columns, in the order in which [`row`](super::row()) fills them.
pub(crate) fn columns(variations: &[Variation], verdicts: bool, roster: &Roster) -> Vec<Column> {
    let column = |name: String, kind: Kind, optional: bool| Column { name, kind, optional };
    let always = |name: &str, kind: Kind| column(name.to_owned(), kind, false);
    let mut columns = vec![always("run", Kind::Integer), always("combination", Kind::Integer), always("seed", Kind::Integer)];
    columns.extend(variations.iter().map(|vary| column(vary.column(), vary.kind(), false)));
    if verdicts {
        let optional = |name: &str, kind: Kind| column(name.to_owned(), kind, true);
        columns.extend([optional("verdict", Kind::Text), optional("judged", Kind::Text)]);
        columns.extend([optional("radius", Kind::Number), optional("error_bound", Kind::Number)]);
    }
    columns.push(always("ending", Kind::Text));
    columns.push(always("ended_at_s", Kind::Number));
    columns.push(always("ticks", Kind::Integer));
    columns.push(always("max_discrepancy_m", Kind::Number));
    if roster.turns {
        columns.push(column("max_rotation_discrepancy_rad".to_owned(), Kind::Number, true));
    }
    for (place, peer) in roster.peers.iter().enumerate() {
        for (quantity, unit) in [("position", "m"), ("velocity", "m_s")] {
            for (axis, letter) in AXES.iter().enumerate().take(roster.axes) {
                let optional = place >= roster.always || axis >= roster.fewest_axes;
                columns.push(column(format!("peers.{peer}.{quantity}_{letter}_{unit}"), Kind::Number, optional));
            }
        }
    }
    columns.push(always("stale_samples", Kind::Integer));
    columns.push(always("refused_samples", Kind::Integer));
    counters("links", &mut columns);
    if roster.access_lines {
        counters("access", &mut columns);
    }
    columns.extend(roster.measures().map(|(_, _, name)| column(name, Kind::Number, true)));
    columns
}

/// What links did in all.
fn counters(of: &str, columns: &mut Vec<Column>) {
    let causes = DropCause::ALL.into_iter().map(|cause| format!("dropped_{}", cause.name().replace('-', "_")));
    let names = ["offered", "duplicated", "delivered"].map(str::to_owned).into_iter().chain(causes);
    let names = names.chain(["in_flight", "marked", "damaged"].map(str::to_owned));
    columns.extend(names.map(|name| Column { name: format!("{of}.{name}"), kind: Kind::Integer, optional: false }));
    columns.push(Column { name: format!("{of}.mean_delay_s"), kind: Kind::Number, optional: true });
}

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
    /// Whether the object turns in any run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) turns: bool,
    /// The names of all measures of any run.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub(crate) measures: BTreeSet<String>,
}

impl Roster {
    pub(crate) fn of(scene: &Scene) -> Self {
        let peers: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let axes = scene.axes.count();
        let access_lines = scene.peers.iter().any(|peer| peer.uplink.is_some() || peer.downlink.is_some());
        let measures = scene.measure.iter().flat_map(|measure| &measure.names).map(|name| name.text(scene)).collect();
        Self { always: peers.len(), peers, axes, fewest_axes: axes, access_lines, turns: scene.rotation.is_some(), measures }
    }

    /// The measures in the order of their columns: which one, the place of its peer in the roster, and its name.
    pub(crate) fn measures(&self) -> impl Iterator<Item = (Measure, Option<usize>, String)> {
        let of = |measure: Measure| -> Vec<(Option<usize>, String)> {
            match measure.scope() {
                Scope::Run => vec![(None, measure.name().to_owned())],
                Scope::Peer => self.peers.iter().enumerate().map(|(place, peer)| (Some(place), measure.of_peer(peer))).collect(),
            }
        };
        let all = Measure::ALL.iter().flat_map(move |measure| of(*measure).into_iter().map(|(peer, name)| (*measure, peer, name)));
        all.filter(|(_, _, name)| self.measures.contains(name))
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
        self.turns |= other.turns;
        self.measures.extend(other.measures.iter().cloned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roster(peers: &[&str], axes: usize) -> Roster {
        let peers: Vec<String> = peers.iter().map(|name| (*name).to_owned()).collect();
        Roster { always: peers.len(), peers, axes, fewest_axes: axes, access_lines: false, turns: false, measures: BTreeSet::new() }
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
