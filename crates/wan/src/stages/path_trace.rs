//! Path trace: recorded delay and loss of a path over time.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use crate::delay_table::{self, Attoseconds, DelayRow, DelayTableError};
use crate::parameters::{Choices, Form, Key, Table, required, usual, words};
use cohaptic_units::{Instant, Probability};

/// Recorded delay and loss over time: a [table of delays](crate::delay_table), optionally with a column `loss`.
///
/// Between two rows, the delay is the delay of the earlier row or is interpolated linearly, and the loss is the loss of the earlier row. Before the first row
/// the first row holds. After the last row the last row holds for ever, or the recording begins anew.
#[derive(Clone, PartialEq, Debug)]
pub struct PathTrace {
    rows: Arc<[Row]>,
    between: Between,
    /// `true` if the recording begins anew at the instant of its last row. Delay and loss of this row then never hold.
    repeats: bool,
}

/// Delay between two rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Between {
    /// Delay of the earlier row.
    #[default]
    Steps,
    /// Linear interpolation between the delays of both rows.
    Lines,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Row {
    at: Instant,
    delay_nanos: u64,
    loss: Probability,
}

/// Reason for the refusal of a recording. Lines count from 1.
#[derive(Clone, PartialEq, Debug)]
pub enum PathTraceError {
    /// The text is not a table of delays.
    Table(DelayTableError),
    /// A number is out of range.
    Value {
        /// Number of the line.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// Description of the expected value.
        expected: &'static str,
    },
    /// The table has no row.
    Empty,
    /// A repeating recording has no length.
    NoLength,
}

impl fmt::Display for PathTraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Table(error) => error.fmt(f),
            Self::Value { line, column, expected } => write!(f, "line {line}, column {column}: expected {expected}"),
            Self::Empty => f.write_str("no row below the columns: expected at least one"),
            Self::NoLength => f.write_str("a recording that repeats needs a last row later than 0 s"),
        }
    }
}

impl core::error::Error for PathTraceError {}

impl PathTrace {
    /// Reads a table of delays, as [`delay_table`] describes it, with times and delays from 0 to 9·10⁹ s. A column `loss` may hold the probability of loss
    /// from each row on. While the row of a lost packet holds, every packet is lost. Of rows with equal times the last row holds.
    ///
    /// # Errors
    ///
    /// [`PathTraceError`] with the line. No text makes this function panic.
    pub fn parse(text: &str, between: Between, repeats: bool) -> Result<Self, PathTraceError> {
        let mut rows: Vec<Row> = Vec::new();
        for table_row in delay_table::read(text).map_err(PathTraceError::Table)? {
            rows.push(row(&table_row, rows.last())?);
        }
        match rows.last() {
            None => Err(PathTraceError::Empty),
            Some(last) if repeats && last.at == Instant::ZERO => Err(PathTraceError::NoLength),
            Some(_) => Ok(Self { rows: rows.into(), between, repeats }),
        }
    }

    /// Returns the instant of the first row.
    #[must_use]
    pub fn first(&self) -> Instant {
        self.rows.first().map_or(Instant::ZERO, |first| first.at)
    }

    /// Returns the recording with all times counted from its first row, for recordings with times since 1970.
    ///
    /// # Errors
    ///
    /// [`PathTraceError::NoLength`] if the recording repeats and all rows have the instant of the first row.
    pub fn from_first(self) -> Result<Self, PathTraceError> {
        let first = self.first();
        let rows: Arc<[Row]> =
            // Rows before the first row do not exist, so no difference saturates.
            self.rows.iter().map(|row| Row { at: Instant::ZERO.saturating_add(row.at.saturating_duration_since(first)), ..*row }).collect();
        let has_length = rows.last().is_some_and(|last| last.at > Instant::ZERO);
        if self.repeats && !has_length { Err(PathTraceError::NoLength) } else { Ok(Self { rows, ..self }) }
    }

    /// Returns the delay \[ns\] and the probability of loss at `now`.
    pub(crate) fn at(&self, now: Instant) -> (u64, Probability) {
        let end = self.rows.last().map_or(Instant::ZERO, |last| last.at);
        // `parse` refuses a repeating recording with its last row at zero: the remainder would be undefined.
        let now = if self.repeats { Instant::from_nanos(now.as_nanos() % end.as_nanos()) } else { now };
        let next = self.rows.partition_point(|row| row.at <= now);
        // A checked recording has at least one row. Before the first row `next` is 0, and the first row holds.
        let row = self.rows[next.saturating_sub(1)];
        let delay = match self.rows.get(next) {
            Some(after) if self.between == Between::Lines && next > 0 => {
                // `whole` is above zero: `after` is the first row later than `now`, and `row` is not later than `now`.
                let (passed, whole) = (now.as_nanos() - row.at.as_nanos(), after.at.as_nanos() - row.at.as_nanos());
                let (from, to) = (i128::from(row.delay_nanos), i128::from(after.delay_nanos));
                // 128 bits hold the product of two times of 64 bits, with a sign.
                let change = (to - from) * i128::from(passed) / i128::from(whole);
                u64::try_from(from + change).unwrap_or(row.delay_nanos)
            }
            _ => row.delay_nanos,
        };
        (delay, row.loss)
    }

    /// Returns the time after which the recording begins anew, or `None` if the last row holds for ever.
    #[must_use]
    pub fn period(&self) -> Option<Duration> {
        self.rows.last().filter(|_| self.repeats).map(|last| Duration::from_nanos(last.at.as_nanos()))
    }

    /// Returns the delay and the loss of the last row.
    #[must_use]
    pub fn last(&self) -> (Duration, Probability) {
        self.rows.last().map_or((Duration::ZERO, Probability::ZERO), |row| (Duration::from_nanos(row.delay_nanos), row.loss))
    }

    /// Returns the recording without chance: a probability of loss below one becomes zero.
    #[must_use]
    pub fn without_chance(&self) -> Self {
        // A certain loss draws nothing, so such a row stays.
        let certain = |row: &Row| Row { loss: if row.loss == Probability::ONE { row.loss } else { Probability::ZERO }, ..*row };
        Self { rows: self.rows.iter().map(certain).collect(), ..self.clone() }
    }

    /// Returns the least delay of all rows.
    #[must_use]
    pub fn least(&self) -> Duration {
        Duration::from_nanos(self.rows.iter().map(|row| row.delay_nanos).min().unwrap_or(0))
    }
}

/// Longest time and delay of a recording \[ns\].
const MOST: u64 = 9_000_000_000_000_000_000;

/// Returns a row of the recording for a row of the table. `above` is the previous row of the recording.
fn row(row: &DelayRow, above: Option<&Row>) -> Result<Row, PathTraceError> {
    let refused = |column, expected| PathTraceError::Value { line: row.line, column, expected };
    let nanos = |column, time: Attoseconds| time.nanos().filter(|nanos| *nanos <= MOST).ok_or_else(|| refused(column, "a time from 0 to 9e9 s"));
    let at = Instant::from_nanos(nanos("t", row.sent)?);
    let Some(delay) = row.delay else {
        // The row is a lost packet without a delay. The delay of the row above stays, so `Lines` can interpolate.
        return Ok(Row { at, delay_nanos: above.map_or(0, |above| above.delay_nanos), loss: Probability::ONE });
    };
    let loss = match row.loss.as_str() {
        "" => Probability::ZERO,
        text => text.parse().ok().and_then(|value| Probability::new(value).ok()).ok_or_else(|| refused("loss", "a probability from 0 to 1"))?,
    };
    Ok(Row { at, delay_nanos: nanos("delay", delay)?, loss })
}

/// Parameter of recorded lines and paths.
pub(crate) const KEYS: [Key; 1] = [usual(
    "trace",
    Form::AnyOf(const { &[Form::File, Form::Table(&TRACE)] }),
    "\"none\"",
    "File of a recorded line or path; \"none\" takes it away",
)];
static TRACE: Table = Table::of(&[&[
    required(
        "file",
        Form::File,
        "Instants of delivery in milliseconds, one a line (mahimahi), or a CSV with t,delay or t,delay,loss in seconds, or what fit reads",
    ),
    usual("bytes", Form::Size, "\"1504B\"", "Bytes that leave at each instant of delivery"),
    usual("between", Form::Words(&BETWEEN), "\"steps\"", "Delay between two rows of a recorded path"),
    usual("repeat", Form::Boolean, "false", "Whether a recorded path begins anew after its end"),
    usual("start", Form::Words(&START), "\"zero\"", "Origin of the times of a recorded path"),
]]);
const START: [(&str, &str); 2] = [("zero", "the start of the run"), ("first", "the first row, as for times since 1970")];
const BETWEEN: [(&str, &str); 2] = words(&Between::CHOICES);

impl Between {
    /// Names of the ways in files, each with its value and its description.
    pub const CHOICES: Choices<Self, 2> = [("steps", Self::Steps, "the earlier row"), ("lines", Self::Lines, "a delay on the line between both")];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_certain_is_left_where_chance_is_taken_away() {
        let trace = |repeats| PathTrace::parse("t,delay,loss\n0,0.01,0.5\n1,,0\n2,0.03,1\n3,0.04,0.1", Between::Steps, repeats).unwrap();
        let certain = trace(true).without_chance();
        let loss = |second: u64| certain.at(Instant::from_nanos(second * 1_000_000_000)).1;
        assert_eq!([0, 1, 2].map(loss), [Probability::ZERO, Probability::ONE, Probability::ONE]);
        assert_eq!((certain.period(), trace(false).period()), (Some(Duration::from_secs(3)), None));
        assert_eq!(trace(false).last(), (Duration::from_millis(40), Probability::new(0.1).unwrap()));
        assert_eq!(trace(false).without_chance().last(), (Duration::from_millis(40), Probability::ZERO));
    }

    const TEXT: &str = "# measured\nt,delay,loss\n0,0.020,0\n1,0.040,0.5\n\n2,,\n3,0.010,0\n";

    fn delays(between: Between, repeats: bool) -> Vec<(u64, f64)> {
        let trace = PathTrace::parse(TEXT, between, repeats).unwrap();
        [0, 500, 1000, 1500, 2500, 3000, 3500, 9000]
            .map(|t| trace.at(Instant::from_nanos(t * 1_000_000)))
            .map(|(d, p)| (d / 1_000_000, p.get()))
            .into()
    }

    #[test]
    fn rows_hold_until_the_next_one() {
        let expected = [(20, 0.0), (20, 0.0), (40, 0.5), (40, 0.5), (40, 1.0), (10, 0.0), (10, 0.0), (10, 0.0)];
        assert_eq!(delays(Between::Steps, false), expected);
    }

    #[test]
    fn lines_and_repetition() {
        let expected = [(20, 0.0), (30, 0.0), (40, 0.5), (40, 0.5), (25, 1.0), (20, 0.0), (30, 0.0), (20, 0.0)];
        assert_eq!(delays(Between::Lines, true), expected);
    }

    /// A recording may have everything that measurements have: a byte order mark, units, columns in any order, further columns, equal times, and lost packets
    /// in each notation.
    #[test]
    fn what_is_measured_is_replayed() {
        let plain = |text| PathTrace::parse(text, Between::Steps, false).unwrap();
        let expected = plain("t,delay\n0,0.020\n0.010,0.030\n0.020,\n0.030,\n0.040,\n0.050,\n0.060,0.025\n");
        let measured = "\u{feff}number,delay_ms,T_ms,lost\n0,20,0,0\n1,99,10,0\n2,30,10,0\n3,-1,20,0\n4,NaN,30,\n5,NA,40,0\n6,77,50,1\n7,25,60,0\n";
        let at = |trace: &PathTrace, ms: u64| trace.at(Instant::from_nanos(ms * 1_000_000));
        for ms in 0..80 {
            assert_eq!(at(&plain(measured), ms), at(&expected, ms), "{ms}");
        }
        assert_eq!(at(&expected, 35), (30_000_000, Probability::ONE));
        // Interpolation also works before and after an instant with two rows.
        let lines = PathTrace::parse("sent,arrived\n0,0.02\n1,1.04\n1,1.01\n2,2.01\n", Between::Lines, false).unwrap();
        assert_eq!([500, 999, 1000, 1500].map(|ms| at(&lines, ms).0 / 100_000), [300, 399, 100, 100]);
    }

    #[test]
    fn times_may_count_from_the_first_row() {
        let since_1970 = "t,delay,loss\n1700000000,0.020,0\n1700000001.5,0.040,0.5\n1700000002,0.010,0\n";
        for repeats in [false, true] {
            let trace = PathTrace::parse(since_1970, Between::Lines, repeats).unwrap();
            assert_eq!(trace.first(), Instant::from_nanos(1_700_000_000_000_000_000));
            let from_zero = PathTrace::parse("t,delay,loss\n0,0.020,0\n1.5,0.040,0.5\n2,0.010,0\n", Between::Lines, repeats).unwrap();
            assert_eq!(trace.from_first().unwrap(), from_zero);
        }
        for one_instant in ["t,delay\n5,1\n", "t,delay\n5,1\n5,2\n"] {
            let from_first = |repeats| PathTrace::parse(one_instant, Between::Steps, repeats).unwrap().from_first();
            assert_eq!((from_first(true), from_first(false).unwrap().first()), (Err(PathTraceError::NoLength), Instant::ZERO));
        }
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let error = |text: &str| PathTrace::parse(text, Between::Steps, true).unwrap_err();
        assert!(matches!(error(""), PathTraceError::Table(DelayTableError::Columns { line: 1, .. })));
        assert!(matches!(error("a,b\n"), PathTraceError::Table(DelayTableError::Columns { line: 1, .. })));
        assert_eq!(error("t,delay\n"), PathTraceError::Empty);
        assert_eq!(error("t,delay\n0,1\n"), PathTraceError::NoLength);
        assert!(matches!(error("t,delay\n1,1\n0.9,2\n"), PathTraceError::Table(DelayTableError::TimeGoesBack { line: 3, .. })));
        assert!(matches!(error("t,delay\n1,soon\n"), PathTraceError::Table(DelayTableError::Cell { line: 2, .. })));
        assert!(matches!(error("t,delay\n1,-0.5\n"), PathTraceError::Value { line: 2, column: "delay", .. }));
        assert!(matches!(error("t,delay\n-1,0.5\n"), PathTraceError::Value { line: 2, column: "t", .. }));
        assert!(matches!(error("t,delay,loss\n1,1,1.5\n"), PathTraceError::Value { line: 2, column: "loss", .. }));
    }
}
