//! What pages say of the machine, and how they measure time on it.

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

/// The processor time that this thread has used: what else the machine does counts less.
#[must_use]
pub fn thread_time() -> Duration {
    clock_gettime(ClockId::ThreadCPUTime).try_into().unwrap_or_default()
}

/// The processor time that all threads of this process have used.
#[must_use]
pub fn process_time() -> Duration {
    clock_gettime(ClockId::ProcessCPUTime).try_into().unwrap_or_default()
}

/// What a file of the system says behind a name and a colon.
#[must_use]
pub fn field(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
