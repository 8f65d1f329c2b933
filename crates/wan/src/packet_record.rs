//! The row of a fate log.

use cohaptic_units::{Bytes, Instant};

use crate::Fate;

/// What became of one packet, or of one copy of it: the row of a fate log.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct PacketRecord {
    /// The number of the packet on its link, from 0.
    pub sequence: u64,
    /// 0: the packet itself. Copies that the link made are counted from 1.
    pub copy: u8,
    /// When the packet was handed to the link.
    pub offered: Instant,
    /// When it arrived or was dropped, or when the copy was made.
    pub at: Instant,
    /// The size of the packet.
    pub size: Bytes,
    /// What became of it.
    pub fate: Fate,
    /// Whether "congestion experienced" was marked.
    pub marked: bool,
    /// Whether bits were flipped.
    pub damaged: bool,
}
