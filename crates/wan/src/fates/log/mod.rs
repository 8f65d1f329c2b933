//! A fate log: what became of every packet of a link, from the first to the last, so that it can be replayed.
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
//! Times are counts of nanoseconds, sizes bytes; `fate` is [`Fate::name`]; `marked` and `damaged` are 0 or 1. Rows may stand in any order: a link
//! writes them as they happen. Within a packet, every copy has one end (delivered or dropped), and for every copy beyond the packet itself there is
//! one `duplicated` row, which carries the number of what was copied or of the copy.

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

/// The fates of all packets of a link, checked: every packet from 0 to the last is there and complete.
///
/// Records are kept in the order of (sequence, copy), a `duplicated` row before the end of the same copy.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct FateLog {
    records: Vec<PacketRecord>,
    /// Where each packet begins in `records`.
    starts: Vec<usize>,
}

impl FateLog {
    /// Checks records, in any order.
    ///
    /// # Errors
    ///
    /// [`FateLogError`] if a packet is missing, has no end, several ends or ends that contradict each other, or if time goes backwards. Lines are
    /// counted as [`FateLog::parse`] would count them: the first record stands on line 2.
    pub fn new(records: impl IntoIterator<Item = PacketRecord>) -> Result<Self, FateLogError> {
        Self::check((2..).zip(records).collect())
    }

    /// Reads the text of a file: the header, then one row a line. `\r\n` and a missing newline at the end are accepted.
    ///
    /// # Errors
    ///
    /// [`FateLogError`] with the line, the column and what was expected if the text is no fate log, or if the records are refused by
    /// [`FateLog::new`].
    pub fn parse(text: &str) -> Result<Self, FateLogError> {
        let mut reader = FateLogReader::default();
        text.lines().try_for_each(|line| reader.line(line))?;
        reader.finish()
    }

    /// The text of the whole log.
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

    /// How many packets were offered.
    #[must_use]
    pub const fn packets(&self) -> usize {
        self.starts.len()
    }

    /// All records, by (sequence, copy).
    #[must_use]
    pub fn records(&self) -> &[PacketRecord] {
        &self.records
    }

    /// The records of one packet, by copy; empty beyond the last packet.
    #[must_use]
    pub fn of_packet(&self, sequence: u64) -> &[PacketRecord] {
        let Some((number, &from)) = usize::try_from(sequence).ok().and_then(|number| Some((number, self.starts.get(number)?))) else {
            return &[];
        };
        let to = self.starts.get(number + 1).copied().unwrap_or(self.records.len());
        &self.records[from..to]
    }

    /// Whether any packet was damaged.
    pub(crate) fn has_damage(&self) -> bool {
        self.records.iter().any(|record| record.damaged)
    }

    fn check(mut rows: Vec<Numbered>) -> Result<Self, FateLogError> {
        // The line comes last, so that equal rows stay as they were.
        rows.sort_by_key(|&(line, record)| (record.sequence, record.copy, record.fate.is_end(), record.at, line));
        let mut starts = Vec::new();
        let mut begin = 0;
        let mut before: Option<&Numbered> = None;
        for (expected, packet) in (0..).zip(rows.chunk_by(|(_, one), (_, next)| one.sequence == next.sequence)) {
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

/// Checks the rows of one packet, sorted by copy.
fn check_packet(rows: &[Numbered]) -> Result<(), FateLogError> {
    let (first_line, first) = rows[0];
    let mut copies_made = 0_u64;
    let mut ends = 0_u64;
    for &(line, record) in rows {
        let sequence = record.sequence;
        if record.offered != first.offered || record.size != first.size {
            return Err(FateLogError::Contradiction { sequence, line, other_line: first_line });
        }
        if record.at < record.offered || matches!(record.fate, Fate::Delivered(at) if at != record.at) {
            return Err(FateLogError::ImpossibleTime { line, offered: record.offered, at: record.at });
        }
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
