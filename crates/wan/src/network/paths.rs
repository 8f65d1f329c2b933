//! Which nodes have links between them, and where these lie.

use alloc::vec::Vec;

use super::id::{LinkId, NodeId, Path};

/// The places of links, by sender, then receiver.
#[derive(Clone, Debug)]
pub(super) enum Paths {
    /// From each node to each, itself included.
    All {
        /// How many nodes there are.
        nodes: u16,
    },
    /// Some.
    Some(SomePaths),
}

/// The places of some links.
#[derive(Clone, Debug)]
pub(super) struct SomePaths {
    /// By sender where its receivers begin, and at last where they end.
    first: Vec<u32>,
    receivers: Vec<NodeId>,
}

/// The most links: a [`Turn`](super::pending::Turn) counts them in 29 bits.
const MOST_LINKS: usize = 1 << 29;

impl Paths {
    /// Those to the receivers of each node.
    pub(super) fn some<R: IntoIterator<Item = NodeId>>(nodes: u16, mut receivers_of: impl FnMut(NodeId) -> R) -> Self {
        let (mut first, mut receivers) = (Vec::with_capacity(usize::from(nodes) + 1), Vec::new());
        first.push(0);
        for from in (0..nodes).map(NodeId) {
            let begin = receivers.len();
            receivers.extend(receivers_of(from));
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

    /// How many places there are.
    pub(super) fn lines(&self) -> usize {
        match self {
            Self::All { nodes } => usize::from(*nodes) * usize::from(*nodes),
            Self::Some(some) => some.receivers.len(),
        }
    }

    /// The receiver in a place of those of a node, which may be the node itself; `None` beyond the last.
    pub(super) fn receiver(&self, from: NodeId, place: u16) -> Option<NodeId> {
        match self {
            Self::All { nodes } => (place < *nodes).then_some(NodeId(place)),
            Self::Some(some) => some.of(from).get(usize::from(place)).copied(),
        }
    }

    /// Whether there is such a link, between nodes that there are.
    #[inline]
    pub(super) fn has(&self, path: Path) -> bool {
        match self {
            Self::All { .. } => true,
            Self::Some(some) => some.of(path.from).binary_search(&path.to).is_ok(),
        }
    }
}

impl SomePaths {
    fn of(&self, from: NodeId) -> &[NodeId] {
        &self.receivers[self.first[from.index()] as usize..self.first[from.index() + 1] as usize]
    }

    /// The link of a path that there is.
    pub(super) fn link(&self, path: Path) -> LinkId {
        let place = self.of(path.from).binary_search(&path.to).expect("packets travel on links that there are");
        LinkId::new(self.first[path.from.index()] as usize + place)
    }
}
