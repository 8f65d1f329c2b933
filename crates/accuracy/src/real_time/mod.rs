//! Leaving on time by the wall clock: processor time a packet against how late it leaves, asleep and awake.
//!
//! A [`Link`](cohaptic_wan::Link) says when each of its packets leaves; something waits for that time. Both numbers are measured and not computed: they
//! are those of this machine with what else it did just then. The ways take turns, so that this hits all of them.

mod release;

use std::time::Duration;

use self::release::{Releases, Way};
use crate::row::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// How much work there is in the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Effort {
    /// How often each way has its turn.
    pub rounds: u32,
    /// How long a turn is \[ms\].
    pub turn_millis: u64,
}

impl Effort {
    /// Six seconds.
    pub const QUICK: Self = Self { rounds: 2, turn_millis: 300 };

    /// A minute.
    pub const FULL: Self = Self { rounds: 6, turn_millis: 1000 };
}

/// The rows of this subject.
///
/// # Errors
///
/// As [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut all: Vec<Releases> = Way::ALL.into_iter().map(Releases::new).collect();
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
