//! What the pages of this package have in common.

pub mod link;
pub mod mesh;

pub use cohaptic_benches_common::machine::{name as machine, process_time as processor_time};

/// The middle one of an odd number of values.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
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
