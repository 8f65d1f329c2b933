//! Reads measurements of a link: a table of delays, a log of fates, or the captures of both ends.

use std::io::{self, Read};

use cohaptic_measure::fates::{self, ReadError};
use cohaptic_measure::fit::Measurements;
use cohaptic_measure::fit::captures::{self, CaptureError};
use cohaptic_wan::FateRow;

use super::ends::Ends;

/// Measurements with their origin.
#[derive(Clone, PartialEq, Debug)]
pub struct Source {
    pub(super) measurements: Measurements,
    /// Counts of a pair of captures; `None` for other sources.
    pub(super) matched: Option<Ends>,
    /// `true` if both ends share one clock, as in a log of fates.
    pub(super) has_one_clock: bool,
}

/// Why measurements cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The operating system cannot read the file.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A line is not UTF-8.
    #[error("line {line}: not UTF-8: expected a text file")]
    NotText {
        /// Number of the line, from 1.
        line: u64,
    },
    /// The file is the capture of one end only.
    #[error("found the capture of one end: expected two, since a delay is the time from the one to the other")]
    OneEnd,
    /// The content is neither a table nor a log.
    #[error("{0}")]
    Content(String),
}

/// Number of leading bytes which show the kind of a file.
const HEAD: u64 = 256;
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

impl Source {
    /// Reads a table of delays or a log of fates. A log is read line by line, a table as a whole. Before a table is read, `as_table` gets the rest of the
    /// reader, and can limit the length.
    ///
    /// # Errors
    ///
    /// [`SourceError`] if the file cannot be read or is neither a table nor a log; [`SourceError::OneEnd`] for a capture.
    pub fn read<R: Read>(mut from: R, as_table: impl FnOnce(R) -> io::Result<R>) -> Result<Self, SourceError> {
        let mut bytes = Vec::new();
        from.by_ref().take(HEAD).read_to_end(&mut bytes)?;
        // A capture is found by its magic number before it fails as a text.
        if captures::is_capture(&bytes) {
            return Err(SourceError::OneEnd);
        }
        // Some editors begin a text with a byte order mark.
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
            // The bytes before the fault are valid, so their line feeds give the number of the faulty line.
            let right = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            SourceError::NotText { line: right.iter().filter(|byte| **byte == b'\n').count() as u64 + 1 }
        })?;
        let measurements = Measurements::from_csv(&text).map_err(|error| SourceError::Content(error.to_string()))?;
        Ok(Self { measurements, matched: None, has_one_clock: false })
    }

    /// Reads the captures of both ends. `port`: only datagrams to this UDP port count.
    ///
    /// # Errors
    ///
    /// The errors of [`captures::between`].
    pub fn between(sender: impl Read, receiver: impl Read, port: Option<u16>) -> Result<Self, CaptureError> {
        let (measurements, ends) = Ends::of(captures::between(sender, receiver, port)?);
        Ok(Self { measurements, matched: Some(ends), has_one_clock: false })
    }

    /// Takes measurements made with two clocks.
    #[must_use]
    pub const fn of(measurements: Measurements) -> Self {
        Self { measurements, matched: None, has_one_clock: false }
    }
}
