//! What the page says of the machine, and what it reads from it.

use std::time::Duration;

use cohaptic_benches_common::machine::field;
pub use cohaptic_benches_common::machine::{name, process_time, thread_time};

/// The memory that this process holds now \[kB\].
#[must_use]
pub fn memory() -> u64 {
    let text = field("/proc/self/status", "VmRSS").unwrap_or_default();
    text.split_whitespace().next().and_then(|number| number.parse().ok()).unwrap_or(0)
}

/// How many files this process has open now: the least of a few looks, since a thread may have one of `/proc` open for a moment.
#[must_use]
pub fn open_files() -> usize {
    // One is the folder itself, while it is read.
    let count = || std::fs::read_dir("/proc/self/fd").map_or(0, |files| files.count().saturating_sub(1));
    let look = |_| {
        std::thread::sleep(Duration::from_millis(2));
        count()
    };
    (0..3).map(look).min().unwrap_or(0)
}
