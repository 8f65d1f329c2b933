//! Reads measurements of a link: a table of delays, a log of fates, the captures of both ends, or a file of another program.

use std::io::{self, Read};

use cohaptic_measure::fates::{self, ReadError};
use cohaptic_measure::fit::Measurements;
use cohaptic_measure::fit::captures::{self, CaptureError};
use cohaptic_measure::fit::readers::{self, Content, Direction, Recording};
use cohaptic_units::Bytes;
use cohaptic_wan::FateRow;

use super::ends::Ends;
use super::probed::Probed;

/// Measurements with their origin, or a link that a file records.
#[derive(Clone, PartialEq, Debug)]
pub struct Source {
    pub(super) found: Found,
}

/// Content of a source.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Found {
    Measured(Box<Measured>),
    /// A link as it is recorded, which needs no estimate.
    Recorded(Box<Recording>),
}

/// Measurements with their origin.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Measured {
    pub(super) measurements: Measurements,
    /// Counts of a pair of captures; `None` for other sources.
    pub(super) matched: Option<Ends>,
    /// Statements of the file of another program; `None` for other sources.
    pub(super) probed: Option<Probed>,
    /// `true` if both ends share one clock, as in a log of fates and in a round trip.
    pub(super) has_one_clock: bool,
}

/// Choices for reading the file of another program.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ReadAs {
    /// Way of the packets, of a file that has both ways.
    pub direction: Option<Direction>,
    /// Share of the round trip that is the delay of one way, above 0 and at most 1. A round trip without a share is refused.
    pub split: Option<f64>,
    /// Bytes that leave at each instant of a recorded line. `None` for those of CellReplay, 1400 bytes.
    pub bytes: Option<Bytes>,
    /// `true` if a walk of the rate is estimated from a measured rate.
    pub walk: bool,
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

/// Number of leading bytes for finding the kind of a file.
const HEAD: u64 = 256;
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

impl Source {
    /// Reads a table of delays, a log of fates or a file of another program. A log is read line by line, other files as a whole. Before such a file is read,
    /// `as_table` gets the rest of the reader, and can limit the length.
    ///
    /// # Errors
    ///
    /// [`SourceError`] if the file cannot be read, is of no known kind, or cannot be read as `read_as` says; [`SourceError::OneEnd`] for a capture.
    pub fn read<R: Read>(mut from: R, as_table: impl FnOnce(R) -> io::Result<R>, read_as: &ReadAs) -> Result<Self, SourceError> {
        let mut bytes = Vec::new();
        from.by_ref().take(HEAD).read_to_end(&mut bytes)?;
        // A capture is found by its magic number before it fails as a text.
        if captures::is_capture(&bytes) {
            return Err(SourceError::OneEnd);
        }
        // Some editors begin a text with a byte order mark.
        if bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes).starts_with(FateRow::HEADER.as_bytes()) {
            // Wrong options are refused before a long log is read.
            read_as.is_not_needed()?;
            // The bytes of the head are already taken from the reader, so they are put before the rest.
            let log = fates::read(bytes.chain(from)).map_err(|error| match error {
                ReadError::Io(error) => SourceError::Io(error),
                ReadError::NotText { line } => SourceError::NotText { line },
                other @ (ReadError::Log(_) | _) => SourceError::Content(other.to_string()),
            })?;
            return Ok(Self::measured(Measurements::from_fates(&log), None, true));
        }
        as_table(from)?.read_to_end(&mut bytes)?;
        let text = String::from_utf8(bytes).map_err(|error| {
            // The bytes before the fault are valid, so their line feeds give the number of the faulty line.
            let right = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            SourceError::NotText { line: right.iter().filter(|byte| **byte == b'\n').count() as u64 + 1 }
        })?;
        let refused = |error: &dyn std::fmt::Display| SourceError::Content(error.to_string());
        match readers::read(&text, read_as.direction).map_err(|error| refused(&error))? {
            Some(Content::Delays(delays)) => {
                read_as.is_without_rates()?;
                let (measurements, probed) = Probed::of(delays, read_as.split).map_err(|error| refused(&error))?;
                let has_one_clock = probed.has_one_clock();
                Ok(Self { found: Found::Measured(Box::new(Measured { measurements, matched: None, probed: Some(probed), has_one_clock })) })
            }
            Some(Content::Link(recording)) => {
                read_as.is_without_round_trips()?;
                let recording = match read_as.bytes {
                    Some(bytes) => recording.with_bytes(bytes.get()).map_err(|error| refused(&error))?,
                    None => recording,
                };
                let recording = if read_as.walk { recording.with_rate_walk().map_err(|error| refused(&error))? } else { recording };
                Ok(Self { found: Found::Recorded(Box::new(recording)) })
            }
            None => {
                read_as.is_not_needed()?;
                // A table does not say which clock showed its delays, so both ends are taken to have their own clocks.
                let measurements = Measurements::from_csv(&text).map_err(|error| refused(&error))?;
                Ok(Self::measured(measurements, None, false))
            }
        }
    }

    /// Reads the captures of both ends. `port`: only datagrams to this UDP port count.
    ///
    /// # Errors
    ///
    /// The errors of [`captures::between`].
    pub fn between(sender: impl Read, receiver: impl Read, port: Option<u16>) -> Result<Self, CaptureError> {
        let (measurements, ends) = Ends::of(captures::between(sender, receiver, port)?);
        Ok(Self::measured(measurements, Some(ends), false))
    }

    /// Takes measurements made with two clocks.
    #[must_use]
    pub fn of(measurements: Measurements) -> Self {
        Self::measured(measurements, None, false)
    }

    fn measured(measurements: Measurements, matched: Option<Ends>, has_one_clock: bool) -> Self {
        Self { found: Found::Measured(Box::new(Measured { measurements, matched, probed: None, has_one_clock })) }
    }
}

impl ReadAs {
    /// Refuses choices without a meaning for a table of delays or a log of fates.
    fn is_not_needed(&self) -> Result<(), SourceError> {
        self.is_without_round_trips()?;
        self.is_without_rates()
    }

    /// Refuses choices without a meaning for a file without round trips.
    fn is_without_round_trips(&self) -> Result<(), SourceError> {
        none_of(
            [("direction", self.direction.is_some()), ("split", self.split.is_some())],
            "the file has no round trips: expected one of IRTT, LENS or ping",
        )
    }

    /// Refuses choices without a meaning for a file without rates.
    fn is_without_rates(&self) -> Result<(), SourceError> {
        none_of(
            [("bytes", self.bytes.is_some()), ("walk", self.walk)],
            "the file has no rates: expected one of iperf3, mahimahi or CellReplay (heavy)",
        )
    }
}

/// Refuses the first choice that was made.
fn none_of(choices: [(&str, bool); 2], why: &str) -> Result<(), SourceError> {
    match choices.iter().find(|(_, is_made)| *is_made) {
        Some((name, _)) => Err(SourceError::Content(format!("{name}: {why}"))),
        None => Ok(()),
    }
}
