//! What the tables say of the machine, and how they measure time on it.

use std::hint::black_box;
use std::process::Command;
use std::time::Duration;

use cohaptic_benches_common::machine::field;
pub use cohaptic_benches_common::machine::{process_time, thread_time};

/// The processor time of this thread that the work takes: what else the machine does counts less.
pub fn time(work: impl FnOnce()) -> Duration {
    let start = thread_time();
    work();
    thread_time() - start
}

/// The date, the processor, its cores, the system, the compiler and the program: what a figure is of. What cannot be found out is left out.
#[must_use]
pub fn line() -> String {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut parts = vec![said("date", &["-u", "+%F"]).unwrap_or_else(|| "an unknown day".to_owned())];
    parts.push(field("/proc/cpuinfo", "model name").unwrap_or_else(|| format!("a processor of the kind {}", std::env::consts::ARCH)));
    parts.push(if cores == 1 { "1 core".to_owned() } else { format!("{cores} cores") });
    parts.extend(std::fs::read_to_string("/proc/sys/kernel/osrelease").map(|system| format!("Linux {}", system.trim())));
    parts.extend(said("rustc", &["--version"]).and_then(|version| Some(format!("rustc {}", version.split(' ').nth(1)?))));
    let program = format!("cohaptic {}", env!("CARGO_PKG_VERSION"));
    parts.push(match commit() {
        Some(commit) => format!("{program} at commit {commit}"),
        None => program,
    });
    if cfg!(debug_assertions) {
        parts.push("built without `--release`, so that its figures say nothing of its speed".to_owned());
    }
    parts.join(", ")
}

/// The commit, and whether anything but pages has changed since.
fn commit() -> Option<String> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let commit = said("git", &["-C", root, "rev-parse", "--short=10", "HEAD"])?;
    let changes = said("git", &["-C", root, "status", "--porcelain", "--untracked-files=no", "--", ":!docs"])?;
    Some(if changes.is_empty() { commit } else { format!("{commit} and changes") })
}

/// The day on which a page in `docs/` was last written, a new name not counted; `None` outside of the repository.
#[must_use]
pub fn last_change(page: &str) -> Option<String> {
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs");
    said("git", &["-C", docs, "log", "-1", "--follow", "--diff-filter=AM", "--format=%cs", "--", page]).filter(|date| !date.is_empty())
}

/// What a program says that succeeds.
fn said(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

/// The most memory that this process has held.
#[must_use]
pub fn peak_memory() -> String {
    field("/proc/self/status", "VmHWM").unwrap_or_else(|| "not told by this system".into())
}

/// The memory that this process holds beside its program and libraries.
#[must_use]
pub fn own_memory() -> String {
    field("/proc/self/status", "RssAnon").unwrap_or_else(|| "not told by this system".into())
}

/// The median processor time of each work in a number of rounds, in which all take turns: a noisy moment hits all of them, and no row of a table alone.
#[must_use]
pub fn medians_in_turn<T>(works: &[impl Fn() -> T], rounds: usize) -> Vec<Duration> {
    let mut times = vec![Vec::new(); works.len()];
    for _ in 0..rounds.max(1) {
        for (work, times) in works.iter().zip(&mut times) {
            times.push(time(|| drop(black_box(work()))));
        }
    }
    times.into_iter().map(median).collect()
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
