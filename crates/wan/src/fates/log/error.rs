//! Why a fate log is refused.

use alloc::string::String;
use core::fmt;

use cohaptic_units::Instant;

use super::row::FateRow;
use crate::fates::fate::DropCause;

/// Why a text or a list of records is no complete fate log. Lines are counted from 1, the header being line 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FateLogError {
    /// The first line is not the header.
    Header {
        /// The first line.
        found: String,
    },
    /// A row does not have eight cells.
    Cells {
        /// The line.
        line: u64,
        /// How many cells it has.
        found: usize,
    },
    /// A cell cannot be read.
    Cell {
        /// The line.
        line: u64,
        /// The name of the column.
        column: &'static str,
        /// What stands there.
        found: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// The fate has no such name.
    UnknownFate {
        /// The line.
        line: u64,
        /// What stands there.
        found: String,
    },
    /// A packet has no row, though a later one has.
    Missing {
        /// The packet without a row.
        sequence: u64,
        /// Where a later one stands.
        line: u64,
        /// Its number.
        later: u64,
    },
    /// A packet was offered before the one before it.
    OfferedBefore {
        /// The line.
        line: u64,
        /// When the packet was offered.
        offered: Instant,
        /// The line of the packet before it.
        earlier_line: u64,
        /// When that one was offered.
        earlier: Instant,
    },
    /// Something happened to a packet before it was offered, or its arrival has two instants.
    ImpossibleTime {
        /// The line.
        line: u64,
        /// When the packet was offered.
        offered: Instant,
        /// When this is said to have happened.
        at: Instant,
    },
    /// Two rows of a packet differ in when it was offered or in its size.
    Contradiction {
        /// The packet.
        sequence: u64,
        /// One line.
        line: u64,
        /// The other.
        other_line: u64,
    },
    /// A packet or copy ends twice.
    TwoEnds {
        /// The packet.
        sequence: u64,
        /// The copy; 0 is the packet itself.
        copy: u8,
        /// The line of an end too many.
        line: u64,
    },
    /// A packet or copy never ends.
    NoEnd {
        /// The packet.
        sequence: u64,
        /// The copy; 0 is the packet itself.
        copy: u64,
    },
    /// There are more copies than were made.
    CopyFromNowhere {
        /// The packet.
        sequence: u64,
        /// Copies with an end, the packet itself not counted.
        copies: u64,
        /// Rows that say a copy was made.
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

/// All that the column `fate` may hold.
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
