//! `releases.csv`, when each datagram to another program was due and how late it was sent, and `lateness.csv`, the histograms of a session.

use std::path::{Path, PathBuf};
use std::time::Duration;

use cohaptic_harness::record::{RecordError, RecordFile};
use cohaptic_realtime::Lateness;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;

/// A datagram that was sent to a peer in another program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Release {
    /// The receiver.
    pub(crate) to: usize,
    /// When the network had delivered it: when it was due.
    pub(crate) due: Instant,
    /// From then until it was handed to the system.
    pub(crate) late: Duration,
}

/// Columns `peer,due,late_us`, in the order of sending. It left at `due + late_us`.
#[derive(Debug)]
pub(super) struct Releases {
    file: RecordFile,
    names: Vec<String>,
}

impl Releases {
    pub(super) fn create(folder: &Path, scene: &Scene) -> Result<Self, RecordError> {
        let mut file = RecordFile::create(folder.join("releases.csv"))?;
        file.write(b"peer,due,late_us\n")?;
        Ok(Self { file, names: scene.peers.iter().map(|peer| peer.name.clone()).collect() })
    }

    pub(super) fn write(&mut self, row: &Release) -> Result<(), RecordError> {
        let nanos = row.late.as_nanos();
        let line = format!("{},{},{}.{:03}\n", self.names[row.to], Seconds(row.due), nanos / 1000, nanos % 1000);
        self.file.write(line.as_bytes())
    }

    pub(super) fn finish(self) -> Result<PathBuf, RecordError> {
        self.file.finish()
    }
}

/// Columns `of,late_us,count`: the number of ticks, or releases, of a lateness, to three digits.
pub(super) fn write_lateness(folder: &Path, ticks: &Lateness, releases: &Lateness) -> Result<PathBuf, RecordError> {
    let mut file = RecordFile::create(folder.join("lateness.csv"))?;
    file.write(b"of,late_us,count\n")?;
    for (of, lateness) in [("tick", ticks), ("release", releases)] {
        for (late, count) in lateness.recorded() {
            let nanos = late.as_nanos();
            file.write(format!("{of},{}.{:03},{count}\n", nanos / 1000, nanos % 1000).as_bytes())?;
        }
    }
    file.finish()
}
