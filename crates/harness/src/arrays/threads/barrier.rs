//! A barrier for threads with thousands of meetings a second.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Number of looks of a waiting thread before the thread yields the processor.
const LOOKS: u32 = 10_000;

/// Meeting point of a fixed number of threads, again and again. Waiting threads spin, because most waits are shorter than a system call.
#[derive(Debug)]
pub(super) struct Barrier {
    threads: usize,
    /// Number of threads arrived at the present meeting.
    arrived: AtomicUsize,
    /// Number of meetings so far. A change of the number releases the waiting threads.
    meetings: AtomicUsize,
    /// `true` if a thread panicked. Nobody must wait for this thread.
    is_broken: AtomicBool,
}

/// Breaks a barrier when a panicking thread drops the guard, so no thread waits for ever.
pub(super) struct Guard<'a>(&'a Barrier);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.is_broken.store(true, Ordering::Relaxed);
        }
    }
}

impl Barrier {
    pub(super) const fn new(threads: usize) -> Self {
        Self { threads, arrived: AtomicUsize::new(0), meetings: AtomicUsize::new(0), is_broken: AtomicBool::new(false) }
    }

    pub(super) const fn guard(&self) -> Guard<'_> {
        Guard(self)
    }

    /// Waits until all threads have called this function. All writes of a thread before the call are visible to all threads after the call.
    ///
    /// # Panics
    ///
    /// If another thread panicked.
    pub(super) fn wait(&self) {
        // Read before the arrival is counted: after that, the last thread may end this meeting at any time.
        let meeting = self.meetings.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.threads {
            // The count is reset before the release, so a released thread is counted for the next meeting when the thread arrives again.
            self.arrived.store(0, Ordering::Relaxed);
            self.meetings.store(meeting.wrapping_add(1), Ordering::Release);
            return;
        }
        let mut looks = 0;
        while self.meetings.load(Ordering::Acquire) == meeting {
            assert!(!self.is_broken.load(Ordering::Relaxed), "another thread of this run panicked");
            if looks < LOOKS {
                looks += 1;
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use super::*;

    #[test]
    fn no_thread_goes_on_before_all_have_come() {
        const THREADS: u64 = 3;
        let (barrier, counter) = (Barrier::new(3), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for _ in 0..THREADS {
                scope.spawn(|| {
                    for meeting in 1..=500 {
                        counter.fetch_add(1, Ordering::Relaxed);
                        barrier.wait();
                        assert_eq!(counter.load(Ordering::Relaxed), meeting * THREADS);
                        barrier.wait();
                    }
                });
            }
        });
    }

    #[test]
    fn a_thread_that_waits_for_one_that_panics_panics_too() {
        let barrier = Barrier::new(2);
        let panics = std::thread::scope(|scope| {
            let broken = scope.spawn(|| {
                let _guard = barrier.guard();
                std::panic::resume_unwind(Box::new("it is meant to"));
            });
            let waiting = scope.spawn(|| barrier.wait());
            [broken.join().is_err(), waiting.join().is_err()]
        });
        assert_eq!(panics, [true, true]);
    }
}
