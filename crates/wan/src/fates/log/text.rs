//! Reader of the text of a fate log.

use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::str::FromStr;

use cohaptic_units::{Bytes, Instant};

use super::FateLog;
use super::error::FateLogError;
use super::row::FateRow;
use crate::fates::fate::{DropCause, Fate};
use crate::fates::record::PacketRecord;

/// Record with the number of its line.
pub(super) type Numbered = (u64, PacketRecord);

/// Reader of a fate log line by line, for files whose text does not fit into memory together with the log.
///
/// ```
/// use cohaptic_wan::{FateLogReader, FateRow};
///
/// let mut reader = FateLogReader::default();
/// reader.line(FateRow::HEADER)?;
/// reader.line("0,0,0,64,24000000,delivered,0,0")?;
/// assert_eq!(reader.finish()?.packets(), 1);
/// # Ok::<(), cohaptic_wan::FateLogError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct FateLogReader {
    /// Number of lines read so far, the header included.
    lines: u64,
    rows: Vec<Numbered>,
}

impl FateLogReader {
    /// Reads the next line, without its line break. The first line is the header.
    ///
    /// # Errors
    ///
    /// [`FateLogError`] with the line, the column and the expected text.
    pub fn line(&mut self, line: &str) -> Result<(), FateLogError> {
        self.lines += 1;
        if self.lines > 1 {
            self.rows.push((self.lines, record(self.lines, line)?));
            return Ok(());
        }
        // Some spreadsheets begin a file with a byte order mark.
        let header = line.strip_prefix('\u{feff}').unwrap_or(line);
        if header == FateRow::HEADER { Ok(()) } else { Err(FateLogError::Header { found: header.to_string() }) }
    }

    /// Checks the log after its last line, and returns it.
    ///
    /// # Errors
    ///
    /// [`FateLogError`] if no line was read, or if [`FateLog::new`] would refuse the records.
    pub fn finish(self) -> Result<FateLog, FateLogError> {
        if self.lines == 0 {
            return Err(FateLogError::Header { found: String::new() });
        }
        FateLog::check(self.rows)
    }
}

/// Returns the record of a row, or the first error of the row.
fn record(line: u64, row: &str) -> Result<PacketRecord, FateLogError> {
    let mut cells = [""; FateRow::COLUMNS.len()];
    let found = row.split(',').count();
    if found != cells.len() {
        return Err(FateLogError::Cells { line, found });
    }
    // The number of cells was compared with the number of columns above, so every cell is filled.
    for (cell, text) in cells.iter_mut().zip(row.split(',')) {
        *cell = text;
    }
    let row = Row { line, cells };
    // Numbers of columns are those of [`FateRow::COLUMNS`]. `at` is read first, because the fate `delivered` needs it.
    let at = Instant::from_nanos(row.number(4)?);
    Ok(PacketRecord {
        path: (),
        sequence: row.number(0)?,
        copy: row.read(1, "a number from 0 to 255")?,
        offered: Instant::from_nanos(row.number(2)?),
        at,
        size: Bytes::new(row.number(3)?),
        fate: row.fate(5, at)?,
        marked: row.flag(6)?,
        damaged: row.flag(7)?,
    })
}

/// Cells of a row, indexed by column.
struct Row<'a> {
    line: u64,
    cells: [&'a str; FateRow::COLUMNS.len()],
}

impl Row<'_> {
    /// Reads a whole number.
    fn number(&self, column: usize) -> Result<u64, FateLogError> {
        self.read(column, "a whole number from 0 to 2^64 - 1")
    }

    /// Reads a number of the type `T`. `expected` describes the number for the error.
    fn read<T: FromStr>(&self, column: usize, expected: &'static str) -> Result<T, FateLogError> {
        let text = self.cells[column];
        // Rust also parses "+1", which no writer of this format writes.
        let plain = text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse().ok().filter(|_| plain).ok_or_else(|| self.refused(column, expected))
    }

    /// Reads a flag, 0 or 1.
    fn flag(&self, column: usize) -> Result<bool, FateLogError> {
        match self.cells[column] {
            "0" => Ok(false),
            "1" => Ok(true),
            _ => Err(self.refused(column, "0 or 1")),
        }
    }

    /// Reads a fate by its name. A delivery has the instant `at`.
    fn fate(&self, column: usize, at: Instant) -> Result<Fate, FateLogError> {
        let name = self.cells[column];
        if let Some(cause) = DropCause::from_name(name) {
            return Ok(Fate::Dropped(cause));
        }
        [Fate::Delivered(at), Fate::Duplicated]
            .into_iter()
            .find(|fate| fate.name() == name)
            .ok_or_else(|| FateLogError::UnknownFate { line: self.line, found: name.to_string() })
    }

    /// Returns the error for a cell that is refused.
    fn refused(&self, column: usize, expected: &'static str) -> FateLogError {
        FateLogError::Cell { line: self.line, column: FateRow::COLUMNS[column], found: self.cells[column].to_string(), expected }
    }
}
