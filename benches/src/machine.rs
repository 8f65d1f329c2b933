//! What the tables say of the machine, and how they measure time on it.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// The processor time of this thread that the work takes: what else the machine does counts less.
pub fn time(work: impl FnOnce()) -> Duration {
    let start = processor_time();
    work();
    processor_time() - start
}

/// The processor time that this thread has used.
///
/// # Panics
///
/// Never: processor time is not negative.
#[must_use]
pub fn processor_time() -> Duration {
    clock_gettime(ClockId::ThreadCPUTime).try_into().expect("processor time is not negative")
}

/// The processor time that all threads of this process have used.
///
/// # Panics
///
/// Never: processor time is not negative.
#[must_use]
pub fn process_time() -> Duration {
    clock_gettime(ClockId::ProcessCPUTime).try_into().expect("processor time is not negative")
}

/// The processor as Linux names it.
#[must_use]
pub fn processor() -> String {
    field("/proc/cpuinfo", "model name").unwrap_or_else(|| "an unnamed processor".into())
}

/// The most memory that this process has held.
#[must_use]
pub fn peak_memory() -> String {
    field("/proc/self/status", "VmHWM").unwrap_or_else(|| "not told by this system".into())
}

/// The median of some times.
///
/// # Panics
///
/// If there is none.
#[must_use]
pub fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

fn field(file: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
