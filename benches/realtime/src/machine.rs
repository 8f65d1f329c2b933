//! What the page says of the machine, and what it reads from it.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// The processor and the system, as Linux names them.
#[must_use]
pub fn name() -> String {
    let processor = field("/proc/cpuinfo", "model name").unwrap_or_else(|| "an unnamed processor".into());
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let system = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    format!("{processor}, {cores} cores, Linux {}", system.trim())
}

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

/// The processor time that this thread has used.
#[must_use]
pub fn thread_time() -> Duration {
    clock_gettime(ClockId::ThreadCPUTime).try_into().unwrap_or_default()
}

/// The processor time that all threads of this process have used.
#[must_use]
pub fn process_time() -> Duration {
    clock_gettime(ClockId::ProcessCPUTime).try_into().unwrap_or_default()
}

fn field(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
