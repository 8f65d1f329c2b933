//! Recording of cross-traffic: the instant and the size of each packet.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::{Bytes, Instant};

use crate::delay_table::{Attoseconds, cells};

/// Packets of a recording, in the order of their instants. After the last packet, no further packet comes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CrossRecording(Arc<[(Instant, Bytes)]>);

/// Reason for the refusal of a recording. Lines count from 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum CrossRecordingError {
    /// The first line does not name the columns `t` and `bytes`.
    Columns {
        /// Number of the line.
        line: usize,
    },
    /// A cell cannot be read.
    Cell {
        /// Number of the line.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// Description of the expected value.
        expected: &'static str,
    },
    /// A packet comes before the packet of the row above.
    Order {
        /// Number of the line.
        line: usize,
    },
    /// The recording has no packet.
    Empty,
}

impl CrossRecordingError {
    /// Returns the faulty line, counted from 1, or `None` if no single line is at fault.
    #[must_use]
    pub const fn line(&self) -> Option<usize> {
        match self {
            Self::Columns { line } | Self::Cell { line, .. } | Self::Order { line } => Some(*line),
            Self::Empty => None,
        }
    }
}

impl fmt::Display for CrossRecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Columns { line } => write!(f, "line {line}: no recording of cross-traffic: expected the columns t,bytes"),
            Self::Cell { line, column, expected } => write!(f, "line {line}, column {column}: expected {expected}"),
            Self::Order { line } => write!(f, "line {line}: a packet before the packet of the row above: expected rows in the order of time"),
            Self::Empty => f.write_str("no row below the columns: expected at least one packet"),
        }
    }
}

impl core::error::Error for CrossRecordingError {}

impl CrossRecording {
    /// Reads a CSV. The first line names the columns, `t` (seconds since the start of the run, exact to the nanosecond) and `bytes` (size above zero); other
    /// columns are skipped. Rows are in the order of time; equal times are allowed. Blank lines and lines that begin with # are skipped.
    ///
    /// # Errors
    ///
    /// [`CrossRecordingError`] with the line. No text makes this function panic.
    pub fn parse(text: &str) -> Result<Self, CrossRecordingError> {
        // Spreadsheets write a byte order mark before the first name.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let content = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
        let mut lines = (1..).zip(text.lines()).filter(|(_, line)| content(line));
        let (line, header) = lines.next().unwrap_or((1, ""));
        let names = cells(header);
        let place = |name: &str| names.iter().position(|found| found.eq_ignore_ascii_case(name)).ok_or(CrossRecordingError::Columns { line });
        let (time, size) = (place("t")?, place("bytes")?);
        let mut packets: Vec<(Instant, Bytes)> = Vec::new();
        for (line, row) in lines {
            let cells = cells(row);
            let refused = |column, expected| CrossRecordingError::Cell { line, column, expected };
            let at = cells.get(time).and_then(|cell| Attoseconds::parse(cell, 0)?.nanos()).map(Instant::from_nanos);
            let at = at.ok_or_else(|| refused("t", "a time in seconds, not negative"))?;
            let bytes = cells.get(size).and_then(|cell| cell.parse().ok()).filter(|bytes| *bytes > 0).map(Bytes::new);
            let bytes = bytes.ok_or_else(|| refused("bytes", "a whole number of bytes above zero"))?;
            if packets.last().is_some_and(|(before, _)| at < *before) {
                return Err(CrossRecordingError::Order { line });
            }
            packets.push((at, bytes));
        }
        if packets.is_empty() { Err(CrossRecordingError::Empty) } else { Ok(Self(packets.into())) }
    }

    /// Returns the number of packets.
    #[must_use]
    pub fn packets(&self) -> usize {
        self.0.len()
    }

    /// Returns the packet with the index `index`, or `None` after the last packet.
    pub(super) fn packet(&self, index: usize) -> Option<(Instant, Bytes)> {
        self.0.get(index).copied()
    }

    /// Returns the index of the first packet at or after `from`.
    pub(super) fn first_from(&self, from: Instant) -> usize {
        self.0.partition_point(|(at, _)| *at < from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_packets() {
        let recording = CrossRecording::parse("# from a switch\nport, Bytes, t\n\n7,1500,0\n7,40,0.0000000012\n").unwrap();
        let packet = |nanos, bytes| Some((Instant::from_nanos(nanos), Bytes::new(bytes)));
        assert_eq!([0, 1, 2].map(|index| recording.packet(index)), [packet(0, 1500), packet(1, 40), None]);
        assert_eq!([0, 1, 2].map(|nanos| recording.first_from(Instant::from_nanos(nanos))), [0, 1, 2]);
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let error = |text: &str| CrossRecording::parse(text).unwrap_err();
        assert_eq!(error("t,delay\n0,1\n"), CrossRecordingError::Columns { line: 1 });
        assert_eq!(error("t,bytes\n"), CrossRecordingError::Empty);
        assert_eq!(error("t,bytes\n2,1\n\n1,1\n"), CrossRecordingError::Order { line: 4 });
        for (row, column) in [("-1,1", "t"), ("x,1", "t"), ("1e99,1", "t"), ("1,0", "bytes"), ("1,1.5", "bytes"), ("1", "bytes")] {
            let found = error(&alloc::format!("t,bytes\n{row}\n"));
            assert!(matches!(found, CrossRecordingError::Cell { line: 2, column: named, .. } if named == column), "{row}: {found}");
        }
    }
}
