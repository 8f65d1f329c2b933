//! A packet on its way, and what will happen on a line, in as few bytes as they take: the event queue moves them.

use core::num::NonZeroU32;

use cohaptic_units::{Bytes, Instant};

use crate::event_queue::Event;
use crate::packet::PacketInfo;

/// A packet on its way.
#[derive(Clone, Debug)]
pub(super) struct InNetwork<P> {
    pub(super) sequence: u64,
    pub(super) sent: Instant,
    /// When it entered the line that it is in.
    pub(super) entered: Instant,
    pub(super) path: Path,
    pub(super) size: SizeAndMarks,
    pub(super) payload: P,
}

/// The size of a packet in the upper 24 bits, and below what happened to it. A bit is always set, so that an `Option` of what has it is no larger.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct SizeAndMarks(NonZeroU32);

impl SizeAndMarks {
    pub(super) const NOTHING: Self = Self(NonZeroU32::MIN.saturating_mul(NonZeroU32::MIN.saturating_add((1 << 7) - 1)));
    pub(super) const ECN_CAPABLE: u32 = 1 << 3;
    pub(super) const MARKED: u32 = 1 << 4;
    pub(super) const DAMAGED: u32 = 1 << 5;
    pub(super) const DISCARDED_ON_ARRIVAL: u32 = 1 << 6;

    pub(super) fn new(info: PacketInfo) -> Self {
        let size = u32::try_from(info.size.get()).unwrap_or(u32::MAX).min((1 << 24) - 1);
        Self(Self::NOTHING.0 | size << 8).with(Self::ECN_CAPABLE, info.ecn_capable)
    }

    pub(super) fn size(self) -> Bytes {
        Bytes::new((self.0.get() >> 8).into())
    }

    pub(super) fn copy(self) -> u8 {
        self.0.get().to_le_bytes()[0] & 0b111
    }

    pub(super) fn has(self, flag: u32) -> bool {
        self.0.get() & flag != 0
    }

    pub(super) fn with(self, flag: u32, set: bool) -> Self {
        Self(if set { self.0 | flag } else { Self::NOTHING.0 | self.0.get() & !flag })
    }
}

/// From whom to whom.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Path {
    pub(super) from: u16,
    pub(super) to: u16,
}

/// Something that will happen on a line.
#[derive(Clone, Debug)]
pub(super) struct Pending<P> {
    pub(super) at: Instant,
    /// The packet's sequence on its path.
    pub(super) sequence: u64,
    pub(super) sent: Instant,
    pub(super) entered: Instant,
    pub(super) place: Place,
    pub(super) path: Path,
    pub(super) size: SizeAndMarks,
    /// `None`: the time to wake the line's engine.
    pub(super) payload: Option<P>,
}

/// Kind and line in one number: what breaks ties between simultaneous events. All engines are woken before anything arrives, so that what leaves one
/// line finds the room that a departure from the next line makes at the same instant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Place(u32);

/// Which of its three lines a packet is in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Hop {
    Uplink,
    Link,
    Downlink,
}

/// Lines are counted in the lower bits of a [`Place`].
const LINE_BITS: u32 = 29;

impl Place {
    pub(super) fn waking(hop: Hop, line: u32) -> Self {
        Self((hop as u32) << LINE_BITS | line)
    }

    pub(super) fn arrival(hop: Hop, line: u32) -> Self {
        Self((hop as u32 + 3) << LINE_BITS | line)
    }

    pub(super) fn hop(self) -> Hop {
        match self.0 >> LINE_BITS {
            0 | 3 => Hop::Uplink,
            1 | 4 => Hop::Link,
            _ => Hop::Downlink,
        }
    }

    pub(super) fn line(self) -> u32 {
        self.0 & ((1 << LINE_BITS) - 1)
    }
}

impl<P> Event for Pending<P> {
    type Key = (Instant, Place, u64, Path, u8);

    #[inline]
    fn at(&self) -> Instant {
        self.at
    }

    #[inline]
    fn key(&self) -> Self::Key {
        (self.at, self.place, self.sequence, self.path, self.size.copy())
    }
}
