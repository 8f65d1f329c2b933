//! The observer that writes all records of a run.

use std::path::{Path, PathBuf};

use cohaptic_picture::Size;
use cohaptic_scene::Scene;

use super::file::RecordError;
use super::links;
use super::packets::Packets;
use super::pictures::{Pictures, RecordedPicture};
use super::plot;
use super::task::TaskRecord;
use super::trajectory::Trajectory;
use crate::{Observer, PacketRow, Summary, TickRow};

/// Writes `trajectory.csv` and `packets.csv` during the run, and the remaining files in [`Recorder::finish`].
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    trajectory: Trajectory,
    packets: Packets,
    /// Files of the task; `None` for a scene without a task.
    task: Option<TaskRecord>,
    pictures: Pictures,
    size: Size,
}

impl Recorder {
    /// Creates the folder if needed and begins the records. Records of an earlier run in the folder are replaced by [`Recorder::finish`].
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the folder or a file cannot be created.
    pub fn create(folder: &Path, scene: &Scene) -> Result<Self, RecordError> {
        // The first file creates the folder.
        let trajectory = Trajectory::of_scene(folder, scene)?;
        let names = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        Ok(Self {
            folder: folder.to_path_buf(),
            trajectory,
            packets: Packets::create(folder, names)?,
            task: TaskRecord::create(folder, scene)?,
            pictures: Pictures::new(scene),
            size: Size::default(),
        })
    }

    /// Sets the size of the pictures. The default is a page on a screen.
    #[must_use]
    pub fn sized(self, size: Size) -> Self {
        Self { size, ..self }
    }

    /// Writes the remaining files, gives every file its name, and returns the paths.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if a file cannot be written.
    pub fn finish(self, summary: &Summary) -> Result<Vec<PathBuf>, RecordError> {
        self.finish_with_pictures(summary).map(|(files, _)| files)
    }

    /// Like [`finish`](Self::finish), and also returns the pictures with the names of their files.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if a file cannot be written.
    pub fn finish_with_pictures(self, summary: &Summary) -> Result<(Vec<PathBuf>, Vec<RecordedPicture>), RecordError> {
        let Self { folder, trajectory, packets, task, pictures, size } = self;
        // Records are completed first: an error in writing a picture leaves the records whole.
        let mut files = vec![trajectory.finish()?, packets.finish()?, links::write(&folder, summary)?];
        if let Some(task) = task {
            files.extend(task.finish(summary)?);
        }
        let pictures = pictures.drawn(size);
        for (file, svg) in &pictures {
            files.push(plot::write(folder.join(file), svg)?);
        }
        Ok((files, pictures))
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
        if let Some(task) = &mut self.task {
            task.on_tick(row)?;
        }
        let Ok(()) = self.pictures.on_tick(row);
        self.trajectory.on_tick(row)
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), RecordError> {
        let Ok(()) = self.pictures.on_packet(row);
        self.packets.on_packet(row)
    }
}
