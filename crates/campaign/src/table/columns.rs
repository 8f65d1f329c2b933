//! The columns of the table, and the roster of peers, axes and lines on which the columns depend.

use std::collections::BTreeSet;

use cohaptic_scene::{Measure, Scene, Scope};
use cohaptic_wan::DropCause;
use serde::{Deserialize, Serialize};

use super::{Column, Kind};
use crate::vary::Variation;

/// Names of the axes, indexed by axis.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Returns the columns, in the order in which [`row`](super::row()) fills a row.
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
    if roster.tasks {
        // Optional, because a run of the campaign may have no task.
        columns.extend([column("task.outcome".to_owned(), Kind::Text, true), column("task.time_s".to_owned(), Kind::Number, true)]);
        columns.push(column("task.reached".to_owned(), Kind::Integer, true));
    }
    columns.push(always("max_discrepancy_m", Kind::Number));
    if roster.turns {
        columns.push(column("max_rotation_discrepancy_rad".to_owned(), Kind::Number, true));
    }
    for (place, peer) in roster.peers.iter().enumerate() {
        for (quantity, unit) in [("position", "m"), ("velocity", "m_s")] {
            for (axis, letter) in AXES.iter().enumerate().take(roster.axes) {
                // A peer or an axis missing in some run makes the column optional.
                let optional = place >= roster.always || axis >= roster.fewest_axes;
                columns.push(column(format!("peers.{peer}.{quantity}_{letter}_{unit}"), Kind::Number, optional));
            }
        }
    }
    columns.push(always("stale_samples", Kind::Integer));
    columns.push(always("refused_samples", Kind::Integer));
    counters("links", roster, &mut columns);
    if roster.access_lines {
        counters("access", roster, &mut columns);
    }
    columns.extend(roster.measures().map(|(_, _, name)| column(name, Kind::Number, true)));
    columns
}

/// Adds the columns of the counters of all links (`of` is `links`) or of all access lines (`access`).
fn counters(of: &str, roster: &Roster, columns: &mut Vec<Column>) {
    let causes = DropCause::ALL.into_iter().map(|cause| format!("dropped_{}", cause.name().replace('-', "_")));
    let names = ["offered", "duplicated", "delivered"].map(str::to_owned).into_iter().chain(causes);
    let cross: &[&str] = if roster.cross_traffic { &["cross_offered", "cross_dropped"] } else { &[] };
    let names = names.chain(["in_flight", "marked", "damaged"].iter().chain(cross).map(|name| (*name).to_owned()));
    columns.extend(names.map(|name| Column { name: format!("{of}.{name}"), kind: Kind::Integer, optional: false }));
    columns.push(Column { name: format!("{of}.mean_delay_s"), kind: Kind::Number, optional: true });
}

/// Union of the peers, axes, lines and measures of all runs. A peer absent from a run has no values in that run's row.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Roster {
    /// Names of the peers, in the order of first appearance.
    pub(crate) peers: Vec<String>,
    /// Number of leading `peers` present in every run.
    pub(crate) always: usize,
    /// Largest number of axes of a run.
    pub(crate) axes: usize,
    /// Smallest number of axes of a run.
    pub(crate) fewest_axes: usize,
    /// Whether any run has an access line, through which a peer sends or receives.
    pub(crate) access_lines: bool,
    /// `true` if a line of any run has cross-traffic, at the start or after a change.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) cross_traffic: bool,
    /// `true` if the object turns in any run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) turns: bool,
    /// `true` if any run has a task.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) tasks: bool,
    /// Names of the measures of all runs.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub(crate) measures: BTreeSet<String>,
}

impl Roster {
    pub(crate) fn of(scene: &Scene) -> Self {
        let peers: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let axes = scene.axes.count();
        let access_lines = scene.peers.iter().any(|peer| peer.uplink.is_some() || peer.downlink.is_some());
        let measures = scene.measure.iter().flat_map(|measure| &measure.names).map(|name| name.text(scene)).collect();
        Self {
            always: peers.len(),
            peers,
            axes,
            fewest_axes: axes,
            access_lines,
            cross_traffic: has_cross_traffic(scene),
            turns: scene.rotation.is_some(),
            tasks: scene.task.is_some(),
            measures,
        }
    }

    /// Returns the measures in the order of their columns: the measure, the index of its peer in `peers` (`None` for a measure of the run), and the name of the
    /// column.
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

    /// Extends the roster by the roster of another run.
    pub(crate) fn add(&mut self, other: &Self) {
        let same = self.peers.iter().zip(&other.peers).take_while(|(one, other)| one == other).count();
        // Only the common leading peers are certain to be in every run at the same place.
        self.always = self.always.min(other.always).min(same);
        // A set only for the lookup. The order of `peers` stays the order of appearance.
        if same < other.peers.len() {
            let known: BTreeSet<&String> = self.peers.iter().collect();
            let new: Vec<String> = other.peers[same..].iter().filter(|name| !known.contains(name)).cloned().collect();
            self.peers.extend(new);
        }
        self.axes = self.axes.max(other.axes);
        self.fewest_axes = self.fewest_axes.min(other.fewest_axes);
        self.access_lines |= other.access_lines;
        self.cross_traffic |= other.cross_traffic;
        self.turns |= other.turns;
        self.tasks |= other.tasks;
        self.measures.extend(other.measures.iter().cloned());
    }
}

/// Returns whether a link or an access line of a scene has cross-traffic, at the start or after a change of the timeline.
fn has_cross_traffic(scene: &Scene) -> bool {
    let lines = scene.peers.iter().flat_map(|peer| [&peer.uplink, &peer.downlink]).flatten();
    let changed = scene.timeline.iter().flat_map(|change| change.what.link_configs());
    scene.links.configs().iter().chain(lines).chain(changed).any(|link| link.has_cross_traffic())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roster(peers: &[&str], axes: usize) -> Roster {
        let peers: Vec<String> = peers.iter().map(|name| (*name).to_owned()).collect();
        Roster {
            always: peers.len(),
            peers,
            axes,
            fewest_axes: axes,
            access_lines: false,
            cross_traffic: false,
            turns: false,
            tasks: false,
            measures: BTreeSet::new(),
        }
    }

    #[test]
    fn everybody_is_there_once_in_the_order_of_appearance() {
        let mut all = roster(&["a", "b"], 1);
        all.add(&roster(&["a", "b", "c"], 2));
        assert_eq!((all.peers.join(" "), all.always, all.axes, all.fewest_axes), ("a b c".to_owned(), 2, 2, 1));
        all.add(&roster(&["a", "d", "b"], 1));
        assert_eq!((all.peers.join(" "), all.always), ("a b c d".to_owned(), 1));
        assert!(!all.tasks);
        all.add(&Roster { tasks: true, ..roster(&["a", "b"], 1) });
        assert!(all.tasks);
        let before = all.clone();
        all.add(&roster(&["a", "b"], 1));
        assert_eq!(all, before);
    }
}
