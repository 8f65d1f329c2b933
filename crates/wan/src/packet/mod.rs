//! What a link knows of a packet, and what it hands from stage to stage.

pub(crate) mod damage;

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::{Bytes, Instant};

use damage::Damage;

use crate::fates::fate::DropCause;

/// What a link needs to know of a packet. A [`Bytes`] is a packet of that size without ECN.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct PacketInfo {
    /// Its size.
    pub size: Bytes,
    /// Whether its ends understand explicit congestion notification (RFC 3168): then an active queue marks it where it would drop another.
    pub ecn_capable: bool,
}

impl From<Bytes> for PacketInfo {
    fn from(size: Bytes) -> Self {
        Self { size, ecn_capable: false }
    }
}

/// A packet that is led from stage to stage. It stays where it lies and is handed on as its address: handing on its hundred bytes at every step took a fifth
/// of the time of a link with any stage at all, which is more than the allocation does.
pub(crate) type Carried<T> = Box<Packet<T>>;

/// A packet between two stages of one link, with whatever its owner put around it.
#[derive(Clone, Debug)]
pub(crate) struct Packet<T> {
    /// The number of the packet on this link: the address of its draws.
    pub(crate) number: u64,
    /// 0 for the packet itself, 1 for the copy that this link made.
    pub(crate) copy: u8,
    pub(crate) info: PacketInfo,
    /// Whether a line before this one marked it.
    pub(crate) was_marked: bool,
    /// Whether a line before this one flipped bits of it.
    pub(crate) was_damaged: bool,
    pub(crate) marks: Marks,
    pub(crate) item: T,
}

impl<T> Packet<T> {
    /// A packet that enters a link, or comes from another line with these marks.
    pub(crate) fn new(number: u64, info: PacketInfo, marks: Marks, item: T) -> Carried<T> {
        Box::new(Self { number, copy: 0, info, was_marked: marks.congestion, was_damaged: marks.damage.is_some(), marks, item })
    }

    /// As that copy.
    pub(crate) fn as_copy(mut self: Box<Self>, copy: u8) -> Carried<T> {
        self.copy = copy;
        self
    }
}

/// What a link did to a packet besides delaying it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Marks {
    /// An active queue marked it: congestion experienced.
    pub(crate) congestion: bool,
    /// Bits that were flipped.
    pub(crate) damage: Option<Damage>,
    /// The receiver's checksum will find the damage.
    pub(crate) discarded_on_arrival: bool,
}

impl Marks {
    /// More bits were flipped, of a packet that a line before may have damaged already; `is_discarded`: a checksum will find it.
    pub(crate) fn damage(&mut self, damage: Option<Damage>, is_discarded: bool) {
        self.damage = match (self.damage.take(), damage) {
            (Some(before), Some(damage)) => before.and(&damage),
            (before, damage) => before.or(damage),
        };
        // Two flips of one bit leave nothing to find.
        self.discarded_on_arrival = self.damage.is_some() && (self.discarded_on_arrival || is_discarded);
    }
}

/// What comes out of the stages.
#[derive(Clone, Debug)]
pub(crate) struct Output<T> {
    pub(crate) packet: Carried<T>,
    pub(crate) exit: Exit,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Exit {
    /// It will come out of the far end then.
    Arrives(Instant),
    /// It was dropped then.
    Dropped(Instant, DropCause),
    /// It is a copy that was made then, and goes on.
    Copied(Instant),
}

pub(crate) type Outputs<T> = Vec<Output<T>>;
