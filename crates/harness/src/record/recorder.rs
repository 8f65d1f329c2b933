//! The observer that writes everything down.

use std::path::{Path, PathBuf};

use cohaptic_picture::Axis;
use cohaptic_scene::Scene;
use cohaptic_wan::Fate;

use super::band::Bands;
use super::file::{RecordError, create_folder};
use super::links;
use super::packets::Packets;
use super::plot::{self, Panel, Plot};
use super::trajectory::Trajectory;
use crate::{Observer, PacketRow, Summary, TickRow};

/// Writes `trajectory.csv` and `packets.csv` while the scene runs, and with [`Recorder::finish`] the rest.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    title: String,
    names: Vec<String>,
    trajectory: Trajectory,
    packets: Packets,
    plotted: Plotted,
}

/// What the plots show. Curves are ordered by axis, then peer.
#[derive(Debug)]
struct Plotted {
    positions: Bands,
    forces: Bands,
    delays: Bands,
    /// In each span: packets dropped, and all whose fate is known, by when they were sent.
    drops: Vec<(u32, u32)>,
}

/// The spans of time of a plot, and the most numbers that all curves of a plot may hold together.
const SPANS: usize = 1000;
const MOST_NUMBERS: usize = 200_000;

/// Farther from where it began no copy is moved by people at desktop devices \[m\].
pub const SANE_POSITION: f64 = 1.0;
/// No desktop device and no person at it gives more force \[N\].
const SANE_FORCE: f64 = 1000.0;

impl Recorder {
    /// Begins to record a scene into a folder, which is made if there is none. Records of an earlier run in it are replaced when this one is whole.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the folder or a file cannot be made.
    pub fn create(folder: &Path, scene: &Scene) -> Result<Self, RecordError> {
        create_folder(folder)?;
        let names: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let curves = names.len() * scene.axes.count();
        let spans = SPANS.min(MOST_NUMBERS / curves).max(50);
        let bands = |curves| Bands::new(scene.duration, spans, curves);
        Ok(Self {
            folder: folder.to_path_buf(),
            title: scene.title.clone(),
            trajectory: Trajectory::create(folder, names.clone(), scene.axes)?,
            packets: Packets::create(folder, names.clone())?,
            plotted: Plotted { positions: bands(curves), forces: bands(curves), delays: bands(1), drops: vec![(0, 0); spans] },
            names,
        })
    }

    /// Writes what is left and gives every file its name; gives the files.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if a file cannot be written.
    pub fn finish(self, summary: &Summary) -> Result<Vec<PathBuf>, RecordError> {
        let Self { folder, title, names, trajectory, packets, plotted } = self;
        let mut files = vec![trajectory.finish()?, packets.finish()?, links::write(&folder, summary)?];
        for (file, bands, what, axis, scale, sane) in [
            ("positions.svg", &plotted.positions, "position of each copy", Axis::new("Position").symbol("x_O").unit("cm"), 100.0, SANE_POSITION),
            (
                "forces.svg",
                &plotted.forces,
                "coordination force on each copy",
                Axis::new("Coordination force").symbol("F_T").unit("N"),
                1.0,
                SANE_FORCE,
            ),
        ] {
            let by_axis = bands.split(bands.curves() / names.len());
            let heading = |along: usize| if by_axis.len() == 1 { String::new() } else { format!("along {}", AXES[along]) };
            let panel = |(along, bands)| Panel { title: heading(along), axis: axis.clone(), names: &names, bands, scale, sane, not_negative: false };
            let panels: Vec<Panel<'_>> = by_axis.iter().enumerate().map(panel).collect();
            files.push(plot::write(folder.join(file), &Plot { title: format!("{title}: {what}"), panels })?);
        }
        let shares = plotted.drop_shares();
        let of_links = |title: &str, axis, bands, scale| Panel {
            title: title.to_owned(),
            axis,
            names: &[],
            bands,
            scale,
            sane: f64::INFINITY,
            not_negative: true,
        };
        let panels = vec![
            of_links("delay of the packets that arrived", Axis::new("Delay").unit("ms"), &plotted.delays, 1e3),
            of_links("share of the packets sent that were dropped", Axis::new("Dropped").unit("%"), &shares, 100.0),
        ];
        files.push(plot::write(folder.join("network.svg"), &Plot { title: format!("{title}: all links"), panels })?);
        Ok(files)
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Plotted {
    fn on_packet(&mut self, row: &PacketRow) {
        let arrived = matches!(row.fate, Fate::Delivered(_));
        if arrived {
            self.delays.add(0, row.sent, (row.at - row.sent).as_secs_f64());
        }
        if let Some(span) = self.delays.span(row.sent) {
            let (dropped, all) = &mut self.drops[span];
            *dropped = dropped.saturating_add(u32::from(!arrived));
            *all = all.saturating_add(1);
        }
    }

    /// The share of the packets sent in each span that was dropped. What was sent so late that it may still be on the way at the end is left out:
    /// there only the drops are known.
    fn drop_shares(&self) -> Bands {
        let mut shares = self.delays.emptied();
        let longest = self.delays.curve(0).map(|(_, _, high)| high).fold(0.0, f64::max);
        let known = self.delays.seconds() - longest;
        let spans = self.drops.iter().enumerate().filter(|(span, (_, all))| *all > 0 && self.delays.end_of(*span) <= known);
        for (span, (dropped, all)) in spans {
            shares.set(0, span, f64::from(*dropped) / f64::from(*all));
        }
        shares
    }
}

impl Observer for Recorder {
    type Error = RecordError;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), RecordError> {
        for axis in 0..row.coupling_force.len() {
            let curve = axis * self.names.len() + row.peer;
            self.plotted.positions.add(curve, row.at, row.object.position[axis]);
            self.plotted.forces.add(curve, row.at, row.coordination_force[axis]);
        }
        self.trajectory.on_tick(row)
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), RecordError> {
        self.plotted.on_packet(row);
        self.packets.on_packet(row)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_units::{Bytes, Instant};
    use cohaptic_wan::DropCause;

    use super::*;

    /// Packets at 0, 100, … 900 ms of a second, every second one lost, the others 150 ms on the way: those sent from 850 ms on are unknown.
    #[test]
    fn the_share_dropped_is_shown_only_where_all_fates_are_known() {
        let bands = Bands::new(Duration::from_secs(1), 5, 1);
        let mut plotted = Plotted { positions: bands.clone(), forces: bands.clone(), delays: bands, drops: vec![(0, 0); 5] };
        let at = |millis: u64| Instant::from_nanos(millis * 1_000_000);
        for (sequence, sent) in (0..1000).step_by(100).enumerate() {
            let lost = sequence % 2 == 1;
            let fate = if lost { Fate::Dropped(DropCause::Loss) } else { Fate::Delivered(at(sent + 150)) };
            if lost || sent + 150 <= 1000 {
                let arrival = if lost { at(sent) } else { at(sent + 150) };
                plotted.on_packet(&PacketRow { from: 0, to: 1, sequence: sequence as u64, sent: at(sent), at: arrival, size: Bytes::new(64), fate });
            }
        }
        let shown: Vec<f64> = plotted.drop_shares().curve(0).map(|(_, low, _)| low).collect();
        assert_eq!(shown, [0.5; 4]);
    }
}
