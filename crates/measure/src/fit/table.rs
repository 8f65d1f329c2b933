//! Measurements as a CSV file.
//!
//! The first line names the columns, in any order; columns of other names are passed over:
//!
//! | column | is |
//! | --- | --- |
//! | `t` or `sent` | when the packet was sent |
//! | `delay` | its one-way delay; empty if it was lost |
//! | `arrived` | instead of `delay`: when it arrived, by the same clock; empty if it was lost |
//! | `lost` | may be there too: 1 if the packet was lost, 0 or empty if not |
//!
//! Times are in seconds, or in the unit that the name ends in: `_s`, `_ms`, `_us`, `_ns`. Digits are kept exactly up to 10⁻¹⁸ s, so that instants may
//! be counted from 1970. Rows stand in the order of sending.

use std::io::{self, Read};

use super::{Measurement, Measurements, MeasurementsError};

/// Why a file is not read as measurements. Lines are counted from 1, the header being line 1.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// What stands there is no text.
    #[error("line {line}: found bytes that are no text, expected UTF-8")]
    NotText {
        /// The line.
        line: u64,
    },
    /// A column is missing, twice there, or excluded by another.
    #[error(
        "line 1: found the columns \"{found}\", expected `t` or `sent` and either `delay` or `arrived`, each once, perhaps `lost` (and times with _ms, _us or _ns)"
    )]
    Columns {
        /// The header.
        found: String,
    },
    /// A cell cannot be read.
    #[error("line {line}, column {column}: found \"{found}\", expected {expected}")]
    Cell {
        /// The line.
        line: u64,
        /// The name of the column.
        column: String,
        /// What stands there.
        found: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// A packet was sent before the one before it.
    #[error("line {line}: sent {back_s} s before the packet of the line before: expected rows in the order of sending")]
    TimeGoesBack {
        /// The line.
        line: u64,
        /// By how much \[s\].
        back_s: f64,
    },
    /// The packets as a whole are refused.
    #[error(transparent)]
    Measurements(#[from] MeasurementsError),
}

impl From<csv::Error> for TableError {
    fn from(error: csv::Error) -> Self {
        let line = error.position().map_or(1, csv::Position::line);
        // Rows may be of any length, so that nothing else is refused.
        if error.is_io_error() { Self::Io(error.into()) } else { Self::NotText { line } }
    }
}

impl Measurements {
    /// Reads a CSV file with the columns `t,delay[,lost]` or `sent,arrived[,lost]`, in seconds unless a name ends in `_ms`, `_us` or `_ns`. See the
    /// [module](super#files-of-measurements) for the format. Times are counted from the first packet.
    ///
    /// # Errors
    ///
    /// [`TableError`] with line, column and what was expected.
    pub fn from_csv(from: impl Read) -> Result<Self, TableError> {
        let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(from);
        let columns = Columns::find(reader.headers()?)?;
        let mut packets = Vec::new();
        let mut first = None;
        let mut before = None;
        for row in reader.records() {
            let row = row?;
            let row = Row { line: row.position().map_or(0, csv::Position::line), cells: &row };
            let sent = row.time(&columns.sent)?.ok_or_else(|| row.refused(&columns.sent, A_TIME))?;
            if let Some(back_s) = before.and_then(|before: Attoseconds| before.seconds_since(sent)).filter(|back| *back > 0.0) {
                return Err(TableError::TimeGoesBack { line: row.line, back_s });
            }
            before = Some(sent);
            let origin = *first.get_or_insert(sent);
            let is_lost = columns.lost.as_ref().map_or(Ok(false), |column| row.flag(column))?;
            let end = row.time(&columns.end)?;
            let too_far = || row.refused(&columns.end, "a time within 10^20 s of the first");
            let delay_s = match end {
                Some(end) if columns.end_is_instant => Some(end.seconds_since(sent).ok_or_else(too_far)?),
                Some(delay) => Some(delay.seconds()),
                None => None,
            };
            packets.push(Measurement { sent_s: sent.seconds_since(origin).ok_or_else(too_far)?, delay_s: delay_s.filter(|_| !is_lost) });
        }
        Ok(Self::new(packets)?)
    }
}

const A_TIME: &str = "a decimal number";

/// Where a column stands, and its unit as a power of ten of a second.
struct Column {
    name: String,
    place: usize,
    unit: i32,
}

struct Columns {
    sent: Column,
    end: Column,
    end_is_instant: bool,
    lost: Option<Column>,
}

impl Columns {
    fn find(header: &csv::StringRecord) -> Result<Self, TableError> {
        let refused = || TableError::Columns { found: header.iter().collect::<Vec<_>>().join(",") };
        let only = |names: &[&str]| {
            let mut found = header.iter().enumerate().filter_map(|(place, name)| column(place, name, names));
            let first = found.next();
            if found.next().is_some() { Err(refused()) } else { Ok(first) }
        };
        let end = only(&["delay", "arrived"])?.ok_or_else(refused)?;
        Ok(Self { sent: only(&["t", "sent"])?.ok_or_else(refused)?, end_is_instant: end.name.starts_with("arrived"), end, lost: only(&["lost"])? })
    }
}

fn column(place: usize, name: &str, wanted: &[&str]) -> Option<Column> {
    // Spreadsheets put a byte order mark before the first name.
    let name = name.trim_start_matches('\u{feff}').to_ascii_lowercase();
    let (base, unit) = [("_ms", -3), ("_us", -6), ("_ns", -9), ("_s", 0), ("", 0)]
        .into_iter()
        .find_map(|(suffix, unit)| Some((name.strip_suffix(suffix)?, unit)))?;
    wanted.contains(&base).then(|| Column { name: name.clone(), place, unit })
}

struct Row<'a> {
    line: u64,
    cells: &'a csv::StringRecord,
}

impl Row<'_> {
    fn text(&self, column: &Column) -> &str {
        self.cells.get(column.place).unwrap_or_default()
    }

    /// The time in that column; `None` if the cell is empty.
    fn time(&self, column: &Column) -> Result<Option<Attoseconds>, TableError> {
        let text = self.text(column);
        if text.is_empty() {
            return Ok(None);
        }
        Attoseconds::parse(text, column.unit).map(Some).ok_or_else(|| self.refused(column, A_TIME))
    }

    fn flag(&self, column: &Column) -> Result<bool, TableError> {
        match self.text(column) {
            "1" => Ok(true),
            "0" | "" => Ok(false),
            _ => Err(self.refused(column, "0 or 1")),
        }
    }

    fn refused(&self, column: &Column, expected: &'static str) -> TableError {
        TableError::Cell { line: self.line, column: column.name.clone(), found: self.text(column).to_string(), expected }
    }
}

/// Attoseconds in a second, as a power of ten.
const DIGITS: i32 = 18;

/// A time or a span as a whole number of attoseconds, 10⁻¹⁸ s. It reaches to 1.7·10²⁰ s.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Attoseconds(i128);

impl Attoseconds {
    /// Reads a decimal number, with or without sign, fraction and exponent, of the unit 10^`unit` s. Digits below 10⁻¹⁸ s are cut. `None` if it is no
    /// number (NaN and infinities are none) or too large.
    pub(super) fn parse(text: &str, unit: i32) -> Option<Self> {
        let (number, exponent) = match text.split_once(['e', 'E']) {
            Some((number, exponent)) => (number, exponent.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let (negative, digits) = match number.strip_prefix('-') {
            Some(digits) => (true, digits),
            None => (false, number.strip_prefix('+').unwrap_or(number)),
        };
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        if whole.len() + fraction.len() == 0 || !whole.bytes().chain(fraction.bytes()).all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        // The place of the last digit of `whole`, in powers of ten of an attosecond.
        let mut place = exponent.checked_add(unit + DIGITS)?.checked_add(i32::try_from(whole.len()).ok()?)?;
        let mut value: i128 = 0;
        for digit in whole.bytes().chain(fraction.bytes()) {
            place -= 1;
            let digit = i128::from(digit - b'0');
            if digit != 0 && place >= 0 {
                let weight = 10_i128.checked_pow(u32::try_from(place).ok()?)?;
                value = value.checked_add(digit.checked_mul(weight)?)?;
            }
        }
        Some(Self(if negative { -value } else { value }))
    }

    pub(super) const fn from_nanos(nanos: i128) -> Option<Self> {
        match nanos.checked_mul(1_000_000_000) {
            Some(attos) => Some(Self(attos)),
            None => None,
        }
    }

    /// The difference in seconds, rounded once; `None` if it is too large.
    #[expect(clippy::cast_precision_loss, reason = "rounded once, on purpose")]
    pub(super) fn seconds_since(self, earlier: Self) -> Option<f64> {
        Some(self.0.checked_sub(earlier.0)? as f64 / 1e18)
    }

    /// In seconds, rounded once.
    #[expect(clippy::cast_precision_loss, reason = "rounded once, on purpose")]
    pub(super) const fn seconds(self) -> f64 {
        self.0 as f64 / 1e18
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Result<Vec<(f64, Option<f64>)>, String> {
        let measurements = Measurements::from_csv(text.as_bytes()).map_err(|error| error.to_string())?;
        Ok(measurements.packets().iter().map(|packet| (packet.sent_s, packet.delay_s)).collect())
    }

    #[test]
    fn both_forms_and_all_units_are_read() {
        let expected = Ok(vec![(0.0, Some(0.024)), (0.001, None), (0.002, Some(0.025))]);
        assert_eq!(read("t,delay\n0,0.024\n0.001,\n0.002,0.025\n"), expected);
        assert_eq!(read("\u{feff}T_ms, delay_us ,lost\r\n0,24000,0\r\n1,77,1\r\n2,25000,\r\n"), expected);
        assert_eq!(
            read(
                "id,arrived_ns,sent_ns\na,1700000000024000000,1700000000000000000\nb,,1700000000001000000\nc,1700000000027000000,1700000000002000000\n"
            ),
            expected
        );
        assert_eq!(read("sent,arrived_s\n5,5.024\n5.001\n5.002,5.027\n"), expected);
        // Clocks may be offset.
        assert_eq!(read("sent,arrived\n5,4\n"), Ok(vec![(0.0, Some(-1.0))]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert!(read("t,delays\n").unwrap_err().starts_with("line 1: found the columns \"t,delays\", expected `t` or `sent` and either"));
        assert!(read("t,delay,arrived\n").unwrap_err().starts_with("line 1"));
        assert!(read("t,sent,delay\n").unwrap_err().starts_with("line 1"));
        assert!(read("").unwrap_err().starts_with("line 1"));
        assert_eq!(read("t,delay\n0,1\n1,NaN\n").unwrap_err(), "line 3, column delay: found \"NaN\", expected a decimal number");
        assert_eq!(read("t_ms,delay\n,1\n").unwrap_err(), "line 2, column t_ms: found \"\", expected a decimal number");
        assert_eq!(read("t,delay,lost\n0,1,yes\n").unwrap_err(), "line 2, column lost: found \"yes\", expected 0 or 1");
        assert_eq!(
            read("t,delay\n2,1\n1.5,1\n").unwrap_err(),
            "line 3: sent 0.5 s before the packet of the line before: expected rows in the order of sending"
        );
    }

    proptest! {
        #[test]
        fn edited_files_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8)) {
            let mut bytes = b"sent_ms,arrived,lost\n0,0.024,0\n1,0.026,1\n2,,\n1e3,\"1.024\",0\n".to_vec();
            for (place, byte) in edits {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            let _ = Measurements::from_csv(bytes.as_slice());
        }
    }

    #[test]
    fn numbers_are_read_in_their_unit() {
        let seconds = |text, unit| Attoseconds::parse(text, unit).map(Attoseconds::seconds);
        assert_eq!(seconds("24", -3), Some(0.024));
        assert_eq!(seconds("-1.5", 0), Some(-1.5));
        assert_eq!(seconds("+.5e-3", 0), Some(0.0005));
        assert_eq!(seconds("2.E3", -9), Some(0.000_002));
        assert_eq!(seconds("0.0000000000000000000000000001", 0), Some(0.0));
        for text in ["", "-", ".", "NaN", "inf", "1e", "1,5", "0x10", "1e999999999", "99999999999999999999999", "1_000", "--1", " 1"] {
            assert_eq!(Attoseconds::parse(text, 0), None, "{text}");
        }
    }

    #[test]
    fn nanoseconds_since_1970_keep_their_digits() {
        let [sent, arrived] = ["1700000000.000000001", "1700000000.024000002"].map(|text| Attoseconds::parse(text, 0).unwrap());
        assert_eq!(arrived.seconds_since(sent), Some(0.024_000_001));
        assert_eq!(Attoseconds::parse("1700000000000000001", -9), Some(sent));
    }

    proptest! {
        #[test]
        fn numbers_read_as_rust_reads_them(value in -1e6..1e6_f64) {
            // Cut below 1e-18 s and rounded once: within one unit of the last place, or of 1e-18.
            let read = Attoseconds::parse(&format!("{value:e}"), 0).unwrap().seconds();
            prop_assert!((read - value).abs() <= 1e-18 + value.abs() * f64::EPSILON);
        }

        #[test]
        fn any_text_is_answered(text in "[-+0-9.eE]{0,30}", unit in -9..=0) {
            let _ = Attoseconds::parse(&text, unit);
        }
    }
}
