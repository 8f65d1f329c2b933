//! The names of nodes, paths and links in code: their places in lists.

/// A node of a network, by its place in [`NetworkConfig::nodes`](crate::NetworkConfig::nodes), from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct NodeId(pub u16);

impl NodeId {
    /// The node at this place of a list; at a place from 65,535 on it is a node that no network has.
    #[must_use]
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(u16::try_from(index).unwrap_or(u16::MAX))
    }

    /// The place in a list.
    #[must_use]
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// From which node to which. A network has a link for each path, and perhaps access lines before and behind it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Path {
    /// The sender.
    pub from: NodeId,
    /// The receiver.
    pub to: NodeId,
}

/// A link, by its place in a list of links, from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkId(pub u32);

impl LinkId {
    /// The link at this place of a list.
    ///
    /// # Panics
    ///
    /// With 2^32 or more: so many links fit into no memory.
    #[must_use]
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(u32::try_from(index).expect("fewer than 2^32 links fit into memory"))
    }

    /// The place in a list.
    #[must_use]
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
