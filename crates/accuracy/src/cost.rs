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

/// How long and how often something is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Rounds {
    /// How many; the median counts.
    pub(crate) count: usize,
    /// A round repeats the work until it takes about so long: far more than reading a clock.
    pub(crate) span: Duration,
}

/// Something whose cost is measured.
pub(crate) type Work<'a> = Box<dyn FnMut() + 'a>;

impl Rounds {
    /// The processor time that each work takes once: the median of rounds in which all take turns.
    pub(crate) fn medians(self, works: &mut [Work<'_>]) -> Vec<Duration> {
        let repetitions: Vec<u32> = works.iter_mut().map(|work| self.repetitions(work)).collect();
        let mut times = vec![Vec::new(); works.len()];
        for _ in 0..self.count.max(1) {
            for ((work, times), repetitions) in works.iter_mut().zip(&mut times).zip(&repetitions) {
                let start = processor_time();
                (0..*repetitions).for_each(|_| work());
                times.push((processor_time() - start) / *repetitions);
            }
        }
        times.into_iter().map(median).collect()
    }

    /// How often it fits into the span, at least once. The first time is not counted: it fills caches.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and a million")]
    fn repetitions(self, work: &mut Work<'_>) -> u32 {
        work();
        let start = processor_time();
        work();
        let once = (processor_time() - start).as_secs_f64();
        (self.span.as_secs_f64() / once.max(1e-7)).clamp(1.0, 1e6) as u32
    }
}
