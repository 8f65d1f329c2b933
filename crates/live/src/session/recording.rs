//! Record of a session, written by a thread of its own, so that the thread with the deadlines never waits for a disk.
//!
//! The loop puts rows of fixed size into a bounded queue; the writer takes the rows out and writes them to the files. If the disk falls so far behind that the
//! queue is full, the loop waits: no row is lost, and the wait shows in the lateness.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use cohaptic_harness::live::InputRow;
use cohaptic_harness::record::{InputRecorder, RecordError, RecordedPicture, Recorder};
use cohaptic_harness::{Observer as _, PacketRow, Summary, TickRow};
use cohaptic_realtime::Lateness;
use cohaptic_scene::{Scene, SceneContent};

use super::Recorded;
use super::files::{Release, Releases, write_lateness};
use super::rows::{InputCopy, TickCopy};

/// Capacity of the queue \[rows\]: about ten seconds of a session of three peers.
const ROWS: usize = 65_536;

/// Record of a live session in a folder: the files of `cohaptic run --out`, the inputs from outside, and the lateness of ticks and releases.
#[derive(Debug)]
pub(crate) struct Recording {
    /// Folder of the files, needed for `lateness.csv` at the end.
    folder: PathBuf,
    /// Sending end of the queue. Dropping this end tells the writer to finish.
    rows: SyncSender<Row>,
    /// Thread of the writer, which returns the files once the queue is closed and empty.
    writer: JoinHandle<Result<Files, RecordError>>,
    /// `true` if other files than `inputs.csv` are written. Rows for other files are not even queued otherwise.
    has_others: bool,
}

/// One row in the queue, with copies of all borrowed numbers.
#[derive(Debug)]
enum Row {
    Tick(TickCopy),
    Packet(PacketRow),
    Input(InputCopy),
    Release(Release),
}

/// Files that grow while the session lasts.
#[derive(Debug)]
struct Files {
    inputs: InputRecorder,
    /// Files other than `inputs.csv`: the record that a replay can compute again, and the releases. `None` with [`Recorded::Inputs`].
    others: Option<(Recorder, Releases)>,
}

/// Marks that the writer has ended because a file could not be written. [`Recording::finish`] returns the error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stopped;

impl Recording {
    /// Creates the files and starts the writer.
    pub(crate) fn create(folder: &Path, scene: &Scene, content: SceneContent, recorded: Recorded) -> Result<Self, RecordError> {
        let others = match recorded {
            Recorded::All => Some((Recorder::create(folder, scene)?, Releases::create(folder, scene)?)),
            Recorded::Inputs => None,
        };
        let has_others = others.is_some();
        let files = Files { inputs: InputRecorder::create(folder, scene, content)?, others };
        let axes = scene.axes.count();
        let (rows, waiting) = sync_channel(ROWS);
        let writer = thread::spawn(move || files.write(&waiting, axes));
        Ok(Self { folder: folder.to_path_buf(), rows, writer, has_others })
    }

    /// Writes the rows that are still queued, then the summary and the lateness, and gives every file its final name. Returns the paths of the files and the
    /// pictures, or the first error of the writer.
    pub(crate) fn finish(
        self,
        summary: &Summary,
        ticks: &Lateness,
        releases: &Lateness,
    ) -> Result<(Vec<PathBuf>, Vec<RecordedPicture>), RecordError> {
        // The writer ends when the queue is closed and empty, so that the queue must be closed before the thread is joined.
        drop(self.rows);
        // A panic of the writer goes on in this thread: the panic is a fault of the program, and not an error of the disk.
        let files = self.writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        let Some((recorder, sent)) = files.others else { return Ok((vec![files.inputs.finish()?], Vec::new())) };
        let (mut written, pictures) = recorder.finish_with_pictures(summary)?;
        written.push(files.inputs.finish()?);
        written.push(sent.finish()?);
        written.push(write_lateness(&self.folder, &[("tick", ticks), ("release", releases)])?);
        Ok((written, pictures))
    }

    pub(crate) fn tick(&self, row: &TickRow<'_>) -> Result<(), Stopped> {
        if self.has_others { self.put(Row::Tick(TickCopy::of(row))) } else { Ok(()) }
    }

    pub(crate) fn packet(&self, row: &PacketRow) -> Result<(), Stopped> {
        if self.has_others { self.put(Row::Packet(*row)) } else { Ok(()) }
    }

    pub(crate) fn input(&self, row: &InputRow<'_>) -> Result<(), Stopped> {
        self.put(Row::Input(InputCopy::of(row)))
    }

    pub(crate) fn release(&self, release: Release) -> Result<(), Stopped> {
        if self.has_others { self.put(Row::Release(release)) } else { Ok(()) }
    }

    /// Queues a row. Waits while the queue is full.
    fn put(&self, row: Row) -> Result<(), Stopped> {
        // The receiving end is dropped only if the writer has failed: while `self` lives, the queue is open and the writer goes on.
        self.rows.send(row).map_err(|_| Stopped)
    }
}

impl Files {
    /// Writes rows until the queue is closed and empty, or until a file cannot be written. `axes`: number of axes of the scene.
    fn write(mut self, rows: &Receiver<Row>, axes: usize) -> Result<Self, RecordError> {
        for row in rows {
            match (row, &mut self.others) {
                (Row::Input(row), _) => self.inputs.on_input(&row.borrowed(axes))?,
                (Row::Tick(row), Some((recorder, _))) => recorder.on_tick(&row.borrowed(axes))?,
                (Row::Packet(row), Some((recorder, _))) => recorder.on_packet(&row)?,
                (Row::Release(row), Some((_, releases))) => releases.write(&row)?,
                // Such rows are not queued without `others`.
                (Row::Tick(_) | Row::Packet(_) | Row::Release(_), None) => {}
            }
        }
        Ok(self)
    }
}
