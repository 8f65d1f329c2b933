//! Configuration of a network, and the errors of its calls.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use super::id::NodeId;
use crate::line::pipeline::TimeWentBack;

/// A line of a node, shared by all paths of the node.
///
/// A network with a slow uplink, links with one flipped bit before a receiver without a checksum, and a filter:
///
/// ```
/// use cohaptic_units::{Bytes, Instant, Probability, parse};
/// use cohaptic_wan::{
///     AccessLine, Bottleneck, Chance, Checksum, Corruption, Delay, Fate, Flips, Framing, LinkConfig, Network, NetworkConfig, NodeId, QueueLimit,
/// };
///
/// let one_bit = Flips::Bits { packets: Chance::independent(Probability::ONE), count: 1 };
/// let link = LinkConfig {
///     corruption: Some(Corruption { bits: one_bit, within: Some(0..4), checksum: Checksum::Passes }),
///     delay: Delay::constant(parse::duration("10ms")?),
///     ..LinkConfig::default()
/// };
/// let slow = Bottleneck {
///     framing: Framing { overhead: 28, cells: None },
///     limit: Some(QueueLimit::Packets(20)),
///     ..Bottleneck::at_rate(parse::rate("512kbit")?)
/// };
/// let nodes = ["a", "b", "c"].map(String::from).to_vec();
/// let mut network = Network::new(NetworkConfig { seed: 1, nodes, general: false }, |_from, _to| link.clone())
///     .with_access_line(AccessLine::Uplink(NodeId(0)), LinkConfig { bottleneck: Some(slow), ..LinkConfig::default() })?
///     .with_filter(NodeId(0), NodeId(2), |_packet| true)?;
///
/// network.handle_broadcast(Instant::ZERO, NodeId(0), Bytes::new(8), [0_u8; 8])?;
/// while let Some(next) = network.poll_timeout() {
///     network.handle_timeout(next)?;
///     while let Some(event) = network.poll_event() {
///         if let (Fate::Delivered(at), Some(damage)) = (event.fate, &event.damage) {
///             let mut bytes = event.payload;
///             damage.apply(&mut bytes);
///             assert_eq!(bytes.map(u8::count_ones).iter().sum::<u32>(), 1);
///             assert_eq!((event.path.to, at > Instant::from_nanos(10_000_000)), (NodeId(1), true));
///         }
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum AccessLine {
    /// The line of all packets from the node, before their links.
    Uplink(NodeId),
    /// The line of all packets to the node, after their links.
    Downlink(NodeId),
}

/// Configuration of a network.
#[derive(Clone, Debug, Default)]
pub struct NetworkConfig {
    /// Seed of all random streams.
    pub seed: u64,
    /// Names of the nodes. The names address the random numbers of links: links with equal names and an equal seed draw equal numbers.
    pub nodes: Vec<String>,
    /// `true` if links with a constant delay and no further impairment take the general pipeline too. Only speed differs, no answer.
    pub general: bool,
}

/// Why a call failed. The network is unchanged after an error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum NetworkError {
    /// An earlier call had a later instant.
    TimeWentBack(TimeWentBack),
    /// No link for this path: a node does not exist, sender and receiver are the same node, or the network has links to other nodes only.
    NoLink {
        /// The sender.
        from: NodeId,
        /// The receiver.
        to: NodeId,
    },
    /// The node of this access line does not exist.
    NoLine(AccessLine),
}

impl fmt::Display for NetworkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimeWentBack(error) => fmt::Display::fmt(error, f),
            Self::NoLink { from, to } => write!(f, "there is no link from node {} to node {}", from.0, to.0),
            Self::NoLine(line) => write!(f, "there is no {line:?}"),
        }
    }
}

impl core::error::Error for NetworkError {}

impl From<TimeWentBack> for NetworkError {
    fn from(error: TimeWentBack) -> Self {
        Self::TimeWentBack(error)
    }
}
