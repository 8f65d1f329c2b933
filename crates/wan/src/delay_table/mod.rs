//! Delays over time as a CSV file: what `cohaptic fit` estimates a link from, and what the key `trace` replays.
//!
//! The first line names the columns, in any order and in capitals or small letters; columns of other names are passed over:
//!
//! | column | is |
//! | --- | --- |
//! | `t` or `sent` | when the packet was sent |
//! | `delay` | its one-way delay |
//! | `arrived` | instead of `delay`: when it arrived, by the same clock |
//! | `lost` | may be there too: 1 if the packet was lost, 0 or empty if not |
//!
//! Times are in seconds, or in the unit that the name ends in: `_s`, `_ms`, `_us`, `_ns`. A packet whose delay or arrival is empty, `NaN`, `NA` or −1 was lost. Digits
//! are kept exactly up to 10⁻¹⁸ s, so that instants may be counted from 1970. Rows stand in the order of sending; equal times are allowed. A byte order mark, blank
//! lines and lines that begin with # are skipped. Cells may stand in double quotes.

mod attoseconds;

use alloc::borrow::ToOwned;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

pub use attoseconds::Attoseconds;

/// A row: a packet, or what the path did from that time on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DelayRow {
    /// The line of the file, from 1.
    pub line: usize,
    /// The time of sending.
    pub sent: Attoseconds,
    /// The delay, which is negative if clocks are offset; `None`: lost.
    pub delay: Option<Attoseconds>,
    /// The cell of the column `loss`, which a replay takes as a probability; empty if there is none.
    pub loss: String,
}

/// The reason why a file is no table of delays. Lines count from 1.
#[derive(Clone, PartialEq, Debug)]
pub enum DelayTableError {
    /// A column is missing, twice there, or excluded by another.
    Columns {
        /// The line of the header.
        line: usize,
        /// The header.
        found: String,
    },
    /// A cell cannot be read.
    Cell {
        /// The line.
        line: usize,
        /// The name of the column.
        column: String,
        /// The text of the cell.
        found: String,
        /// The expected content.
        expected: &'static str,
    },
    /// A time is before that of the row above.
    TimeGoesBack {
        /// The line.
        line: usize,
        /// By how much \[s\].
        back_s: f64,
    },
}

impl DelayTableError {
    /// The line at fault, from 1.
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
const A_DELAY: &str = "a decimal number, or for a lost packet nothing, NaN, NA or -1";
const A_FLAG: &str = "0 or 1";

/// Reads a table of delays. See the [module](self) for the format.
///
/// # Errors
///
/// [`DelayTableError`] with line, column and what was expected. Never panics.
pub fn read(text: &str) -> Result<Vec<DelayRow>, DelayTableError> {
    // Spreadsheets put a byte order mark before the first name.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let content = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| content(line));
    let (line, header) = lines.next().unwrap_or((1, ""));
    let columns = Columns::find(line, &cells(header))?;
    let mut rows: Vec<DelayRow> = Vec::new();
    for (line, text) in lines {
        let row = Row { line, cells: cells(text) };
        let sent = row.time(&columns.sent, A_TIME)?;
        let back = rows.last().and_then(|before| before.sent.seconds_since(sent)).filter(|back_s| *back_s > 0.0);
        if let Some(back_s) = back {
            return Err(DelayTableError::TimeGoesBack { line, back_s });
        }
        let is_lost = columns.lost.as_ref().map_or(Ok(false), |column| row.flag(column))?;
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

/// The cells of a line, without the space around them and without quotes.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    let mut rest = line.chars().peekable();
    while let Some(next) = rest.next() {
        match next {
            // A quote that is written twice within quotes is one.
            '"' if quoted && rest.peek() == Some(&'"') => cell.extend(rest.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(core::mem::take(&mut cell)),
            other => cell.push(other),
        }
    }
    cells.push(cell);
    cells.into_iter().map(|cell| cell.trim().to_owned()).collect()
}

/// The place of a column, and its unit as a power of ten of a second.
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
    loss: Option<Column>,
}

impl Columns {
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

fn column(place: usize, name: &str, wanted: &[&str]) -> Option<Column> {
    let name = name.to_ascii_lowercase();
    let (base, unit) = [("_ms", -3), ("_us", -6), ("_ns", -9), ("_s", 0), ("", 0)]
        .into_iter()
        .find_map(|(suffix, unit)| Some((name.strip_suffix(suffix)?, unit)))?;
    wanted.contains(&base).then(|| Column { name: name.clone(), place, unit })
}

struct Row {
    line: usize,
    cells: Vec<String>,
}

impl Row {
    fn text(&self, column: &Column) -> &str {
        self.cells.get(column.place).map_or("", String::as_str)
    }

    fn time(&self, column: &Column, expected: &'static str) -> Result<Attoseconds, DelayTableError> {
        Attoseconds::parse(self.text(column), column.unit).ok_or_else(|| self.cell(column, expected))
    }

    /// The delay or the arrival; `None` if the packet was lost.
    fn end(&self, column: &Column) -> Result<Option<Attoseconds>, DelayTableError> {
        let text = self.text(column);
        if ["", "nan", "na"].iter().any(|word| text.eq_ignore_ascii_case(word)) {
            return Ok(None);
        }
        let time = self.time(column, A_DELAY)?;
        // Programs write -1 in whatever unit their column has. Other negative delays are those of clocks that are apart.
        Ok(Some(time).filter(|time| Some(*time) != Attoseconds::parse("-1", column.unit)))
    }

    fn flag(&self, column: &Column) -> Result<bool, DelayTableError> {
        match self.text(column) {
            "1" => Ok(true),
            "0" | "" => Ok(false),
            _ => Err(self.cell(column, A_FLAG)),
        }
    }

    fn cell(&self, column: &Column, expected: &'static str) -> DelayTableError {
        DelayTableError::Cell { line: self.line, column: column.name.clone(), found: self.text(column).to_string(), expected }
    }
}

#[cfg(test)]
mod tests;
