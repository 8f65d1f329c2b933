//! Writing records without making the 1 kHz loop wait for a disk.
//!
//! The loop puts rows of fixed size into a queue that was allocated at the start; a thread of its own takes them out and writes them. If the disk falls so
//! far behind that the queue is full, the loop waits: nothing is lost, and the wait shows in the lateness.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use cohaptic_harness::live::InputRow;
use cohaptic_harness::record::{InputRecorder, RecordError, Recorder};
use cohaptic_harness::{Observer as _, PacketRow, Summary, TickRow};
use cohaptic_realtime::Lateness;
use cohaptic_scene::{Scene, SceneContent};

use super::Recorded;
use super::files::{Release, Releases, write_lateness};
use super::rows::{InputCopy, TickCopy};

/// How many rows may wait: of three peers, ten seconds.
const ROWS: usize = 65_536;

/// Records a live session into a folder: the files of `cohaptic run --out`, what came from outside, and how late everything was.
#[derive(Debug)]
pub(crate) struct Recording {
    folder: PathBuf,
    rows: SyncSender<Row>,
    writer: JoinHandle<Result<Files, RecordError>>,
    has_others: bool,
}

#[derive(Debug)]
enum Row {
    Tick(TickCopy),
    Packet(PacketRow),
    Input(InputCopy),
    Release(Release),
}

/// The files that grow while the session lasts.
#[derive(Debug)]
struct Files {
    inputs: InputRecorder,
    /// Those that can be made again from the inputs, and how late everything was.
    others: Option<(Recorder, Releases)>,
}

/// The writer could not write; [`Recording::finish`] says why.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Stopped;

impl Recording {
    /// Begins to record.
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

    /// Writes the rest and gives every file its name; gives the files.
    pub(crate) fn finish(self, summary: &Summary, ticks: &Lateness, releases: &Lateness) -> Result<Vec<PathBuf>, RecordError> {
        drop(self.rows);
        let files = self.writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        let Some((recorder, sent)) = files.others else { return Ok(vec![files.inputs.finish()?]) };
        let mut written = recorder.finish(summary)?;
        written.push(files.inputs.finish()?);
        written.push(sent.finish()?);
        written.push(write_lateness(&self.folder, ticks, releases)?);
        Ok(written)
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

    fn put(&self, row: Row) -> Result<(), Stopped> {
        // The writer takes rows until it cannot write.
        self.rows.send(row).map_err(|_| Stopped)
    }
}

impl Files {
    fn write(mut self, rows: &Receiver<Row>, axes: usize) -> Result<Self, RecordError> {
        for row in rows {
            match (row, &mut self.others) {
                (Row::Input(row), _) => self.inputs.on_input(&row.borrowed(axes))?,
                (Row::Tick(row), Some((recorder, _))) => recorder.on_tick(&row.borrowed(axes))?,
                (Row::Packet(row), Some((recorder, _))) => recorder.on_packet(&row)?,
                (Row::Release(row), Some((_, releases))) => releases.write(&row)?,
                (Row::Tick(_) | Row::Packet(_) | Row::Release(_), None) => {}
            }
        }
        Ok(self)
    }
}
