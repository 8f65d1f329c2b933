//! Fate logs as files, read back exactly by [`FateLog`] and replayed by a link.
//!
//! The columns are those of [`FateRow`]. The writer keeps no rows in memory. The reader keeps the log, and a single line of text.

use std::io::{self, BufRead as _, BufReader, Read, Write};

use cohaptic_wan::{FateLog, FateLogError, FateLogReader, FateRow, PacketRecord};

/// Writes a fate log row by row, in the order of the calls.
///
/// Pass a [`std::io::BufWriter`], because each row is a write of its own. Call [`FateWriter::finish`] to learn of errors of the last rows.
#[derive(Debug)]
pub struct FateWriter<W> {
    to: W,
}

impl<W: Write> FateWriter<W> {
    /// Begins a log with the header line.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn new(mut to: W) -> io::Result<Self> {
        writeln!(to, "{}", FateRow::HEADER)?;
        Ok(Self { to })
    }

    /// Writes a row.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn write(&mut self, record: &PacketRecord) -> io::Result<()> {
        writeln!(self.to, "{}", FateRow(*record))
    }

    /// Ends the log: flushes the writer and returns the writer.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        self.to.flush()?;
        Ok(self.to)
    }
}

/// Error of reading a fate log.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
    /// A line is not UTF-8.
    #[error("line {line}: not UTF-8: expected a text file")]
    NotText {
        /// Number of the line, from 1.
        line: u64,
    },
    /// The text is not a complete fate log.
    #[error(transparent)]
    Log(#[from] FateLogError),
}

/// Length of the longest line read \[byte\]. A row has at most 110 bytes, so the first part of a longer line is refused as no row.
const LONGEST_LINE: u64 = 4096;

/// Reads a fate log.
///
/// # Errors
///
/// [`ReadError`] if the file cannot be read, is not UTF-8, or is not a complete fate log. The error names line, column and what was expected.
pub fn read(from: impl Read) -> Result<FateLog, ReadError> {
    let mut from = BufReader::with_capacity(1 << 16, from);
    let mut log = FateLogReader::default();
    let mut bytes = Vec::new();
    for line in 1.. {
        bytes.clear();
        // The limit keeps a file without line breaks from filling the memory.
        if from.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut bytes)? == 0 {
            break;
        }
        let text = core::str::from_utf8(&bytes).map_err(|_| ReadError::NotText { line })?;
        let text = text.strip_suffix('\n').map_or(text, |text| text.strip_suffix('\r').unwrap_or(text));
        log.line(text)?;
    }
    Ok(log.finish()?)
}

#[cfg(test)]
mod tests {
    use cohaptic_units::{Bytes, Instant};
    use cohaptic_wan::{DropCause, Fate};

    use super::*;

    #[test]
    fn what_was_written_is_read_back_whatever_the_order() {
        let record = |sequence, at, fate| PacketRecord {
            path: (),
            sequence,
            copy: 0,
            offered: Instant::from_nanos(sequence),
            at: Instant::from_nanos(at),
            size: Bytes::new(1_000),
            fate,
            marked: sequence == 1,
            damaged: sequence == 0,
        };
        let rows = [record(1, 5, Fate::Dropped(DropCause::QueueFull)), record(0, 9, Fate::Delivered(Instant::from_nanos(9)))];
        let mut writer = FateWriter::new(Vec::new()).unwrap();
        for row in &rows {
            writer.write(row).unwrap();
        }
        let file = writer.finish().unwrap();
        assert_eq!(read(file.as_slice()).unwrap().records(), [rows[1], rows[0]]);
    }

    #[test]
    fn lines_are_those_of_a_text_that_is_read_as_a_whole() {
        let row = "0,0,0,64,24000000,delivered,0,0";
        let header = FateRow::HEADER;
        for text in [
            format!("\u{feff}{header}\r\n{row}\r\n"),
            format!("{header}\n{row}"),
            format!("{header}\n{row}\n\n"),
            String::new(),
            format!("{header}\n{row}\r"),
        ] {
            let [streamed, whole] =
                [read(text.as_bytes()).map_err(|error| error.to_string()), FateLog::parse(&text).map_err(|error| error.to_string())];
            assert_eq!(streamed, whole, "{text:?}");
        }
    }

    #[test]
    fn a_file_that_is_no_text_is_refused() {
        assert!(matches!(read([0xff, 0xfe, 0x00].as_slice()), Err(ReadError::NotText { line: 1 })));
        let zeros = io::repeat(0).take(1 << 40);
        assert!(matches!(read(zeros), Err(ReadError::Log(FateLogError::Header { found })) if found.len() as u64 == LONGEST_LINE));
        assert_eq!(read(b"x".as_slice()).unwrap_err().to_string(), FateLog::parse("x").unwrap_err().to_string());
    }
}
