//! The observer that writes everything down.

use std::path::{Path, PathBuf};

use cohaptic_picture::{Axis, Size};
use cohaptic_scene::Scene;

use super::band::Bands;
use super::file::{RecordError, create_folder};
use super::links;
use super::network::Network;
use super::packets::Packets;
use super::plot::{self, Panel, Plot};
use super::trajectory::{Trajectory, Turns};
use super::views::Views;
use crate::{Observer, PacketRow, Summary, TickRow};

/// The name of a file, and the picture in it as SVG.
type RecordedPicture = (&'static str, String);

/// Writes `trajectory.csv` and `packets.csv` while the scene runs, and with [`Recorder::finish`] the rest.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    title: String,
    names: Vec<String>,
    trajectory: Trajectory,
    packets: Packets,
    plotted: Plotted,
    size: Size,
}

/// What the plots show. Curves are ordered by axis, then peer.
#[derive(Debug)]
struct Plotted {
    positions: Bands,
    forces: Bands,
    network: Network,
    /// The rotation vectors of the copies and their lengths, if the object turns.
    orientations: Option<Bands>,
    /// Their poses, if it turns.
    views: Option<Views>,
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
            trajectory: Trajectory::create(folder, names.clone(), scene.axes, Turns::of(scene))?,
            packets: Packets::create(folder, names.clone())?,
            plotted: Plotted {
                positions: bands(curves),
                forces: bands(curves),
                network: Network::new(scene, spans),
                orientations: scene.rotation.is_some().then(|| bands(4 * names.len())),
                views: Views::new(scene, spans),
            },
            size: Size::default(),
            names,
        })
    }

    /// With pictures of this size. Without it, a page on a screen.
    #[must_use]
    pub fn sized(self, size: Size) -> Self {
        Self { size, ..self }
    }

    /// Writes the rest and gives every file its name; gives the files.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if a file cannot be written.
    pub fn finish(self, summary: &Summary) -> Result<Vec<PathBuf>, RecordError> {
        self.finish_with_pictures(summary).map(|(files, _)| files)
    }

    /// [`finish`](Self::finish), with the pictures of the files under the names of the files.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if a file cannot be written.
    pub fn finish_with_pictures(self, summary: &Summary) -> Result<(Vec<PathBuf>, Vec<RecordedPicture>), RecordError> {
        let Self { folder, title, names, trajectory, packets, plotted, size } = self;
        let mut files = vec![trajectory.finish()?, packets.finish()?, links::write(&folder, summary)?];
        let mut pictures = Vec::new();
        let mut drawn = vec![
            ("positions.svg", &plotted.positions, "position of each copy", Axis::new("Position").symbol("x_O").unit("cm"), 100.0, SANE_POSITION),
            (
                "forces.svg",
                &plotted.forces,
                "coordination force on each copy",
                Axis::new("Coordination force").symbol("F_T").unit("N"),
                1.0,
                SANE_FORCE,
            ),
        ];
        if let Some(orientations) = &plotted.orientations {
            let axis = Axis::new("Turn").unit("°");
            drawn.push((
                "orientations.svg",
                orientations,
                "orientation of each copy",
                axis,
                180.0 / std::f64::consts::PI,
                2.0 * std::f64::consts::PI,
            ));
        }
        for (file, bands, what, axis, scale, sane) in drawn {
            let by_axis = bands.split(bands.curves() / names.len());
            let heading = |along: usize| match (file, by_axis.len()) {
                ("orientations.svg", _) => TURNS[along].to_owned(),
                (_, 1) => String::new(),
                _ => format!("along {}", AXES[along]),
            };
            let panel = |(along, bands)| Panel { title: heading(along), axis: axis.clone(), names: &names, bands, scale, sane };
            let panels: Vec<Panel<'_>> = by_axis.iter().enumerate().map(panel).collect();
            let plot = Plot { title: format!("{title}: {what}"), panels };
            pictures.push((file, plot.picture().size(size).svg()));
        }
        if let Some(views) = &plotted.views {
            pictures.push(("views.svg", views.picture(&title, &names, &plotted.positions).size(size).svg()));
        }
        pictures.push(("network.svg", plotted.network.picture(&title, &names).size(size).svg()));
        for (file, svg) in &pictures {
            files.push(plot::write(folder.join(file), svg)?);
        }
        Ok((files, pictures))
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];
/// The components of a rotation vector, in world axes, and its length.
const TURNS: [&str; 4] = ["about x", "about y", "about z", "angle"];

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
        if let (Some(turn), Some(orientations)) = (&row.turn, &mut self.plotted.orientations) {
            let [x, y, z] = turn.object.rotation_vector();
            for (part, value) in [x, y, z, (x * x + y * y + z * z).sqrt()].into_iter().enumerate() {
                orientations.add(part * self.names.len() + row.peer, row.at, value);
            }
        }
        if let (Some(turn), Some(views)) = (&row.turn, &mut self.plotted.views) {
            views.add(row.peer, row.at, row.object.position, turn.object);
        }
        self.trajectory.on_tick(row)
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), RecordError> {
        self.plotted.network.on_packet(row);
        self.packets.on_packet(row)
    }
}
