//! Packets inside a link: the facts that a link needs, the packet between two stages, and the outputs of the stages.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::{Bytes, Ecn, Instant};

use crate::fates::damage::Damage;
use crate::fates::fate::DropCause;

/// Facts about a packet that a link needs. A [`Bytes`] converts to a packet of this size without ECN.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct PacketInfo {
    /// Size of the packet.
    pub size: Bytes,
    /// ECN codepoint of the packet. An active queue marks a capable packet in place of a drop (RFC 3168).
    pub ecn: Ecn,
}

impl From<Bytes> for PacketInfo {
    fn from(size: Bytes) -> Self {
        Self { size, ecn: Ecn::NotCapable }
    }
}

/// Returns the number of a flow with an address of the given parts, for [`Network::with_flows`](crate::Network::with_flows) and
/// [`Link::with_flows`](crate::Link::with_flows). Different addresses rarely have equal numbers: of 100 flows two share a number with a probability of 10⁻⁶.
#[must_use]
pub fn flow_number(address: &[u64]) -> u32 {
    let hash = address.iter().fold(0_u64, |hash, part| {
        // The product carries every bit of the part into higher bits, and the shift carries those back into the lower half.
        let hash = (hash ^ part).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        hash ^ hash >> 32
    });
    #[expect(clippy::cast_possible_truncation, reason = "the lower half")]
    let number = hash as u32;
    number
}

/// Packet on its way from stage to stage. Boxed, so each stage passes an address on and does not copy the hundred bytes of the packet.
pub(crate) type Carried<T> = Box<Packet<T>>;

/// Packet between two stages of one link.
#[derive(Clone, Debug)]
pub(crate) struct Packet<T> {
    /// Number of the packet on this link, part of the address of its random draws.
    pub(crate) number: u64,
    /// 0 for the packet itself, 1 for the copy made by this link.
    pub(crate) copy: u8,
    pub(crate) info: PacketInfo,
    /// Number of the packet's flow: packets with different numbers belong to different flows. Read by FQ-CoDel alone.
    pub(crate) flow: u32,
    /// `true` if an earlier line on the path marked the packet.
    pub(crate) was_marked: bool,
    /// `true` if an earlier line on the path flipped bits of the packet.
    pub(crate) was_damaged: bool,
    /// Marks of this line and of earlier lines together.
    pub(crate) marks: Marks,
    /// Data of the owner, for example the payload.
    pub(crate) item: T,
}

impl<T> Packet<T> {
    /// Returns a packet of flow 0 at its entry into a line. `marks` are the marks of earlier lines on the path.
    pub(crate) fn new(number: u64, info: PacketInfo, marks: Marks, item: T) -> Carried<T> {
        Box::new(Self { number, copy: 0, info, flow: 0, was_marked: marks.congestion, was_damaged: marks.damage.is_some(), marks, item })
    }

    /// Returns the packet as a packet of the given flow.
    pub(crate) fn of_flow(mut self: Box<Self>, flow: u32) -> Carried<T> {
        self.flow = flow;
        self
    }

    /// Returns the packet as the copy with the number `copy`.
    pub(crate) fn as_copy(mut self: Box<Self>, copy: u8) -> Carried<T> {
        self.copy = copy;
        self
    }
}

/// Marks and damage of a packet: all effects of a link besides delay and loss.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Marks {
    /// `true` if an active queue marked the packet ("congestion experienced").
    pub(crate) congestion: bool,
    /// Flipped bits.
    pub(crate) damage: Option<Damage>,
    /// `true` if the checksum of the receiver will find the damage, so the packet is dropped on arrival.
    pub(crate) discarded_on_arrival: bool,
}

impl Marks {
    /// Adds damage to a packet, possibly damaged by an earlier line already. `is_discarded` tells whether a checksum will find the damage.
    pub(crate) fn damage(&mut self, damage: Option<Damage>, is_discarded: bool) {
        self.damage = match (self.damage.take(), damage) {
            (Some(before), Some(damage)) => before.and(&damage),
            (before, damage) => before.or(damage),
        };
        // Two flips of one bit cancel out, and a packet without damage passes the checksum.
        self.discarded_on_arrival = self.damage.is_some() && (self.discarded_on_arrival || is_discarded);
    }
}

/// Output of the stages: a packet and its exit.
#[derive(Clone, Debug)]
pub(crate) struct Output<T> {
    pub(crate) packet: Carried<T>,
    pub(crate) exit: Exit,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Exit {
    /// The packet arrives at the far end at this instant.
    Arrives(Instant),
    /// The packet was dropped at this instant.
    Dropped(Instant, DropCause),
    /// The packet is a copy made at this instant. Not final: the copy goes on through the stages.
    Copied(Instant),
}

pub(crate) type Outputs<T> = Vec<Output<T>>;
