//! Identifiers of nodes, paths and links: indices into lists.

/// A node of a network: an index into [`NetworkConfig::nodes`](crate::NetworkConfig::nodes), from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct NodeId(pub u16);

impl NodeId {
    /// Returns the node with this index. An index from 65,535 on gives a node outside of every network.
    #[must_use]
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(u16::try_from(index).unwrap_or(u16::MAX))
    }

    /// Returns the index of the node in a list of nodes.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A pair of sender and receiver. A network has a link for each path, and may have access lines before and after the link.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Path {
    /// The sender.
    pub from: NodeId,
    /// The receiver.
    pub to: NodeId,
}

/// A link: an index into a list of links, from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkId(pub u32);

impl LinkId {
    /// Returns the link with this index.
    ///
    /// # Panics
    ///
    /// With an index from 2^32 on, impossible for a list in memory.
    #[must_use]
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(u32::try_from(index).expect("fewer than 2^32 links fit into memory"))
    }

    /// Returns the index of the link in a list of links.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
