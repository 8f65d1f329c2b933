//! The settings of a run.

use std::sync::Arc;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::again::Said;
use crate::hit::Laws;

/// The settings of a run.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// How many bytes of datagrams a socket holds that have not been read.
    pub(crate) receive_buffer: usize,
    /// Whether events are recorded.
    pub(crate) traces: bool,
    /// Whether the events have digests of the packets' bytes.
    pub(crate) digests: bool,
    /// Whether packets are recorded, with their bytes.
    pub(crate) keeps_packets: bool,
    /// How often tasks may be polled, or packets and timers handled, at one instant.
    pub(crate) patience: u64,
    /// How many bytes the run may hold.
    pub(crate) byte_limit: u64,
    /// Limits beyond which a run is given up.
    pub(crate) limits: Limits,
    /// The network in the words of the test.
    pub(crate) said: Arc<Said>,
    /// Which packets are hit.
    pub(crate) laws: Laws,
}

/// Limits of a run, beyond which it is given up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Limits {
    /// Time of the run.
    pub(crate) time: Duration,
    /// Polls of its tasks.
    pub(crate) steps: u64,
}

/// Longer than any test means to run. A program that asks five times a second has asked 18,000 times by then, which takes a tenth of a second.
const TIME: Duration = Duration::from_secs(3600);

/// A number of polls that takes some seconds by the wall clock.
const STEPS: u64 = 20_000_000;

impl Default for Limits {
    fn default() -> Self {
        Self { time: TIME, steps: STEPS }
    }
}

/// The limit that a run has reached.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reached {
    Time(Duration),
    Steps(u64),
}

impl Limits {
    /// The last instant of a run.
    pub(crate) fn until(self) -> Instant {
        Instant::ZERO.saturating_add(self.time)
    }

    /// Returns the limit that a run has reached which goes on after this number of steps.
    pub(crate) const fn reached(self, steps: u64) -> Reached {
        if steps > self.steps { Reached::Steps(self.steps) } else { Reached::Time(self.time) }
    }
}
