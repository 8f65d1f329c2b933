//! Record of a joined peer, written by a thread of its own: the thread with the deadlines never waits for a disk.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use cohaptic_harness::TickRow;
use cohaptic_harness::record::{RecordError, Trajectory};
use cohaptic_realtime::Lateness;
use cohaptic_scene::Scene;

use crate::session::{TickCopy, write_lateness};

/// Capacity of the queue \[rows\]: about a minute of a tick of 1 ms.
const ROWS: usize = 65_536;

/// Writer of `trajectory.csv`, with the rows of the joined peer in time since tick 0, and of `lateness.csv`.
#[derive(Debug)]
pub(super) struct Recording {
    folder: PathBuf,
    /// Sending end of the queue. Dropping this end tells the writer to finish.
    rows: SyncSender<TickCopy>,
    writer: JoinHandle<Result<Trajectory, RecordError>>,
}

impl Recording {
    /// Creates the folder and the file, and starts the writer.
    pub(super) fn create(folder: &Path, scene: &Scene) -> Result<Self, RecordError> {
        let trajectory = Trajectory::of_scene(folder, scene)?;
        let axes = scene.axes.count();
        let (rows, waiting) = sync_channel(ROWS);
        let writer = thread::spawn(move || write(trajectory, &waiting, axes));
        Ok(Self { folder: folder.to_path_buf(), rows, writer })
    }

    /// Queues a row. Waits while the queue is full. Returns whether the writer still writes.
    pub(super) fn tick(&self, row: &TickRow<'_>) -> bool {
        self.rows.send(TickCopy::of(row)).is_ok()
    }

    /// Writes the rest and returns the paths of the files, or the first error of the writer.
    pub(super) fn finish(self, ticks: &Lateness) -> Result<Vec<PathBuf>, RecordError> {
        // The writer ends when the queue is closed and empty, so that the queue must be closed before the thread is joined.
        drop(self.rows);
        let trajectory = self.writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        Ok(vec![trajectory.finish()?, write_lateness(&self.folder, &[("tick", ticks)])?])
    }
}

/// Writes rows until the queue is closed, or until the file cannot be written.
fn write(mut trajectory: Trajectory, rows: &Receiver<TickCopy>, axes: usize) -> Result<Trajectory, RecordError> {
    for row in rows {
        trajectory.on_tick(&row.borrowed(axes))?;
    }
    Ok(trajectory)
}
