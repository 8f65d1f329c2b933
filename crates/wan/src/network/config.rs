//! What a network is made of.

use alloc::string::String;
use alloc::vec::Vec;

use super::id::NodeId;
use crate::line::pipeline::TimeWentBack;

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
