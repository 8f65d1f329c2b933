//! What the page says of the machine, and what it reads from it.

use std::time::Duration;

use cohaptic_benches_common::machine::field;
pub use cohaptic_benches_common::machine::{name, process_time, thread_time};

/// The memory that this process holds now \[kB\].
#[must_use]
pub fn memory() -> u64 {
    memory_of("self")
}

/// The memory that a process holds now \[kB\]: its number, or `self`. 0 if it has ended.
#[must_use]
pub fn memory_of(process: &str) -> u64 {
    let text = field(&format!("/proc/{process}/status"), "VmRSS").unwrap_or_default();
    text.split_whitespace().next().and_then(|number| number.parse().ok()).unwrap_or(0)
}

/// How many files this process has open now: the least of a few looks, since a thread may have one of `/proc` open for a moment.
#[must_use]
pub fn open_files() -> usize {
    // One is the folder itself, while it is read.
    let count = || open_files_of("self").saturating_sub(1);
    let look = |_| {
        std::thread::sleep(Duration::from_millis(2));
        count()
    };
    (0..3).map(look).min().unwrap_or(0)
}

/// How many files a process has open now: its number, or `self`. 0 if it has ended.
#[must_use]
pub fn open_files_of(process: &str) -> usize {
    std::fs::read_dir(format!("/proc/{process}/fd")).map_or(0, Iterator::count)
}

/// What the processors of this machine did so far, by the kernel's count of ticks.
#[derive(Clone, Copy, Debug)]
pub struct Processors {
    stolen: u64,
    all: u64,
}

impl Processors {
    /// Reads it; nothing if the system does not tell.
    #[must_use]
    pub fn read() -> Self {
        let text = std::fs::read_to_string("/proc/stat").unwrap_or_default();
        // user, nice, system, idle, iowait, irq, softirq, steal; what follows is contained in the first two.
        let ticks: Vec<u64> =
            text.lines().next().unwrap_or_default().split_whitespace().skip(1).take(8).filter_map(|ticks| ticks.parse().ok()).collect();
        Self { stolen: ticks.get(7).copied().unwrap_or(0), all: ticks.iter().sum() }
    }

    /// The share of the processors' time since then that the host of a virtual machine gave to others.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "counts of ticks")]
    pub fn stolen_since(self) -> f64 {
        let now = Self::read();
        now.stolen.saturating_sub(self.stolen) as f64 / now.all.saturating_sub(self.all).max(1) as f64
    }
}
