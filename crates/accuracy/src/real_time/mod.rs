//! Release of packets by the wall clock: processor time per packet against lateness, with sleeping and with busy waiting.
//!
//! A [`Link`](cohaptic_wan::Link) computes the instant at which each packet leaves, and a thread waits for that instant. Both numbers are measured, not
//! computed, on this machine with its other load. The ways take turns, so that other load affects all ways.

mod release;

use std::time::Duration;

use self::release::{Releases, Way};
use crate::watch::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// Amount of work in the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Effort {
    /// Number of turns of each way.
    pub rounds: u32,
    /// Length of a turn \[ms\].
    pub turn_millis: u64,
}

impl Effort {
    /// Effort of six seconds.
    pub const QUICK: Self = Self { rounds: 2, turn_millis: 300 };

    /// Effort of a minute.
    pub const FULL: Self = Self { rounds: 6, turn_millis: 1000 };
}

/// Measures the rows of this subject.
///
/// # Errors
///
/// The errors of [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut all: Vec<Releases> = Way::ALL.into_iter().map(Releases::new).collect();
    // All ways take a turn in each round, with the same seed, so that each way releases the same packets.
    for round in 0..effort.rounds {
        for releases in &mut all {
            if watch.stops() {
                return Err(AccuracyError::Stopped);
            }
            releases.turn(u64::from(round), Duration::from_millis(effort.turn_millis))?;
        }
    }
    let mut sink = RowSink { rows: Vec::new(), watch };
    all.iter().flat_map(rows_of).try_for_each(|row| sink.push(row))?;
    Ok(sink.rows)
}

/// Returns the rows of one way: median and 99 % of the lateness.
fn rows_of(releases: &Releases) -> [Row; 2] {
    let summary = releases.lateness.summary();
    let note =
        format!("measured over {} packets, one a millisecond; the latest {:.0} µs; {}", summary.count, micros(summary.max), releases.way.words());
    let cost = micros(releases.processor) / f64::from(u32::try_from(summary.count.max(1)).unwrap_or(u32::MAX));
    let cost = (cost, "µs of processor time a packet");
    let row = |error: Duration, error_unit| Row {
        error: Some(micros(error)),
        error_unit,
        reference: "the instant at which the link lets it go",
        note: note.clone(),
        ..Row::of(Subject::RealTime, "release of 24 packets under way", releases.way.name(), releases.way.setting(), cost)
    };
    [row(summary.p50, "lateness, median [µs]"), row(summary.p99, "lateness, 99 % [µs]")]
}

fn micros(span: Duration) -> f64 {
    span.as_secs_f64() * 1e6
}
