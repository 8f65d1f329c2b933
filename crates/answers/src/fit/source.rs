//! Measurements as they are read: a table of delays, a log of fates, or the captures of both ends.

use std::io::{self, Read};

use cohaptic_measure::fates::{self, ReadError};
use cohaptic_measure::fit::Measurements;
use cohaptic_measure::fit::captures::{self, CaptureError};
use cohaptic_wan::FateRow;

use super::ends::Ends;

/// Measurements, and where they are from.
#[derive(Clone, PartialEq, Debug)]
pub struct Source {
    pub(super) measurements: Measurements,
    /// Counts of a pair of captures.
    pub(super) matched: Option<Ends>,
    /// `true` if both ends have one clock, as in a log of fates.
    pub(super) has_one_clock: bool,
}

/// Why measurements cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The system cannot read them.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A line is no text.
    #[error("line {line}: not UTF-8: expected a text file")]
    NotText {
        /// The number of the line, from 1.
        line: u64,
    },
    /// The capture of one end alone.
    #[error("found the capture of one end: expected two, since a delay is the time from the one to the other")]
    OneEnd,
    /// The content is no table and no log.
    #[error("{0}")]
    Content(String),
}

/// The first bytes of a file, which show of which kind it is.
const HEAD: u64 = 256;
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

impl Source {
    /// Reads a table of delays or a log of fates. A log is read line by line, a table as a whole: `as_table` gets the rest of the reader before, to limit its
    /// length.
    ///
    /// # Errors
    ///
    /// [`SourceError`] if it cannot be read or is neither; and for a capture, which is that of one end alone.
    pub fn read<R: Read>(mut from: R, as_table: impl FnOnce(R) -> io::Result<R>) -> Result<Self, SourceError> {
        let mut bytes = Vec::new();
        from.by_ref().take(HEAD).read_to_end(&mut bytes)?;
        if captures::is_capture(&bytes) {
            return Err(SourceError::OneEnd);
        }
        if bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes).starts_with(FateRow::HEADER.as_bytes()) {
            let log = fates::read(bytes.chain(from)).map_err(|error| match error {
                ReadError::Io(error) => SourceError::Io(error),
                ReadError::NotText { line } => SourceError::NotText { line },
                other @ ReadError::Log(_) => SourceError::Content(other.to_string()),
            })?;
            return Ok(Self { measurements: Measurements::from_fates(&log), matched: None, has_one_clock: true });
        }
        as_table(from)?.read_to_end(&mut bytes)?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let right = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            SourceError::NotText { line: right.iter().filter(|byte| **byte == b'\n').count() as u64 + 1 }
        })?;
        let measurements = Measurements::from_csv(&text).map_err(|error| SourceError::Content(error.to_string()))?;
        Ok(Self { measurements, matched: None, has_one_clock: false })
    }

    /// Reads the captures of both ends. `port`: only datagrams to that UDP port count.
    ///
    /// # Errors
    ///
    /// Those of [`captures::between`].
    pub fn between(sender: impl Read, receiver: impl Read, port: Option<u16>) -> Result<Self, CaptureError> {
        let (measurements, ends) = Ends::of(captures::between(sender, receiver, port)?);
        Ok(Self { measurements, matched: Some(ends), has_one_clock: false })
    }

    /// Measurements of two clocks.
    #[must_use]
    pub const fn of(measurements: Measurements) -> Self {
        Self { measurements, matched: None, has_one_clock: false }
    }
}
