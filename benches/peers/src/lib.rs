//! What the pages of this package have in common.

pub mod link;
pub mod mesh;

/// The processor and the system, as Linux names them.
#[must_use]
pub fn machine() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let processor = model.map_or("an unnamed processor", |(_, name)| name);
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let system = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    format!("{processor}, {cores} cores, Linux {}", system.trim())
}

/// The middle one of an odd number of values.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The processor time that this process has used: what others do on the machine does not count.
#[must_use]
pub fn processor_time() -> std::time::Duration {
    rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime).try_into().unwrap_or_default()
}

/// The processor time that some work takes \[s\].
pub fn seconds_of(work: impl FnOnce()) -> f64 {
    let begin = processor_time();
    work();
    (processor_time() - begin).as_secs_f64()
}

/// The version of a crate of others that is built here, from the lock file.
#[must_use]
pub fn version(name: &str) -> &'static str {
    let entry = include_str!("../Cargo.lock").split("[[package]]").find_map(|entry| entry.trim_start().strip_prefix(&format!("name = \"{name}\"\n")));
    entry.and_then(|entry| entry.strip_prefix("version = \"")?.split('"').next()).unwrap_or("of a version that the lock file does not tell")
}

#[cfg(test)]
mod tests {
    #[test]
    fn versions_are_those_of_the_lock_file() {
        for name in ["bach", "nexosim", "str0m-netem", "turmoil"] {
            assert!(super::version(name).split('.').all(|part| part.parse::<u32>().is_ok()), "{name}: {}", super::version(name));
        }
    }
}
