//! Test beds with the networks that strategies draw.

use cohaptic_wan::{LinkModel, Path};

use super::Testbed;
use crate::link::ToLink;
use crate::strategies::{ImpairedLink, ImpairedNetwork};

impl Testbed {
    /// The links of a network that a strategy has drawn, or that was pasted back: its first host is the first one of this test bed, and so on.
    ///
    /// # Panics
    ///
    /// If it has not as many hosts as the test bed.
    pub fn network(mut self, network: &ImpairedNetwork) -> Self {
        let hosts = self.setup.names.len();
        assert!(network.hosts() == hosts, "a network of {} hosts for a test bed of {hosts}: expected as many", network.hosts());
        for (from, to, link) in network.links() {
            self.setup.set_path(Path { from, to }, link);
        }
        self
    }
}

impl ToLink for ImpairedLink {
    fn to_link(&self) -> LinkModel {
        self.model()
    }

    fn words(&self) -> Option<String> {
        Some(if self.is_ideal() { String::new() } else { self.to_string() })
    }
}
