//! Rows of a fate log.

use core::fmt;

use crate::fates::record::PacketRecord;

/// Record as a line of a fate log, without the newline: `2,0,2000000,64,27000000,delivered,1,0`.
///
/// The column `at_ns` is [`PacketRecord::at`]. A reader also takes this instant for [`Fate::Delivered`](crate::Fate::Delivered), which has the same instant.
#[derive(Clone, Copy, Debug)]
pub struct FateRow(pub PacketRecord);

impl FateRow {
    /// First line of a fate log.
    pub const HEADER: &'static str = "sequence,copy,offered_ns,size,at_ns,fate,marked,damaged";
    pub(super) const COLUMNS: [&'static str; 8] = ["sequence", "copy", "offered_ns", "size", "at_ns", "fate", "marked", "damaged"];
}

impl fmt::Display for FateRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PacketRecord { path: (), sequence, copy, offered, at, size, fate, marked, damaged } = self.0;
        let (offered, at, size, fate) = (offered.as_nanos(), at.as_nanos(), size.get(), fate.name());
        write!(f, "{sequence},{copy},{offered},{size},{at},{fate},{},{}", u8::from(marked), u8::from(damaged))
    }
}
