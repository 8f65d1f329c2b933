//! A recorded path: its delay and its loss over time.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use crate::parameters::{Form, Key, Table, required, usual};
use cohaptic_units::{Instant, Probability};

/// Delay and loss over time, as measured: a CSV of `t,delay,loss`, times in seconds.
///
/// Between two rows the delay is that of the earlier one, or on the line between them; the loss is always that of the earlier one. Before the first row the
/// first holds. After the last row it holds for ever, or the recording begins anew.
#[derive(Clone, PartialEq, Debug)]
pub struct PathTrace {
    rows: Arc<[Row]>,
    between: Between,
    /// Whether it begins anew at its last row, whose own values then count for nothing.
    repeats: bool,
}

/// What holds between two rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Between {
    /// The earlier one.
    #[default]
    Steps,
    /// The delay on the line between both.
    Lines,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Row {
    at: Instant,
    delay_nanos: u64,
    loss: Probability,
}

/// Why a recording is refused. Lines count from 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum PathTraceError {
    /// The first line names no such columns.
    Header,
    /// A row has another number of columns.
    Columns {
        /// Which line.
        line: usize,
        /// How many.
        expected: usize,
    },
    /// A value is no number, or not one that it can be.
    Value {
        /// Which line.
        line: usize,
        /// Which column, by name.
        column: &'static str,
        /// What was expected.
        expected: &'static str,
    },
    /// A row is not later than the one above.
    Order {
        /// Which line.
        line: usize,
    },
    /// There is no row.
    Empty,
    /// It cannot be repeated, because it takes no time.
    NoLength,
}

impl fmt::Display for PathTraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header => f.write_str("line 1: expected the columns t,delay or t,delay,loss"),
            Self::Columns { line, expected } => write!(f, "line {line}: expected {expected} columns"),
            Self::Value { line, column, expected } => write!(f, "line {line}, column {column}: expected {expected}"),
            Self::Order { line } => write!(f, "line {line}: expected a time later than that of the row above"),
            Self::Empty => f.write_str("no row below the columns: expected at least one"),
            Self::NoLength => f.write_str("a recording that repeats needs a last row later than 0 s"),
        }
    }
}

impl core::error::Error for PathTraceError {}

impl PathTrace {
    /// Reads a CSV: a line with the columns `t,delay` or `t,delay,loss`, then one row a line, times in seconds, loss as a probability from 0 to 1. An empty
    /// delay means that everything is lost. Blank lines and lines that begin with # are skipped.
    ///
    /// # Errors
    ///
    /// [`PathTraceError`] with the line. Never panics.
    pub fn parse(text: &str, between: Between, repeats: bool) -> Result<Self, PathTraceError> {
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
        let header: Vec<&str> = lines.next().ok_or(PathTraceError::Header)?.1.split(',').map(str::trim).collect();
        let columns = match *header {
            ["t", "delay"] => 2,
            ["t", "delay", "loss"] => 3,
            _ => return Err(PathTraceError::Header),
        };
        let mut rows: Vec<Row> = Vec::new();
        for (place, text) in lines {
            let line = place + 1;
            let values: Vec<&str> = text.split(',').map(str::trim).collect();
            if values.len() != columns {
                return Err(PathTraceError::Columns { line, expected: columns });
            }
            let row = row(line, &values, rows.last())?;
            if rows.last().is_some_and(|last| last.at >= row.at) {
                return Err(PathTraceError::Order { line });
            }
            rows.push(row);
        }
        match rows.last() {
            None => Err(PathTraceError::Empty),
            Some(last) if repeats && last.at == Instant::ZERO => Err(PathTraceError::NoLength),
            Some(_) => Ok(Self { rows: rows.into(), between, repeats }),
        }
    }

    /// The instant of the first row.
    #[must_use]
    pub fn first(&self) -> Instant {
        self.rows.first().map_or(Instant::ZERO, |first| first.at)
    }

    /// The same recording with all times counted from its first row, as for times since 1970.
    ///
    /// # Errors
    ///
    /// [`PathTraceError::NoLength`] if it repeats and has one row.
    pub fn from_first(self) -> Result<Self, PathTraceError> {
        let first = self.first();
        let rows: Arc<[Row]> =
            self.rows.iter().map(|row| Row { at: Instant::ZERO.saturating_add(row.at.saturating_duration_since(first)), ..*row }).collect();
        if self.repeats && rows.len() < 2 { Err(PathTraceError::NoLength) } else { Ok(Self { rows, ..self }) }
    }

    /// The delay \[ns\] and the loss at an instant.
    pub(crate) fn at(&self, now: Instant) -> (u64, Probability) {
        let end = self.rows.last().map_or(Instant::ZERO, |last| last.at);
        let now = if self.repeats { Instant::from_nanos(now.as_nanos() % end.as_nanos()) } else { now };
        let next = self.rows.partition_point(|row| row.at <= now);
        let row = self.rows[next.saturating_sub(1)];
        let delay = match self.rows.get(next) {
            Some(after) if self.between == Between::Lines && next > 0 => {
                let (passed, whole) = (now.as_nanos() - row.at.as_nanos(), after.at.as_nanos() - row.at.as_nanos());
                let (from, to) = (i128::from(row.delay_nanos), i128::from(after.delay_nanos));
                let change = (to - from) * i128::from(passed) / i128::from(whole);
                u64::try_from(from + change).unwrap_or(row.delay_nanos)
            }
            _ => row.delay_nanos,
        };
        (delay, row.loss)
    }

    /// After how long it begins anew; `None` if its last row holds for ever.
    #[must_use]
    pub fn period(&self) -> Option<Duration> {
        self.rows.last().filter(|_| self.repeats).map(|last| Duration::from_nanos(last.at.as_nanos()))
    }

    /// The delay and the loss of the last row.
    #[must_use]
    pub fn last(&self) -> (Duration, Probability) {
        self.rows.last().map_or((Duration::ZERO, Probability::ZERO), |row| (Duration::from_nanos(row.delay_nanos), row.loss))
    }

    /// This recording without chance: rows that do not lose everything lose nothing.
    #[must_use]
    pub fn without_chance(&self) -> Self {
        let certain = |row: &Row| Row { loss: if row.loss == Probability::ONE { row.loss } else { Probability::ZERO }, ..*row };
        Self { rows: self.rows.iter().map(certain).collect(), ..self.clone() }
    }

    /// The least delay of all rows.
    #[must_use]
    pub fn least(&self) -> Duration {
        Duration::from_nanos(self.rows.iter().map(|row| row.delay_nanos).min().unwrap_or(0))
    }
}

fn row(line: usize, values: &[&str], above: Option<&Row>) -> Result<Row, PathTraceError> {
    const TIME: &str = "a time in seconds, from 0 to 9e9";
    let seconds = |column, text: &str| {
        let seconds = text.parse().ok().filter(|seconds| (0.0..=9e9).contains(seconds));
        let seconds: f64 = seconds.ok_or(PathTraceError::Value { line, column, expected: TIME })?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 9e18")]
        Ok(libm::rint(seconds * 1e9) as u64)
    };
    let at = Instant::from_nanos(seconds("t", values[0])?);
    if values[1].is_empty() {
        return Ok(Row { at, delay_nanos: above.map_or(0, |above| above.delay_nanos), loss: Probability::ONE });
    }
    let loss = match values.get(2) {
        None => Probability::ZERO,
        Some(text) => text.parse().ok().and_then(|value| Probability::new(value).ok()).ok_or(PathTraceError::Value {
            line,
            column: "loss",
            expected: "a probability from 0 to 1",
        })?,
    };
    Ok(Row { at, delay_nanos: seconds("delay", values[1])?, loss })
}

/// The parameter of recorded lines and paths.
pub(crate) const KEYS: [Key; 1] = [usual(
    "trace",
    Form::AnyOf(const { &[Form::File, Form::Table(&TRACE)] }),
    "\"none\"",
    "A recorded line or path, from a file; \"none\" takes it away",
)];
static TRACE: Table = Table::of(&[&[
    required("file", Form::File, "Instants of delivery in milliseconds, one a line (mahimahi), or a CSV with t,delay or t,delay,loss in seconds"),
    usual("bytes", Form::Size, "\"1504B\"", "What leaves at each instant of delivery"),
    usual("between", Form::Words(&BETWEEN), "\"steps\"", "What holds between two rows of a recorded path"),
    usual("repeat", Form::Boolean, "false", "Whether a recorded path begins anew after its end"),
    usual("start", Form::Words(&START), "\"zero\"", "What times of a recorded path count from"),
]]);
const START: [(&str, &str); 2] = [("zero", "the start of the run"), ("first", "the first row, as for times since 1970")];
const BETWEEN: [(&str, &str); 2] = [("steps", "the earlier row"), ("lines", "a delay on the line between both")];

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

    #[test]
    fn times_may_count_from_the_first_row() {
        let since_1970 = "t,delay,loss\n1700000000,0.020,0\n1700000001.5,0.040,0.5\n1700000002,0.010,0\n";
        for repeats in [false, true] {
            let trace = PathTrace::parse(since_1970, Between::Lines, repeats).unwrap();
            assert_eq!(trace.first(), Instant::from_nanos(1_700_000_000_000_000_000));
            let from_zero = PathTrace::parse("t,delay,loss\n0,0.020,0\n1.5,0.040,0.5\n2,0.010,0\n", Between::Lines, repeats).unwrap();
            assert_eq!(trace.from_first().unwrap(), from_zero);
        }
        let one_row = |repeats| PathTrace::parse("t,delay\n5,1\n", Between::Steps, repeats).unwrap().from_first();
        assert_eq!((one_row(true), one_row(false).unwrap().first()), (Err(PathTraceError::NoLength), Instant::ZERO));
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let error = |text: &str| PathTrace::parse(text, Between::Steps, true).unwrap_err();
        assert_eq!(error(""), PathTraceError::Header);
        assert_eq!(error("a,b\n"), PathTraceError::Header);
        assert_eq!(error("t,delay\n"), PathTraceError::Empty);
        assert_eq!(error("t,delay\n0,1\n"), PathTraceError::NoLength);
        assert_eq!(error("t,delay\n1,1\n1,2\n"), PathTraceError::Order { line: 3 });
        assert_eq!(error("t,delay\n1,1,1\n"), PathTraceError::Columns { line: 2, expected: 2 });
        assert!(matches!(error("t,delay\n1,nan\n"), PathTraceError::Value { line: 2, column: "delay", .. }));
        assert!(matches!(error("t,delay,loss\n1,1,1.5\n"), PathTraceError::Value { line: 2, column: "loss", .. }));
    }
}
