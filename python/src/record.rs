//! What happens in a run, as columns: those of `trajectory.csv`, `packets.csv` and `links.csv`.

use std::convert::Infallible;
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, UInt64Array};
use cohaptic_harness::{Observer, PacketRow, StateRow, Summary, TickRow};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::{DropCause, Fate, LinkStats};
use pyo3::prelude::*;

use crate::table::{Table, names};

/// Rows of all ticks of all peers.
#[derive(Debug)]
pub(crate) struct Trajectory {
    peers: Vec<String>,
    names: Vec<String>,
    /// Index of the peer of each row.
    peer: Vec<i32>,
    /// Columns of numbers. Rows would need a copy later.
    columns: Vec<Vec<f64>>,
    devices_turn: bool,
}

impl Trajectory {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut names: Vec<String> = ["t", "xh", "vh", "xo", "vo", "xd", "vd", "fc", "ft"].map(str::to_owned).into();
        for axis in ["y", "z"].into_iter().take(scene.axes.count() - 1) {
            names.extend(["h", "o", "d"].iter().flat_map(|body| [format!("{axis}{body}"), format!("v{axis}{body}")]));
            names.extend([format!("fc{axis}"), format!("ft{axis}")]);
        }
        let devices_turn = scene.rotation.as_ref().is_some_and(|rotation| rotation.peers.iter().any(|peer| peer.device.is_some()));
        if scene.rotation.is_some() {
            let turn = ["qw", "qx", "qy", "qz", "wx", "wy", "wz", "tcx", "tcy", "tcz", "ttx", "tty", "ttz"];
            names.extend(turn.map(str::to_owned));
        }
        if devices_turn {
            names.extend(["qhw", "qhx", "qhy", "qhz", "whx", "why", "whz"].map(str::to_owned));
        }
        let columns = vec![Vec::new(); names.len()];
        Self { peers: scene.peers.iter().map(|peer| peer.name.clone()).collect(), names, peer: Vec::new(), columns, devices_turn }
    }

    pub(crate) fn table(self) -> PyResult<Table> {
        let Self { peers, names: titles, peer, columns, .. } = self;
        let mut columns: Vec<(String, ArrayRef)> =
            titles.into_iter().zip(columns).map(|(name, column)| (name, Arc::new(Float64Array::from(column)) as ArrayRef)).collect();
        columns.insert(1, ("peer".to_owned(), names(peer, peers)));
        Table::new(columns)
    }
}

impl Observer for Trajectory {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let mut columns = self.columns.iter_mut();
        let mut push = |value: f64| {
            if let Some(column) = columns.next() {
                column.push(value);
            }
        };
        push(row.at.as_secs_f64());
        for axis in 0..row.coupling_force.len() {
            for StateRow { position, velocity } in [row.device, row.object, row.target] {
                push(position[axis]);
                push(velocity[axis]);
            }
            push(row.coupling_force[axis]);
            push(row.coordination_force[axis]);
        }
        if let Some(turn) = &row.turn {
            turn.object.orientation.iter().chain(&turn.object.rate).for_each(|number| push(*number));
            turn.coupling_torque.iter().chain(turn.coordination_torque).for_each(|number| push(*number));
            if self.devices_turn {
                match turn.device {
                    Some(device) => device.orientation.iter().chain(&device.rate).for_each(|number| push(*number)),
                    None => (0..7).for_each(|_| push(f64::NAN)),
                }
            }
        }
        self.peer.push(code(row.peer));
        Ok(())
    }
}

/// Rows of all delivered and dropped packets.
#[derive(Debug)]
pub(crate) struct Packets {
    /// Sender and receiver of each link.
    pairs: Vec<(usize, usize)>,
    peers: Vec<String>,
    link: Vec<i32>,
    sequence: Vec<u64>,
    sent: Vec<f64>,
    arrived: Vec<f64>,
    fate: Vec<i32>,
}

impl Packets {
    pub(crate) fn new(scene: &Scene) -> Self {
        let peers = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let (pairs, link, sequence) = (scene.linked_pairs().collect(), Vec::new(), Vec::new());
        Self { pairs, peers, link, sequence, sent: Vec::new(), arrived: Vec::new(), fate: Vec::new() }
    }

    pub(crate) fn table(self) -> PyResult<Table> {
        let Self { pairs, peers, link, sequence, sent, arrived, fate } = self;
        let links = pairs.into_iter().map(|(from, to)| format!("{}->{}", peers[from], peers[to]));
        Table::new(vec![
            ("link".to_owned(), names(link, links)),
            ("sequence".to_owned(), Arc::new(UInt64Array::from(sequence))),
            ("sent".to_owned(), Arc::new(Float64Array::from(sent))),
            ("arrived".to_owned(), Arc::new(Float64Array::from(arrived))),
            ("fate".to_owned(), names(fate, fates())),
        ])
    }
}

/// Names of the fates, indexed by code.
fn fates() -> impl Iterator<Item = String> {
    let others = [Fate::Delivered(Instant::ZERO), Fate::Duplicated].map(Fate::name).into_iter();
    others.chain(DropCause::ALL.map(DropCause::name)).map(str::to_owned)
}

impl Observer for Packets {
    type Error = Infallible;

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        // There is a link for each packet.
        let pair = (row.path.from.index(), row.path.to.index());
        self.link.push(code(self.pairs.binary_search(&pair).unwrap_or_default()));
        self.sequence.push(row.sequence);
        self.sent.push(row.offered.as_secs_f64());
        self.arrived.push(if let Fate::Delivered(at) = row.fate { at.as_secs_f64() } else { f64::NAN });
        self.fate.push(match row.fate {
            Fate::Delivered(_) => 0,
            Fate::Duplicated => 1,
            Fate::Dropped(cause) => 2 + code(cause as usize),
        });
        Ok(())
    }
}

/// Returns the table of links, a row per link and access line.
pub(crate) fn links(summary: &Summary) -> PyResult<Table> {
    let name = |peer: usize| summary.peers[peer].name.as_str();
    let access = summary.access_lines.iter().map(|line| {
        let (from, to) = if line.uplink { (name(line.peer), "*") } else { ("*", name(line.peer)) };
        (format!("{from}->{to}"), line.stats)
    });
    let links = summary.links.iter().map(|link| (format!("{}->{}", name(link.from), name(link.to)), link.stats));
    let (titles, stats): (Vec<String>, Vec<LinkStats>) = access.chain(links).unzip();
    let counts = |count: &dyn Fn(&LinkStats) -> u64| Arc::new(stats.iter().map(count).collect::<UInt64Array>()) as ArrayRef;
    let mut columns = vec![("link".to_owned(), names((0..titles.len()).map(code).collect(), titles))];
    columns.push(("offered".to_owned(), counts(&LinkStats::offered)));
    columns.push(("duplicated".to_owned(), counts(&LinkStats::duplicated)));
    columns.push(("delivered".to_owned(), counts(&LinkStats::delivered)));
    columns.extend(DropCause::ALL.map(|cause| (cause.name().to_owned(), counts(&|stats| stats.dropped(cause)))));
    columns.push(("in-flight".to_owned(), counts(&LinkStats::in_flight)));
    columns.push(("cross-offered".to_owned(), counts(&|stats| stats.cross_traffic().offered)));
    columns.push(("cross-dropped".to_owned(), counts(&|stats| stats.cross_traffic().dropped)));
    let delays = stats.iter().map(|stats| stats.mean_delay().map_or(f64::NAN, |delay| delay.as_secs_f64()));
    columns.push(("mean-delay-s".to_owned(), Arc::new(delays.collect::<Vec<f64>>().into_iter().collect::<Float64Array>())));
    Table::new(columns)
}

/// Returns an index as a code of a column.
fn code(place: usize) -> i32 {
    i32::try_from(place).unwrap_or(i32::MAX)
}
