//! Pairs of nodes with links, and the numbers of their links.

use alloc::vec::Vec;

use super::id::{LinkId, NodeId, Path};

/// Numbers of links, in the order of senders, then of receivers.
#[derive(Clone, Debug)]
pub(super) enum Paths {
    /// Links from each node to every node, itself included.
    All {
        /// Number of nodes.
        nodes: u16,
    },
    /// Links to some receivers only.
    Some(SomePaths),
}

/// Numbers of links for nodes with separate lists of receivers.
#[derive(Clone, Debug)]
pub(super) struct SomePaths {
    /// Begin of each sender's part of `receivers`, indexed by sender, followed by the length of `receivers`. So `first[n]..first[n + 1]` is the part of node
    /// `n`.
    first: Vec<u32>,
    receivers: Vec<NodeId>,
}

/// Number of links, at most: a [`Turn`](super::pending::Turn) holds a link's number in 29 bits.
const MOST_LINKS: usize = 1 << 29;

impl Paths {
    /// Makes the paths from each node to the receivers from `receivers_of`. Panics if a list of receivers is not strictly ascending, names a missing node or
    /// its own sender, or if there are more than 2^29 links.
    pub(super) fn some<R: IntoIterator<Item = NodeId>>(nodes: u16, mut receivers_of: impl FnMut(NodeId) -> R) -> Self {
        let (mut first, mut receivers) = (Vec::with_capacity(usize::from(nodes) + 1), Vec::new());
        first.push(0);
        for from in (0..nodes).map(NodeId) {
            let begin = receivers.len();
            receivers.extend(receivers_of(from));
            // `link` finds receivers by binary search, so each list must be in order.
            let own = &receivers[begin..];
            assert!(
                own.iter().all(|to| to.0 < nodes && *to != from) && own.is_sorted_by(|one, next| one < next),
                "receivers are other nodes, in order"
            );
            assert!(receivers.len() <= MOST_LINKS, "a network has at most 2^29 links");
            first.push(LinkId::new(receivers.len()).0);
        }
        Self::Some(SomePaths { first, receivers })
    }

    pub(super) fn nodes(&self) -> u16 {
        match self {
            Self::All { nodes } => *nodes,
            Self::Some(some) => u16::try_from(some.first.len() - 1).unwrap_or(u16::MAX),
        }
    }

    /// Returns the number of links, links of nodes to themselves included.
    pub(super) fn lines(&self) -> usize {
        match self {
            Self::All { nodes } => usize::from(*nodes) * usize::from(*nodes),
            Self::Some(some) => some.receivers.len(),
        }
    }

    /// Returns the receiver at index `place` in the list of `from`, or `None` after the last receiver. With links between all nodes the receiver may be `from`
    /// itself.
    pub(super) fn receiver(&self, from: NodeId, place: u16) -> Option<NodeId> {
        match self {
            Self::All { nodes } => (place < *nodes).then_some(NodeId(place)),
            Self::Some(some) => some.of(from).get(usize::from(place)).copied(),
        }
    }

    /// Returns the number of the link of a path, or `None` if the path has no link. Both nodes of the path must exist.
    #[inline]
    pub(super) fn link(&self, path: Path) -> Option<LinkId> {
        match self {
            Self::All { nodes } => Some(LinkId(u32::from(path.from.0) * u32::from(*nodes) + u32::from(path.to.0))),
            Self::Some(some) => some.link(path),
        }
    }
}

impl SomePaths {
    /// Returns the receiver of each link, indexed by link.
    pub(super) fn receivers(&self) -> &[NodeId] {
        &self.receivers
    }

    fn of(&self, from: NodeId) -> &[NodeId] {
        &self.receivers[self.first[from.index()] as usize..self.first[from.index() + 1] as usize]
    }

    fn link(&self, path: Path) -> Option<LinkId> {
        let place = self.of(path.from).binary_search(&path.to).ok()?;
        Some(LinkId::new(self.first[path.from.index()] as usize + place))
    }
}
