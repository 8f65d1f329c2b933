//! One record of what became of a packet.

use core::ops::Deref;

use cohaptic_units::{Bytes, Instant};

use super::fate::Fate;
use crate::packet::damage::Damage;

/// What became of one packet, or of one copy of it: the row of a fate log.
///
/// `L` says where: [`Path`](crate::Path) in a network, nothing where there is but one link.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct PacketRecord<L = ()> {
    /// From which node to which.
    pub path: L,
    /// The number of the packet on its link or path, from 0; a copy has that of its packet.
    pub sequence: u64,
    /// 0: the packet itself. Copies that a link made are counted from 1. In a network a copy that its uplink made differs in the lowest bit, one that its link
    /// made in the second, one that its downlink made in the third. With [`Fate::Duplicated`] it is the number of the new copy.
    pub copy: u8,
    /// When the packet was handed to the link, or to the network.
    pub offered: Instant,
    /// When it arrived or was dropped, or when the copy was made.
    pub at: Instant,
    /// The size of the packet.
    pub size: Bytes,
    /// What became of it.
    pub fate: Fate,
    /// Whether an active queue marked it: congestion experienced.
    pub marked: bool,
    /// Whether bits were flipped.
    pub damaged: bool,
}

impl<L> PacketRecord<L> {
    /// The record without the path: a row of the fate log of that path.
    #[must_use]
    pub fn without_path(self) -> PacketRecord {
        let Self { path: _, sequence, copy, offered, at, size, fate, marked, damaged } = self;
        PacketRecord { path: (), sequence, copy, offered, at, size, fate, marked, damaged }
    }
}

/// What became of one packet, or that a copy of it was made: its record, of which it [has the fields](Deref), with what it carries.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PacketEvent<P, L = ()> {
    /// What became of it.
    pub record: PacketRecord<L>,
    /// What it carries, as it was offered: see `damage`.
    pub payload: P,
    /// The bits that were flipped. [`Damage::apply`] flips them.
    pub damage: Option<Damage>,
}

impl<P, L> Deref for PacketEvent<P, L> {
    type Target = PacketRecord<L>;

    #[inline]
    fn deref(&self) -> &PacketRecord<L> {
        &self.record
    }
}
