//! Pictures of a run.

use std::convert::Infallible;

use cohaptic_picture::{Axis, Size};
use cohaptic_scene::Scene;

use super::band::Bands;
use super::network::Network;
use super::plot::{Panel, Plot, SANE_POSITION};
use super::targets::Targets;
use super::views::Views;
use crate::{Observer, PacketRow, TickRow};

/// Name of a file, and its picture as SVG.
pub type RecordedPicture = (&'static str, String);

/// Observer that draws a run in memory, without files. Memory is bounded: curves keep the least and the greatest value of each span of time.
#[derive(Debug)]
pub struct Pictures {
    title: String,
    names: Vec<String>,
    /// Positions of the copies \[m\]. Curves are ordered by axis, then peer.
    positions: Bands,
    /// Coordination forces on the copies \[N\], in the order of `positions`.
    forces: Bands,
    network: Network,
    /// Rotation vectors of the copies and their lengths \[rad\], ordered by component as in [`TURNS`], then peer. `None` if the object does not turn.
    orientations: Option<Bands>,
    /// Poses of the copies; `None` if the object does not turn.
    views: Option<Views>,
    /// Targets of the task; `None` for a scene without a task.
    targets: Option<Targets>,
}

/// Spans of time in a plot, as long as its curves are few.
const SPANS: usize = 1000;
/// Greatest number of numbers in all curves of a plot together. With many curves, spans are fewer.
const MOST_NUMBERS: usize = 200_000;

/// Force \[N\] beyond the abilities of desktop devices and of people at them.
const SANE_FORCE: f64 = 1000.0;

const AXES: [&str; 3] = ["x", "y", "z"];
/// Components of a rotation vector, in world axes, and its length.
const TURNS: [&str; 4] = ["about x", "about y", "about z", "angle"];

impl Pictures {
    /// Returns the observer before the run.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let names: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        // All curves together stay below a fixed size of memory, but a curve keeps at least 50 spans.
        let curves = names.len() * scene.axes.count();
        let spans = SPANS.min(MOST_NUMBERS / curves).max(50);
        let bands = |curves| Bands::new(scene.duration, spans, curves);
        Self {
            title: scene.title.clone(),
            positions: bands(curves),
            forces: bands(curves),
            network: Network::new(scene, spans),
            orientations: scene.rotation.is_some().then(|| bands(4 * names.len())),
            views: Views::new(scene, spans),
            targets: Targets::new(scene, spans),
            names,
        }
    }

    /// Draws the pictures and returns them with the names of their files.
    #[must_use]
    pub fn drawn(&self, size: Size) -> Vec<RecordedPicture> {
        let Self { title, names, positions, forces, network, orientations, views, targets } = self;
        let (targets, mut pictures) = (targets.as_ref().map(Targets::settled), Vec::new());
        let mut drawn = vec![
            ("positions.svg", positions, "position of each copy", Axis::new("Position").symbol("x_O").unit("cm"), 100.0, SANE_POSITION),
            ("forces.svg", forces, "coordination force on each copy", Axis::new("Coordination force").symbol("F_T").unit("N"), 1.0, SANE_FORCE),
        ];
        if let Some(orientations) = orientations {
            let (axis, sane) = (Axis::new("Turn").unit("°"), 2.0 * std::f64::consts::PI);
            drawn.push(("orientations.svg", orientations, "orientation of each copy", axis, 180.0 / std::f64::consts::PI, sane));
        }
        for (file, bands, what, axis, scale, sane) in drawn {
            // Curves are ordered by axis, so each part of equal size is one panel.
            let by_axis = bands.split(bands.curves() / names.len());
            let heading = |along: usize| match (file, by_axis.len()) {
                ("orientations.svg", _) => TURNS[along].to_owned(),
                (_, 1) => String::new(),
                _ => format!("along {}", AXES[along]),
            };
            let panel = |(along, bands)| {
                let targets = targets.as_ref().filter(|_| file == "positions.svg").map(|targets| (targets, along));
                Panel { title: heading(along), axis: axis.clone(), names, bands, scale, sane, targets }
            };
            let panels: Vec<Panel<'_>> = by_axis.iter().enumerate().map(panel).collect();
            let plot = Plot { title: format!("{title}: {what}"), panels };
            pictures.push((file, plot.picture().size(size).svg()));
        }
        if let Some(views) = views {
            pictures.push(("views.svg", views.picture(title, names, positions).size(size).svg()));
        }
        pictures.push(("network.svg", network.picture(title, names).size(size).svg()));
        pictures
    }
}

impl Observer for Pictures {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if let Some(targets) = &mut self.targets {
            targets.on_tick(row);
        }
        for axis in 0..row.coupling_force.len() {
            // Curves are ordered by axis, then peer, as `Bands::split` expects.
            let curve = axis * self.names.len() + row.peer;
            self.positions.add(curve, row.at, row.object.position[axis]);
            self.forces.add(curve, row.at, row.coordination_force[axis]);
        }
        if let (Some(turn), Some(orientations)) = (&row.turn, &mut self.orientations) {
            let [x, y, z] = turn.object.rotation_vector();
            for (part, value) in [x, y, z, (x * x + y * y + z * z).sqrt()].into_iter().enumerate() {
                orientations.add(part * self.names.len() + row.peer, row.at, value);
            }
        }
        if let (Some(turn), Some(views)) = (&row.turn, &mut self.views) {
            views.add(row.peer, row.at, row.object.position, turn.object);
        }
        Ok(())
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        self.network.on_packet(row);
        Ok(())
    }
}
