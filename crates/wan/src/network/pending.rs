//! Packets on their way and events to come on lines. Both types are packed, because the event queue moves them.

use core::num::NonZeroU32;

use cohaptic_units::{Bytes, Ecn, Instant};

use super::id::{LinkId, NodeId, Path};
use crate::event_queue::Event;
use crate::fates::damage::Damage;
use crate::fates::fate::Fate;
use crate::fates::record::{PacketEvent, PacketRecord, PathPart};
use crate::packet::PacketInfo;

/// A packet on its way through the network.
#[derive(Clone, Debug)]
pub(super) struct InNetwork<P> {
    pub(super) sequence: u64,
    pub(super) offered: Instant,
    /// Instant of entry into the current line.
    pub(super) entered: Instant,
    pub(super) path: Path,
    pub(super) size: SizeAndMarks,
    pub(super) payload: P,
}

impl<P> InNetwork<P> {
    /// Returns the event of a fate that occurred on the line `line`.
    #[inline(always)]
    pub(super) fn event(self, line: LineId, at: Instant, fate: Fate, damage: Option<Damage>) -> PacketEvent<P, Path> {
        let Self { sequence, offered, path, size, payload, .. } = self;
        let (copy, marked, size) = (size.copy(), size.has(SizeAndMarks::MARKED), size.size());
        let record = PacketRecord { path, sequence, copy, offered, at, size, fate, marked, damaged: damage.is_some() };
        PacketEvent { record, payload, damage, part: line.part() }
    }
}

/// Size of a packet in bytes (upper 22 bits), its ECN codepoint (bits 7 and 8), its flags (bits 4 to 6 and 9), its copy bits (bits 0 to 2, see
/// [`LineId::copy_bit`]). Bit 3 is always set: the number is never zero, so an `Option` of a type with this field needs no extra space. A train has the number
/// of its packets in place of a size.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct SizeAndMarks(NonZeroU32);

impl SizeAndMarks {
    // The constant is made of safe operations only: 1 + 7 is bit 3.
    pub(super) const NOTHING: Self = Self(NonZeroU32::MIN.saturating_add((1 << 3) - 1));
    pub(super) const MARKED: u32 = 1 << 4;
    pub(super) const DAMAGED: u32 = 1 << 5;
    pub(super) const DISCARDED_ON_ARRIVAL: u32 = 1 << 6;
    /// Several packets that travel as one event.
    pub(super) const TRAIN: u32 = 1 << 9;
    /// Greatest size of a packet \[byte\], and greatest number of packets of a train.
    pub(super) const MOST: u32 = (1 << 22) - 1;

    pub(super) fn new(info: PacketInfo) -> Self {
        // Larger sizes saturate, so the shift below loses no bit.
        let size = u32::try_from(info.size.get().min(u64::from(Self::MOST))).unwrap_or(Self::MOST);
        Self(Self::NOTHING.0 | size << 10 | u32::from(info.ecn.bits()) << 7)
    }

    /// Returns the mark of a train of `packets` packets, at most [`SizeAndMarks::MOST`].
    pub(super) fn of_train(packets: u32) -> Self {
        Self(Self::NOTHING.0 | packets.min(Self::MOST) << 10 | Self::TRAIN)
    }

    /// Returns the number of packets in a train beside the first packet; 0 for a single packet.
    #[inline(always)]
    pub(super) fn further_packets(self) -> u64 {
        if self.has(Self::TRAIN) { u64::from(self.0.get() >> 10).saturating_sub(1) } else { 0 }
    }

    pub(super) fn size(self) -> Bytes {
        Bytes::new((self.0.get() >> 10).into())
    }

    pub(super) fn info(self) -> PacketInfo {
        PacketInfo { size: self.size(), ecn: Ecn::from_bits((self.0.get() >> 7).to_le_bytes()[0]) }
    }

    pub(super) fn copy(self) -> u8 {
        self.0.get().to_le_bytes()[0] & 0b111
    }

    pub(super) fn has(self, flag: u32) -> bool {
        self.0.get() & flag != 0
    }

    pub(super) fn with(self, flag: u32, set: bool) -> Self {
        // The complement may clear all bits as far as the type knows. Setting bit 3 again keeps the number nonzero without a check.
        Self(if set { self.0 | flag } else { Self::NOTHING.0 | self.0.get() & !flag })
    }
}

/// An event to come on a line: a packet leaves the line, or the line's engine must be woken.
#[derive(Clone, Debug)]
pub(super) struct Pending<P> {
    pub(super) at: Instant,
    /// Sequence number of the packet on its path.
    pub(super) sequence: u64,
    pub(super) offered: Instant,
    pub(super) entered: Instant,
    pub(super) turn: Turn,
    pub(super) path: Path,
    pub(super) size: SizeAndMarks,
    /// Payload of the packet; `None` if the event is a wake of the line's engine.
    pub(super) payload: Option<P>,
}

/// A line of the network.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum LineId {
    Uplink(NodeId),
    Link(LinkId),
    Downlink(NodeId),
}

impl LineId {
    /// Returns the copy bit of [`SizeAndMarks`] for copies made by this line.
    pub(super) const fn copy_bit(self) -> u32 {
        match self {
            Self::Uplink(_) => 1,
            Self::Link(_) => 1 << 1,
            Self::Downlink(_) => 1 << 2,
        }
    }

    /// Returns the part of a path that the line is.
    pub(super) const fn part(self) -> PathPart {
        match self {
            Self::Uplink(_) => PathPart::Uplink,
            Self::Link(_) => PathPart::Link,
            Self::Downlink(_) => PathPart::Downlink,
        }
    }
}

/// Kind of event and line in one number. The number orders simultaneous events. Wakes (kinds 0 to 2) come before arrivals (kinds 3 to 5): a packet from line to
/// line finds the room of a simultaneous departure from the next line.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Turn(u32);

/// Number of lower bits of a [`Turn`], with the number of the link or node.
const NUMBER_BITS: u32 = 29;

impl Turn {
    #[inline(always)]
    pub(super) fn waking(line: LineId) -> Self {
        let (kind, number) = match line {
            LineId::Uplink(node) => (0, node.0.into()),
            LineId::Link(link) => (1, link.0),
            LineId::Downlink(node) => (2, node.0.into()),
        };
        Self(kind << NUMBER_BITS | number)
    }

    #[inline(always)]
    pub(super) fn arrival(line: LineId) -> Self {
        Self(Self::waking(line).0 + (3 << NUMBER_BITS))
    }

    /// Returns the turn of the packet of a broadcast to the node `to`, if `self` is the turn of the packet to node 0: links to receivers have successive numbers.
    #[inline(always)]
    pub(super) const fn to_receiver(self, to: NodeId) -> Self {
        Self(self.0 + to.0 as u32)
    }

    /// Returns the link of the event. The event must belong to a link, not to an access line.
    pub(super) const fn link(self) -> LinkId {
        LinkId(self.0 & ((1 << NUMBER_BITS) - 1))
    }

    #[inline(always)]
    pub(super) fn line(self) -> LineId {
        let number = self.0 & ((1 << NUMBER_BITS) - 1);
        let node = NodeId::new(number as usize);
        match self.0 >> NUMBER_BITS {
            0 | 3 => LineId::Uplink(node),
            1 | 4 => LineId::Link(LinkId(number)),
            _ => LineId::Downlink(node),
        }
    }
}

impl<P> Event for Pending<P> {
    type Key = (Instant, Turn, u64, Path, u8);

    fn at(&self) -> Instant {
        self.at
    }

    #[inline(always)]
    fn key(&self) -> Self::Key {
        // The copy bits tell a packet from its copies.
        (self.at, self.turn, self.sequence, self.path, self.size.copy())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes from 2²² on count as 2²² − 1. Flags change neither the size nor the codepoint.
    #[test]
    fn sizes_and_codepoints_come_back() {
        for (size, expected) in [(0, 0), (1500, 1500), ((1 << 22) - 1, (1 << 22) - 1), (1 << 22, (1 << 22) - 1), (u64::MAX, (1 << 22) - 1)] {
            for ecn in [Ecn::NotCapable, Ecn::Capable0, Ecn::Capable1, Ecn::Congestion] {
                let packet = SizeAndMarks::new(PacketInfo { size: Bytes::new(size), ecn });
                let flags = flags_of_packets();
                assert!(flags.iter().all(|flag| !packet.has(*flag)) && (packet.copy(), packet.further_packets()) == (0, 0));
                let flagged = flags.iter().fold(packet, |packet, flag| packet.with(*flag, true));
                for packet in [packet, flagged] {
                    assert_eq!(packet.info(), PacketInfo { size: Bytes::new(expected), ecn }, "{size}");
                }
                assert_eq!(flags.iter().fold(flagged, |packet, flag| packet.with(*flag, false)), packet);
            }
        }
        for packets in [1, 2, SizeAndMarks::MOST] {
            let train = SizeAndMarks::of_train(packets);
            assert_eq!((train.further_packets(), train.copy()), (u64::from(packets) - 1, 0));
            assert!(flags_of_packets().iter().all(|flag| !train.has(*flag)));
        }
    }

    fn flags_of_packets() -> [u32; 3] {
        [SizeAndMarks::MARKED, SizeAndMarks::DAMAGED, SizeAndMarks::DISCARDED_ON_ARRIVAL]
    }
}
