//! Monotonic wall clock. No other file of this crate reads a clock of the machine.
#![expect(clippy::disallowed_methods, reason = "a real device lives in real time; everything but this file takes time as an argument")]

use std::thread;
use std::time;

use cohaptic_units::Instant;

/// Monotonic clock of the machine, with zero at the call of `new`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallClock {
    beginning: time::Instant,
}

impl WallClock {
    pub(crate) fn new() -> Self {
        Self { beginning: time::Instant::now() }
    }

    pub(crate) fn now(&self) -> Instant {
        Instant::ZERO.saturating_add(self.beginning.elapsed())
    }

    pub(crate) fn sleep_until(&self, until: Instant) {
        let rest = until.saturating_duration_since(self.now());
        if !rest.is_zero() {
            thread::sleep(rest);
        }
    }
}
