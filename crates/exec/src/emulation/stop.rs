//! End of a run at the wish of another thread.

use core::time::Duration;
use std::io::{self, PipeReader, PipeWriter, Write as _};
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use cohaptic_realtime::{Clock as _, MonotonicClock};

/// Wish of another thread about the end of a run.
#[derive(Debug)]
pub(crate) struct Stop {
    /// [`Stop::GO_ON`], [`Stop::FINISH`] or [`Stop::NOW`].
    wish: AtomicU8,
    /// Latest end after [`Stop::FINISH`] \[ns\].
    end: AtomicU64,
    clock: MonotonicClock,
    /// Pipe that becomes readable with the wish, so that a waiting loop wakes up.
    wakes: PipeWriter,
}

impl Stop {
    const GO_ON: u8 = 0;
    const FINISH: u8 = 1;
    const NOW: u8 = 2;

    /// Returns the way to end a run by its clock, and a pipe that becomes readable with the wish.
    pub(super) fn new(clock: MonotonicClock) -> io::Result<(Self, PipeReader)> {
        let (woken, wakes) = io::pipe()?;
        Ok((Self { wish: AtomicU8::new(Self::GO_ON), end: AtomicU64::new(u64::MAX), clock, wakes }, woken))
    }

    /// Returns whether there is a wish.
    pub(super) fn is_wished(&self) -> bool {
        self.wish.load(Ordering::Acquire) != Self::GO_ON
    }

    /// Returns whether the run has to end. `is_delivered`: whether all data of the hosts has arrived.
    pub(super) fn is_over(&self, is_delivered: impl FnOnce() -> bool) -> bool {
        match self.wish.load(Ordering::Acquire) {
            Self::GO_ON => false,
            Self::FINISH => is_delivered() || self.clock.now().as_nanos() >= self.end.load(Ordering::Relaxed),
            _ => true,
        }
    }

    /// Ends the run when all data of the hosts has arrived beyond the gateway, and at the latest after [`LAST`].
    pub(crate) fn finish(&self) {
        self.end.store(self.clock.now().saturating_add(LAST).as_nanos(), Ordering::Relaxed);
        self.wish(Self::FINISH);
    }

    /// Ends the run.
    pub(crate) fn now(&self) {
        self.wish(Self::NOW);
    }

    fn wish(&self, wish: u8) {
        // Release publishes `end`, stored before, to a loop that sees the wish. The wake-up comes last: a woken loop finds the wish.
        self.wish.fetch_max(wish, Ordering::Release);
        // An ended loop does not read the pipe any more.
        let _ = (&self.wakes).write_all(b"w");
    }
}

/// Time after the end of the commands for the last data on the links.
const LAST: Duration = Duration::from_secs(10);
