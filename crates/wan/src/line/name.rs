//! Names of links.

use alloc::string::String;

/// The name of a link: the address of the link's random numbers, and the link's name in records.
///
/// The name is made of the names of nodes, not of their indices, so that adding a node changes no other link's random numbers.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkName(String);

impl LinkName {
    /// Returns the name of the link from one node to another: `left->right`.
    #[must_use]
    pub fn between(from: &str, to: &str) -> Self {
        Self(alloc::format!("{from}->{to}"))
    }

    /// Returns the name of the line through which a node sends: `left->*`.
    #[must_use]
    pub fn uplink(node: &str) -> Self {
        Self::between(node, "*")
    }

    /// Returns the name of the line through which a node receives: `*->left`.
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
