//! One look, as a row of the table.

use core::fmt;
use std::time::Duration;

use cohaptic_realtime::LatenessSummary;

use super::live::{Lag, LiveLook};
use super::stream::StreamLook;
use crate::machine;

/// What was seen at one look. Quantiles are those since the beginning, means those since the look before.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// When.
    pub at: Duration,
    /// The memory that the process holds \[kB\].
    pub memory: u64,
    /// Open files.
    pub files: usize,
    /// The logical time of the session.
    pub logical: Duration,
    /// How far that was from the wall since the look before.
    pub lag: Lag,
    /// How late ticks were, and their mean.
    pub ticks: (LatenessSummary, Duration),
    /// How late datagrams to the visitor were.
    pub releases: (LatenessSummary, Duration),
    /// How late the relay's datagrams were.
    pub relay: (LatenessSummary, Duration),
    /// Packets on their way in the session, and in the relay.
    pub held: [u64; 2],
    /// Packets that the session's links, and the relay's, were offered.
    pub offered: [u64; 2],
    /// Of these, dropped by the links.
    pub dropped: [u64; 2],
}

/// The head of the table.
pub const HEADER: &str = "| after | memory \\[kB\\] | files | logical time \\[s\\] | wall − logical: least, most \\[µs\\] | behind | tick: mean, p50, p99, p99.9, max \\[µs\\] | to the visitor: mean, p50, p99, p99.9, max \\[µs\\] | relay: mean, p50, p99, p99.9, max \\[µs\\] | on their way: session, relay | packets: session, relay | lost: session, relay |
| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |";

impl Row {
    pub(super) fn new(at: Duration, live: &LiveLook, stream: &StreamLook, before: Option<&Self>) -> Self {
        let status = &live.status;
        let with_mean = |now: LatenessSummary, before: Option<LatenessSummary>| {
            let before = before.unwrap_or_default();
            let count = u32::try_from(now.count - before.count).unwrap_or(u32::MAX);
            (now, (now.sum - before.sum).checked_div(count).unwrap_or_default())
        };
        let of_session = |count: fn(&cohaptic_live::LinkStatus) -> u64| status.links.iter().map(count).sum();
        Self {
            at,
            memory: machine::memory(),
            files: machine::open_files(),
            logical: status.elapsed,
            lag: live.lag,
            ticks: with_mean(status.ticks, before.map(|row| row.ticks.0)),
            releases: with_mean(status.releases, before.map(|row| row.releases.0)),
            relay: with_mean(stream.release, before.map(|row| row.relay.0)),
            held: [of_session(|link| link.stats.in_flight()), stream.held],
            offered: [of_session(|link| link.stats.offered()), stream.intake.offered],
            dropped: [of_session(|link| link.stats.dropped_in_all()), stream.dropped],
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at, memory, files, logical, lag, ticks, releases, relay, held, offered, dropped } = self;
        let clock = at.as_secs();
        write!(f, "| {}:{:02}:{:02} | {memory} | {files} | {:.3} ", clock / 3600, clock / 60 % 60, clock % 60, logical.as_secs_f64())?;
        write!(f, "| {}, {} | {} of {} ", lag.least_at_most / 1000, lag.most / 1000, lag.behind, lag.looks)?;
        for (lateness, mean) in [ticks, releases, relay] {
            let LatenessSummary { p50, p99, p999, max, .. } = lateness;
            write!(f, "| {}, {}, {}, {}, {} ", mean.as_micros(), p50.as_micros(), p99.as_micros(), p999.as_micros(), max.as_micros())?;
        }
        let [session, stream] = held;
        write!(f, "| {session}, {stream} | {}, {} | {}, {} |", offered[0], offered[1], dropped[0], dropped[1])
    }
}
