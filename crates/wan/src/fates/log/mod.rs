//! Fate log: the fate of every packet of a link, from the first to the last, so that the link can be replayed.
//!
//! ```text
//! sequence,copy,offered_ns,size,at_ns,fate,marked,damaged
//! 0,0,0,64,24000000,delivered,0,0
//! 1,0,1000000,64,1000000,loss,0,0
//! 2,0,2000000,64,2000000,duplicated,0,0
//! 2,1,2000000,64,26000000,delivered,0,0
//! 2,0,2000000,64,27000000,delivered,1,0
//! ```
//!
//! Times are in nanoseconds and sizes in bytes. `fate` is [`Fate::name`]; `marked` and `damaged` are 0 or 1. Rows may be in any order; a link writes a row
//! when the fate occurs. Of each packet, every copy has one end (delivered or dropped). For every copy beyond the packet itself there is one `duplicated`
//! row, which carries the number of the copied packet or of the new copy.

mod error;
mod row;
mod text;

use alloc::string::String;
use alloc::vec::Vec;

pub use error::FateLogError;
pub use row::FateRow;
pub use text::FateLogReader;
use text::Numbered;

use crate::fates::fate::Fate;
use crate::fates::record::PacketRecord;

/// Checked fates of all packets of a link. Every packet from 0 to the last is present and complete.
///
/// Records are in the order of (sequence, copy), with a `duplicated` row before the end of the same copy.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct FateLog {
    records: Vec<PacketRecord>,
    /// Index into `records` of each packet's first record, indexed by packet.
    starts: Vec<usize>,
}

impl FateLog {
    /// Returns a log of the given records, which may be in any order, after checking them.
    ///
    /// # Errors
    ///
    /// [`FateLogError`] if a packet is missing, has no end, has several ends or contradicting records, or if packets are not offered in the order of their
    /// numbers. Lines are counted as by [`FateLog::parse`]: the first record is on line 2.
    pub fn new(records: impl IntoIterator<Item = PacketRecord>) -> Result<Self, FateLogError> {
        Self::check((2..).zip(records).collect())
    }

    /// Reads the text of a file: the header, then one row per line. `\r\n` and a missing newline at the end are accepted.
    ///
    /// # Errors
    ///
    /// [`FateLogError`] with the line, the column and the expected value if the text is not a fate log, or if [`FateLog::new`] would refuse the records.
    pub fn parse(text: &str) -> Result<Self, FateLogError> {
        let mut reader = FateLogReader::default();
        text.lines().try_for_each(|line| reader.line(line))?;
        reader.finish()
    }

    /// Returns the text of the whole log.
    #[must_use]
    pub fn to_text(&self) -> String {
        use core::fmt::Write as _;
        let mut text = alloc::format!("{}\n", FateRow::HEADER);
        for &record in &self.records {
            // Writing to a `String` cannot fail.
            let _ = writeln!(text, "{}", FateRow(record));
        }
        text
    }

    /// Returns the number of packets offered.
    #[must_use]
    pub const fn packets(&self) -> usize {
        self.starts.len()
    }

    /// Returns all records in the order of (sequence, copy).
    #[must_use]
    pub fn records(&self) -> &[PacketRecord] {
        &self.records
    }

    /// Returns the records of one packet in the order of copies, or an empty slice after the last packet.
    #[must_use]
    pub fn of_packet(&self, sequence: u64) -> &[PacketRecord] {
        let Some((number, &from)) = usize::try_from(sequence).ok().and_then(|number| Some((number, self.starts.get(number)?))) else {
            return &[];
        };
        let to = self.starts.get(number + 1).copied().unwrap_or(self.records.len());
        &self.records[from..to]
    }

    /// Returns whether any packet was damaged.
    pub(crate) fn has_damage(&self) -> bool {
        self.records.iter().any(|record| record.damaged)
    }

    /// Sorts and checks the rows, each with the number of its line.
    fn check(mut rows: Vec<Numbered>) -> Result<Self, FateLogError> {
        // The line is the last part of the key, so that equal rows keep their order.
        rows.sort_by_key(|&(line, record)| (record.sequence, record.copy, record.fate.is_end(), record.at, line));
        let mut starts = Vec::new();
        let mut begin = 0;
        let mut before: Option<&Numbered> = None;
        // After sorting, the rows of a packet are adjacent, and the packets must be numbered 0, 1, 2, ….
        for (expected, packet) in (0..).zip(rows.chunk_by(|(_, one), (_, next)| one.sequence == next.sequence)) {
            // `chunk_by` returns no empty chunk.
            let first = &packet[0];
            if first.1.sequence != expected {
                return Err(FateLogError::Missing { sequence: expected, line: first.0, later: first.1.sequence });
            }
            if let Some(&(earlier_line, earlier)) = before
                && first.1.offered < earlier.offered
            {
                return Err(FateLogError::OfferedBefore { line: first.0, offered: first.1.offered, earlier_line, earlier: earlier.offered });
            }
            check_packet(packet)?;
            starts.push(begin);
            begin += packet.len();
            before = Some(first);
        }
        Ok(Self { records: rows.into_iter().map(|(_, record)| record).collect(), starts })
    }
}

/// Checks the rows of one packet, sorted by copy. There is at least one row.
fn check_packet(rows: &[Numbered]) -> Result<(), FateLogError> {
    let (first_line, first) = rows[0];
    let mut copies_made = 0_u64;
    // Number of ends so far, which is also the number of the copy whose end must come next.
    let mut ends = 0_u64;
    for &(line, record) in rows {
        let sequence = record.sequence;
        if record.offered != first.offered || record.size != first.size {
            return Err(FateLogError::Contradiction { sequence, line, other_line: first_line });
        }
        if record.at < record.offered || matches!(record.fate, Fate::Delivered(at) if at != record.at) {
            return Err(FateLogError::ImpossibleTime { line, offered: record.offered, at: record.at });
        }
        // Rows are sorted by copy, so an end for an earlier copy repeats an end, and an end for a later copy leaves one out.
        if !record.fate.is_end() {
            copies_made += 1;
        } else if u64::from(record.copy) < ends {
            return Err(FateLogError::TwoEnds { sequence, copy: record.copy, line });
        } else if u64::from(record.copy) > ends {
            return Err(FateLogError::NoEnd { sequence, copy: ends });
        } else {
            ends += 1;
        }
    }
    match ends {
        _ if ends <= copies_made => Err(FateLogError::NoEnd { sequence: first.sequence, copy: ends }),
        _ if ends > copies_made + 1 => Err(FateLogError::CopyFromNowhere { sequence: first.sequence, copies: ends - 1, made: copies_made }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
