//! The part of the state that is read without its lock: the time, and how often a program has called at one instant.

use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;

use crate::current;

/// The time, and the calls since it last passed. The holder of the state writes the time; a call that is lost between two threads counts for nothing.
#[derive(Debug)]
pub(crate) struct Face {
    now: AtomicU64,
    calls: AtomicU64,
    /// How often tasks were polled since it last passed, as far as they are counted here.
    #[cfg(feature = "tokio")]
    polled: AtomicU64,
    /// How often tasks may be polled at one instant.
    #[cfg(feature = "tokio")]
    patience: u64,
    /// How many calls there may be at one instant.
    most_calls: u64,
}

impl Face {
    pub(super) const fn new(patience: u64) -> Self {
        Self {
            now: AtomicU64::new(0),
            calls: AtomicU64::new(0),
            #[cfg(feature = "tokio")]
            polled: AtomicU64::new(0),
            #[cfg(feature = "tokio")]
            patience,
            most_calls: patience.saturating_mul(10),
        }
    }

    #[inline]
    pub(crate) fn now(&self) -> Instant {
        Instant::from_nanos(self.now.load(Ordering::Relaxed))
    }

    /// Time passes.
    #[inline]
    pub(super) fn pass(&self, now: Instant) {
        self.now.store(now.as_nanos(), Ordering::Relaxed);
        self.calls.store(0, Ordering::Relaxed);
        #[cfg(feature = "tokio")]
        self.polled.store(0, Ordering::Relaxed);
    }

    /// A task is polled. Gives the patience if time has stood still for too long.
    #[cfg(feature = "tokio")]
    pub(super) fn count_poll(&self) -> Option<u64> {
        let polled = self.polled.load(Ordering::Relaxed) + 1;
        self.polled.store(polled, Ordering::Relaxed);
        (polled > self.patience).then_some(self.patience)
    }

    /// The program asks for something that takes no time.
    ///
    /// # Panics
    ///
    /// If it has done so for so often since time last passed that it seems to wait for time without letting it pass.
    #[inline]
    pub(crate) fn note_call(&self) {
        if !self.count_call() {
            self.lose_patience(None);
        }
    }

    /// As [`Face::note_call`]; says whether there have not been too many calls.
    #[inline]
    pub(super) fn count_call(&self) -> bool {
        let calls = self.calls.load(Ordering::Relaxed).wrapping_add(1);
        self.calls.store(calls, Ordering::Relaxed);
        calls <= self.most_calls
    }

    /// Fails the run, because time does not pass. `socket` is the one that was called last, in words.
    #[cold]
    #[expect(clippy::panic, reason = "time cannot pass; says who keeps it, why, and the way out")]
    pub(super) fn lose_patience(&self, socket: Option<&str>) -> ! {
        // A value that is dropped while it unwinds may ask again.
        self.calls.store(0, Ordering::Relaxed);
        let who = match (current::task(), socket) {
            (Some(task), Some(socket)) => format!(". It is {task}, which called {socket} last"),
            (Some(task), None) => format!(". It is {task}"),
            (None, Some(socket)) => format!(". It called {socket} last"),
            (None, None) => String::new(),
        };
        panic!(
            "time stands still at {} s: a task asks for the time, sends or tries to receive again and again and never waits; `sleep(..).await` lets it pass{who}",
            Seconds(self.now())
        );
    }
}
