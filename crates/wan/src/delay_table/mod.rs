//! Table of delays over time, read from a CSV file. `cohaptic fit` estimates a link from such a table, and the key `trace` replays the table.
//!
//! The first line names the columns, in any order and in capitals or small letters. Columns with other names are skipped:
//!
//! | column | is |
//! | --- | --- |
//! | `t` or `sent` | time of sending of the packet |
//! | `delay` | one-way delay of the packet |
//! | `arrived` | instead of `delay`: time of arrival of the packet, by the same clock |
//! | `lost` | optional: 1 if the packet was lost, 0 or empty if not |
//!
//! Times are in seconds, or in the unit at the end of the column's name: `_s`, `_ms`, `_us`, `_ns`. A packet whose delay or arrival is empty, `NaN`, `NA` or −1
//! was lost. Digits down to 10⁻¹⁸ s are exact, so times may be counted from 1970. Rows must be in the order of sending; equal times are allowed. A byte
//! order mark, blank lines and lines that begin with # are skipped. Cells may be in double quotes. The column `loss` is passed on as text.

mod attoseconds;

use alloc::borrow::ToOwned;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

pub use attoseconds::Attoseconds;

/// Row of the table: a packet or, for a replay, the delay and loss of the path from a time on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DelayRow {
    /// Line of the file, counted from 1.
    pub line: usize,
    /// Time of sending.
    pub sent: Attoseconds,
    /// Delay, or `None` for a lost packet. Can be negative if the clocks of both ends are offset.
    pub delay: Option<Attoseconds>,
    /// Text in the column `loss`, a probability for a replay. Empty without such a column.
    pub loss: String,
}

/// Reason for refusing a table of delays. Lines are counted from 1.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum DelayTableError {
    /// A column is missing, occurs twice, or is excluded by another column.
    Columns {
        /// Line of the header.
        line: usize,
        /// Text of the header.
        found: String,
    },
    /// A cell cannot be read.
    Cell {
        /// Line of the cell.
        line: usize,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        found: String,
        /// Expected content of the cell.
        expected: &'static str,
    },
    /// A packet was sent before the packet of the row above.
    TimeGoesBack {
        /// Line of the packet.
        line: usize,
        /// Time of sending of the row above minus the time of this row, above zero \[s\].
        back_s: f64,
    },
}

impl DelayTableError {
    /// Returns the faulty line, counted from 1.
    #[must_use]
    pub const fn line(&self) -> usize {
        match self {
            Self::Columns { line, .. } | Self::Cell { line, .. } | Self::TimeGoesBack { line, .. } => *line,
        }
    }
}

impl fmt::Display for DelayTableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Columns { line, found } => write!(
                f,
                "line {line}: found the columns \"{found}\", expected `t` or `sent` and either `delay` or `arrived`, each once, perhaps `lost` (and times with _ms, \
                 _us or _ns)"
            ),
            Self::Cell { line, column, found, expected } => write!(f, "line {line}, column {column}: found \"{found}\", expected {expected}"),
            Self::TimeGoesBack { line, back_s } => {
                write!(f, "line {line}: sent {back_s} s before the packet of the line before: expected rows in the order of sending")
            }
        }
    }
}

impl core::error::Error for DelayTableError {}

const A_TIME: &str = "a decimal number";
/// Text of an error about a cell that [`delay`] refuses.
pub const A_DELAY: &str = "a decimal number, or for a lost packet nothing, NaN, NA or -1";
const A_FLAG: &str = "0 or 1";

/// Reads a table of delays. See the [module](self) for the format.
///
/// # Errors
///
/// [`DelayTableError`] with line, column and expected content. Never panics.
pub fn read(text: &str) -> Result<Vec<DelayRow>, DelayTableError> {
    // Spreadsheets write a byte order mark before the first name.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let content = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| content(line));
    let (line, header) = lines.next().unwrap_or((1, ""));
    let columns = Columns::find(line, &cells(header))?;
    let mut rows: Vec<DelayRow> = Vec::new();
    for (line, text) in lines {
        let row = Row { line, cells: cells(text) };
        let sent = row.time(&columns.sent, A_TIME)?;
        // Equal times are allowed, so only a difference above zero is refused.
        let back = rows.last().and_then(|before| before.sent.seconds_since(sent)).filter(|back_s| *back_s > 0.0);
        if let Some(back_s) = back {
            return Err(DelayTableError::TimeGoesBack { line, back_s });
        }
        let is_lost = columns.lost.as_ref().map_or(Ok(false), |column| row.flag(column))?;
        // The end of a lost packet is read too, so a faulty cell is found in any row.
        let end = row.end(&columns.end)?;
        let delay = match end {
            Some(end) if columns.end_is_instant => Some(end.since(sent).ok_or_else(|| row.cell(&columns.end, "a time within 10^20 s of the other"))?),
            delay => delay,
        };
        let loss = columns.loss.as_ref().map_or("", |column| row.text(column)).to_owned();
        rows.push(DelayRow { line, sent, delay: delay.filter(|_| !is_lost), loss });
    }
    Ok(rows)
}

/// Splits a line into cells, without quotes and without the space around each cell.
#[must_use]
pub fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    let mut rest = line.chars().peekable();
    while let Some(next) = rest.next() {
        match next {
            // Two quotes in a row within quotes stand for one quote.
            '"' if quoted && rest.peek() == Some(&'"') => cell.extend(rest.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(core::mem::take(&mut cell)),
            other => cell.push(other),
        }
    }
    cells.push(cell);
    cells.into_iter().map(|cell| cell.trim().to_owned()).collect()
}

/// Reads the text of a cell as a delay in the unit 10^`unit` s. The inner value is `None` for a lost packet: an empty cell, `NaN`, `NA` or −1, in any unit.
/// Other negative delays come from clocks with an offset. Returns `None` for any other text.
#[must_use]
pub fn delay(text: &str, unit: i32) -> Option<Option<Attoseconds>> {
    if ["", "nan", "na"].iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Some(None);
    }
    let time = Attoseconds::parse(text, unit)?;
    Some(Some(time).filter(|time| Some(*time) != Attoseconds::parse("-1", unit)))
}

/// Column of the table.
struct Column {
    /// Name in small letters, with the suffix of the unit.
    name: String,
    /// Index of the column, counted from 0.
    place: usize,
    /// Unit of times, as an exponent of ten of a second.
    unit: i32,
}

/// Columns that are read.
struct Columns {
    sent: Column,
    /// Column `delay` or `arrived`.
    end: Column,
    /// `true` if `end` has times of arrival instead of delays.
    end_is_instant: bool,
    lost: Option<Column>,
    loss: Option<Column>,
}

impl Columns {
    /// Finds the columns in the header, in the line `line`.
    fn find(line: usize, header: &[String]) -> Result<Self, DelayTableError> {
        let refused = || DelayTableError::Columns { line, found: header.join(",") };
        let only = |names: &[&str]| {
            let mut found = header.iter().enumerate().filter_map(|(place, name)| column(place, name, names));
            let first = found.next();
            if found.next().is_some() { Err(refused()) } else { Ok(first) }
        };
        let end = only(&["delay", "arrived"])?.ok_or_else(refused)?;
        let sent = only(&["t", "sent"])?.ok_or_else(refused)?;
        Ok(Self { sent, end_is_instant: end.name.starts_with("arrived"), end, lost: only(&["lost"])?, loss: only(&["loss"])? })
    }
}

/// Returns the column with the index `place` if its name without the suffix of the unit is one of `wanted`.
fn column(place: usize, name: &str, wanted: &[&str]) -> Option<Column> {
    let name = name.to_ascii_lowercase();
    // The empty suffix is last and matches every name: a name without a suffix is in seconds.
    let (base, unit) = [("_ms", -3), ("_us", -6), ("_ns", -9), ("_s", 0), ("", 0)]
        .into_iter()
        .find_map(|(suffix, unit)| Some((name.strip_suffix(suffix)?, unit)))?;
    wanted.contains(&base).then(|| Column { name: name.clone(), place, unit })
}

/// Line of the file, split into cells.
struct Row {
    line: usize,
    cells: Vec<String>,
}

impl Row {
    /// Returns the text of a cell. A short line has empty cells at its end.
    fn text(&self, column: &Column) -> &str {
        self.cells.get(column.place).map_or("", String::as_str)
    }

    /// Reads a cell as a time.
    fn time(&self, column: &Column, expected: &'static str) -> Result<Attoseconds, DelayTableError> {
        Attoseconds::parse(self.text(column), column.unit).ok_or_else(|| self.cell(column, expected))
    }

    /// Reads the delay or the time of arrival, or `None` if the packet was lost.
    fn end(&self, column: &Column) -> Result<Option<Attoseconds>, DelayTableError> {
        delay(self.text(column), column.unit).ok_or_else(|| self.cell(column, A_DELAY))
    }

    /// Reads a cell as a flag. An empty cell is false.
    fn flag(&self, column: &Column) -> Result<bool, DelayTableError> {
        match self.text(column) {
            "1" => Ok(true),
            "0" | "" => Ok(false),
            _ => Err(self.cell(column, A_FLAG)),
        }
    }

    /// Returns the error for a faulty cell.
    fn cell(&self, column: &Column, expected: &'static str) -> DelayTableError {
        DelayTableError::Cell { line: self.line, column: column.name.clone(), found: self.text(column).to_string(), expected }
    }
}

#[cfg(test)]
mod tests;
