//! What a network is made of, and what it says.

use alloc::string::String;
use alloc::vec::Vec;

use cohaptic_units::{Bytes, Instant};

use crate::fates::fate::Fate;
use crate::line::pipeline::TimeWentBack;
use crate::packet::damage::Damage;

/// A node of a network, by its place from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct NodeId(pub u32);

/// A line that a node shares between all its paths.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum AccessLine {
    /// All that the node sends.
    Uplink(NodeId),
    /// All that the node receives.
    Downlink(NodeId),
}

/// What a network is made of.
#[derive(Clone, Debug, Default)]
pub struct NetworkConfig {
    /// The seed of all random streams.
    pub seed: u64,
    /// The names of the nodes. They are the addresses of the links' random numbers: equal names, equal draws.
    pub nodes: Vec<String>,
    /// Whether links whose only impairment is a constant delay take the general path too. It changes no answer, only the speed.
    pub general: bool,
}

/// Why a call failed. Nothing was changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NetworkError {
    /// An earlier call had a later instant.
    #[error(transparent)]
    TimeWentBack(#[from] TimeWentBack),
    /// There is no such node, or sender and receiver are the same.
    #[error("there is no link from node {} to node {}", from.0, to.0)]
    NoLink {
        /// The sender.
        from: NodeId,
        /// The receiver.
        to: NodeId,
    },
    /// There is no such access line.
    #[error("there is no {0:?}")]
    NoLine(AccessLine),
}

/// What became of one packet, end to end, or that a copy of it was made.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NetworkEvent<P> {
    /// Who sent it.
    pub from: NodeId,
    /// To whom.
    pub to: NodeId,
    /// The number of the packet on its path, from 0.
    pub sequence: u64,
    /// 0 for the packet itself. A copy that its uplink made differs in the lowest bit, one that its link made in the second, its downlink in the third.
    /// With [`Fate::Duplicated`] it is the number of the new copy.
    pub copy: u8,
    /// When the network took it.
    pub sent: Instant,
    /// When it arrived or was dropped, or when the copy was made.
    pub at: Instant,
    /// Its size.
    pub size: Bytes,
    /// What it carries, as it was offered: see `damage`.
    pub payload: P,
    /// What became of it.
    pub fate: Fate,
    /// Whether an active queue marked it: congestion experienced.
    pub marked: bool,
    /// The bits that were flipped. [`Damage::apply`] flips them.
    pub damage: Option<Damage>,
}
