//! `lateness.csv`: the histograms of a session.

use std::path::{Path, PathBuf};

use cohaptic_harness::record::{RecordError, RecordFile};
use cohaptic_realtime::Lateness;

/// Columns `of,late_us,count`: the number of ticks, or releases, of a lateness, to three digits.
pub(super) fn write(folder: &Path, ticks: &Lateness, releases: &Lateness) -> Result<PathBuf, RecordError> {
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
