//! What work costs.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// The processor time of this thread that one round of work takes: the median of `rounds`, since a machine that others use too is slow now and then.
pub(crate) fn median_time<T>(rounds: usize, mut work: impl FnMut() -> T) -> Duration {
    let times = (0..rounds.max(1)).map(|_| {
        let start = processor_time();
        std::hint::black_box(work());
        processor_time() - start
    });
    median(times.collect())
}

/// The processor time that this thread has used.
pub(crate) fn processor_time() -> Duration {
    clock_gettime(ClockId::ThreadCPUTime).try_into().expect("processor time is not negative")
}

/// The median of some times, at least one.
pub(crate) fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

/// A span in nanoseconds.
pub(crate) fn nanos(span: Duration) -> f64 {
    span.as_secs_f64() * 1e9
}
