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

use super::decimal::Attoseconds;
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
}
