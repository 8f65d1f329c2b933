//! Records and events of packets.

use core::ops::Deref;

use cohaptic_units::{Bytes, Instant};

use super::fate::Fate;
use crate::fates::damage::Damage;

/// Record of the fate of one packet or of one copy: the row of a fate log.
///
/// `L` is the place: [`Path`](crate::Path) in a network, and nothing if there is only one link.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct PacketRecord<L = ()> {
    /// Path of the packet, from node to node.
    pub path: L,
    /// Number of the packet on its link or path, from 0. A copy has the number of its packet.
    pub sequence: u64,
    /// Number of the copy. 0 is the packet itself, and copies made by a link are counted from 1. In a network, a copy made by the uplink differs from its
    /// packet in the lowest bit, a copy made by the link in the second bit, and a copy made by the downlink in the third bit. With [`Fate::Duplicated`] the
    /// number is the number of the new copy.
    pub copy: u8,
    /// Instant of the packet's offer to the link, or to the network.
    pub offered: Instant,
    /// Instant of the arrival or of the drop, or, with [`Fate::Duplicated`], of the copy.
    pub at: Instant,
    /// Size of the packet.
    pub size: Bytes,
    /// Fate of the packet.
    pub fate: Fate,
    /// `true` if the packet was marked with congestion experienced.
    pub marked: bool,
    /// `true` if bits of the packet were flipped.
    pub damaged: bool,
}

impl<L> PacketRecord<L> {
    /// Returns the record without the path: a row of the fate log of this path.
    #[must_use]
    pub fn without_path(self) -> PacketRecord {
        self.with_path(())
    }

    /// Returns the record with another place in place of the path.
    #[must_use]
    pub fn with_path<M>(self, path: M) -> PacketRecord<M> {
        let Self { path: _, sequence, copy, offered, at, size, fate, marked, damaged } = self;
        PacketRecord { path, sequence, copy, offered, at, size, fate, marked, damaged }
    }
}

/// Part of a path: one of the lines that a packet passes one after the other from sender to receiver.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum PathPart {
    /// The uplink of the sender: see [`AccessLine::Uplink`](crate::AccessLine::Uplink).
    Uplink,
    /// The link from the sender to the receiver.
    Link,
    /// The downlink of the receiver: see [`AccessLine::Downlink`](crate::AccessLine::Downlink).
    Downlink,
}

impl From<()> for PathPart {
    /// Returns the link, the only part of a path without access lines.
    fn from((): ()) -> Self {
        Self::Link
    }
}

/// Fate of one packet, or the copying of a packet: the record with the payload. The [fields of the record are fields of the event](Deref).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PacketEvent<P, L = ()> {
    /// Record of the fate.
    pub record: PacketRecord<L>,
    /// Payload of the packet as offered, before `damage`.
    pub payload: P,
    /// Flipped bits. [`Damage::apply`] flips the bits of a payload.
    pub damage: Option<Damage>,
    /// Part of the path in which the fate occurred: for a delivery the last part.
    pub part: PathPart,
}

impl<P, L> Deref for PacketEvent<P, L> {
    type Target = PacketRecord<L>;

    fn deref(&self) -> &PacketRecord<L> {
        &self.record
    }
}
