//! Reasons for the refusal of a fate log.

use alloc::string::String;
use core::fmt;

use cohaptic_units::Instant;

use super::row::FateRow;
use crate::fates::fate::DropCause;

/// Reason for the refusal of a text or of a list of records as a complete fate log. Lines are counted from 1, and the header is line 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FateLogError {
    /// The first line is not the header.
    Header {
        /// Text of the first line.
        found: String,
    },
    /// A row does not have eight cells.
    Cells {
        /// Number of the line.
        line: u64,
        /// Number of cells of the row.
        found: usize,
    },
    /// A cell cannot be read.
    Cell {
        /// Number of the line.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// Text of the cell.
        found: String,
        /// Description of the expected text.
        expected: &'static str,
    },
    /// No fate has the name in a cell.
    UnknownFate {
        /// Number of the line.
        line: u64,
        /// Text of the cell.
        found: String,
    },
    /// A packet has no row, but a later packet has a row.
    Missing {
        /// Number of the packet without a row.
        sequence: u64,
        /// Line of the later packet.
        line: u64,
        /// Number of the later packet.
        later: u64,
    },
    /// A packet was offered before the previous packet.
    OfferedBefore {
        /// Line of the packet.
        line: u64,
        /// Instant of the packet's offer.
        offered: Instant,
        /// Line of the previous packet.
        earlier_line: u64,
        /// Instant of the previous packet's offer.
        earlier: Instant,
    },
    /// A fate of a packet lies before the packet's offer, or an arrival has two different instants.
    ImpossibleTime {
        /// Number of the line.
        line: u64,
        /// Instant of the packet's offer.
        offered: Instant,
        /// Instant of the row.
        at: Instant,
    },
    /// Two rows of a packet have different instants of offering or different sizes.
    Contradiction {
        /// Number of the packet.
        sequence: u64,
        /// Line of the different row.
        line: u64,
        /// Line of the packet's first row.
        other_line: u64,
    },
    /// A packet or copy has two ends.
    TwoEnds {
        /// Number of the packet.
        sequence: u64,
        /// Number of the copy; 0 is the packet itself.
        copy: u8,
        /// Line of the surplus end.
        line: u64,
    },
    /// A packet or copy has no end.
    NoEnd {
        /// Number of the packet.
        sequence: u64,
        /// Number of the copy; 0 is the packet itself.
        copy: u64,
    },
    /// A packet has more copies than `duplicated` rows.
    CopyFromNowhere {
        /// Number of the packet.
        sequence: u64,
        /// Number of copies with an end, without the packet itself.
        copies: u64,
        /// Number of `duplicated` rows.
        made: u64,
    },
}

impl fmt::Display for FateLogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header { found } => write!(f, "line 1: found \"{found}\", expected the header \"{}\"", FateRow::HEADER),
            Self::Cells { line, found } => write!(f, "line {line}: found {found} cells, expected {} ({})", FateRow::COLUMNS.len(), FateRow::HEADER),
            Self::Cell { line, column, found, expected } => write!(f, "line {line}, column {column}: found \"{found}\", expected {expected}"),
            Self::UnknownFate { line, found } => write!(f, "line {line}, column fate: found \"{found}\", expected {FateNames}"),
            Self::Missing { sequence, line, later } => {
                write!(f, "packet {sequence} has no row, though line {line} has packet {later}: expected every packet from 0")
            }
            Self::OfferedBefore { line, offered, earlier_line, earlier } => {
                write!(f, "line {line}: offered at {offered}, expected not before the packet before it (line {earlier_line}: {earlier})")
            }
            Self::ImpossibleTime { line, offered, at } => write!(
                f,
                "line {line}: offered at {offered} and done with at {at}: expected an instant not before it was offered, and the same in the fate"
            ),
            Self::Contradiction { sequence, line, other_line } => {
                write!(f, "line {line}: packet {sequence} has another size or offering instant than on line {other_line}")
            }
            Self::TwoEnds { sequence, copy, line } => {
                write!(f, "line {line}: copy {copy} of packet {sequence} has a second end: expected one row `delivered` or with a drop cause")
            }
            Self::NoEnd { sequence, copy } => {
                write!(f, "copy {copy} of packet {sequence} has no end: expected a row `delivered` or with a drop cause (was the log cut off?)")
            }
            Self::CopyFromNowhere { sequence, copies, made } => {
                write!(f, "packet {sequence} has {copies} copies beyond itself and {made} rows `duplicated`: expected as many of one as of the other")
            }
        }
    }
}

impl core::error::Error for FateLogError {}

/// Names for the column `fate`, for messages.
struct FateNames;

impl fmt::Display for FateNames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("delivered, duplicated")?;
        for cause in DropCause::ALL {
            write!(f, ", {}", cause.name())?;
        }
        Ok(())
    }
}
