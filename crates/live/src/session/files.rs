//! Two files of the record: `releases.csv` has a row for each datagram sent to another program, with deadline and lateness. `lateness.csv` has the histograms
//! of the lateness of ticks and releases.

use std::path::{Path, PathBuf};
use std::time::Duration;

use cohaptic_harness::record::{RecordError, RecordFile};
use cohaptic_realtime::Lateness;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;

/// One sample sent to a peer in another program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Release {
    /// Receiver, as index of a peer in the scene.
    pub(crate) to: usize,
    /// Instant at which the emulated network delivered the sample, in logical time: the deadline of sending.
    pub(crate) due: Instant,
    /// Time from `due` to the instant at which the sample was sealed and queued for the kernel.
    pub(crate) late: Duration,
}

/// Writer of `releases.csv`, with columns `peer,due,late_us` and rows in the order of sending. A datagram left at `due + late_us`.
#[derive(Debug)]
pub(super) struct Releases {
    file: RecordFile,
    /// Names of the peers, indexed by peer.
    names: Vec<String>,
}

impl Releases {
    pub(super) fn create(folder: &Path, scene: &Scene) -> Result<Self, RecordError> {
        let mut file = RecordFile::create(folder.join("releases.csv"))?;
        file.write(b"peer,due,late_us\n")?;
        Ok(Self { file, names: scene.peers.iter().map(|peer| peer.name.clone()).collect() })
    }

    pub(super) fn write(&mut self, row: &Release) -> Result<(), RecordError> {
        // Microseconds with three decimals, computed in whole nanoseconds, so that no digit is rounded.
        let nanos = row.late.as_nanos();
        let line = format!("{},{},{}.{:03}\n", self.names[row.to], Seconds(row.due), nanos / 1000, nanos % 1000);
        self.file.write(line.as_bytes())
    }

    pub(super) fn finish(self) -> Result<PathBuf, RecordError> {
        self.file.finish()
    }
}

/// Writes `lateness.csv`, with columns `of,late_us,count`: number of ticks or other events per lateness, for each named histogram. Latenesses are rounded to
/// three digits by the histogram.
pub(crate) fn write_lateness(folder: &Path, histograms: &[(&str, &Lateness)]) -> Result<PathBuf, RecordError> {
    let mut file = RecordFile::create(folder.join("lateness.csv"))?;
    file.write(b"of,late_us,count\n")?;
    for (of, lateness) in histograms {
        for (late, count) in lateness.recorded() {
            let nanos = late.as_nanos();
            file.write(format!("{of},{}.{:03},{count}\n", nanos / 1000, nanos % 1000).as_bytes())?;
        }
    }
    file.finish()
}
