//! The names of links.

use alloc::string::String;

/// The name of a link: the address of its random numbers, and what records call it.
///
/// It is made of the names of the nodes, not of their places in a list, so that adding a node moves nobody else's randomness.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkName(String);

impl LinkName {
    /// The link from one node to another: `left->right`.
    #[must_use]
    pub fn between(from: &str, to: &str) -> Self {
        Self(alloc::format!("{from}->{to}"))
    }

    /// The line that a node sends through: `left->*`.
    #[must_use]
    pub fn uplink(node: &str) -> Self {
        Self::between(node, "*")
    }

    /// The line that a node receives through: `*->left`.
    #[must_use]
    pub fn downlink(node: &str) -> Self {
        Self::between("*", node)
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}
