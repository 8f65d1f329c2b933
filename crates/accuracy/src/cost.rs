//! Measurement of costs, as processor time.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Returns the processor time of this thread for one round of work: the median of `rounds` rounds, because a machine with other users is slow at times.
pub(crate) fn median_time<T>(rounds: usize, mut work: impl FnMut() -> T) -> Duration {
    let times = (0..rounds.max(1)).map(|_| {
        let start = processor_time();
        // Without `black_box` the compiler may leave out work with an unused result.
        std::hint::black_box(work());
        processor_time() - start
    });
    median(times.collect())
}

/// Returns the processor time used by this thread so far.
pub(crate) fn processor_time() -> Duration {
    clock_gettime(ClockId::ThreadCPUTime).try_into().expect("processor time is not negative")
}

/// Returns the median of some times, at least one.
pub(crate) fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

/// Returns a span in nanoseconds.
pub(crate) fn nanos(span: Duration) -> f64 {
    span.as_secs_f64() * 1e9
}

/// Number and length of the rounds of a measurement.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Rounds {
    /// Number of rounds, whose median is the result.
    pub(crate) count: usize,
    /// Approximate length of a round, far longer than a reading of the clock. A round repeats the work to fill this length.
    pub(crate) span: Duration,
}

/// Work whose cost is measured.
pub(crate) type Work<'a> = Box<dyn FnMut() + 'a>;

impl Rounds {
    /// Returns the processor time of one run of each work: the median of rounds in which all works take turns, so that a slow moment of the machine affects
    /// all of them.
    pub(crate) fn medians(self, works: &mut [Work<'_>]) -> Vec<Duration> {
        let repetitions: Vec<u32> = works.iter_mut().map(|work| self.repetitions(work)).collect();
        let mut times = vec![Vec::new(); works.len()];
        for _ in 0..self.count.max(1) {
            // Each round runs every work once, so the rounds of all works cover the same moments of the machine.
            for ((work, times), repetitions) in works.iter_mut().zip(&mut times).zip(&repetitions) {
                let start = processor_time();
                (0..*repetitions).for_each(|_| work());
                times.push((processor_time() - start) / *repetitions);
            }
        }
        times.into_iter().map(median).collect()
    }

    /// Returns how many runs of the work fit into the span, at least one. The first run is not timed, because it fills caches.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and a million")]
    fn repetitions(self, work: &mut Work<'_>) -> u32 {
        work();
        let start = processor_time();
        work();
        let once = (processor_time() - start).as_secs_f64();
        // A clock too coarse for the work may read zero: the least time keeps the quotient finite.
        (self.span.as_secs_f64() / once.max(1e-7)).clamp(1.0, 1e6) as u32
    }
}
