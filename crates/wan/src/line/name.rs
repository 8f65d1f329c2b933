//! Names of links.

use alloc::string::String;

/// The name of a link: the address of the link's random numbers, and the link's name in records.
///
/// The name is made of the names of nodes, not of their indices, so an additional node changes no random numbers of existing links.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkName(String);

impl LinkName {
    /// Returns the name of the link between two nodes: `left->right`.
    #[must_use]
    pub fn between(from: &str, to: &str) -> Self {
        Self(alloc::format!("{from}->{to}"))
    }

    /// Returns the name of the sending line of a node: `left->*`.
    #[must_use]
    pub fn uplink(node: &str) -> Self {
        Self::between(node, "*")
    }

    /// Returns the name of the receiving line of a node: `*->left`.
    #[must_use]
    pub fn downlink(node: &str) -> Self {
        Self::between("*", node)
    }

    /// Returns the name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}
