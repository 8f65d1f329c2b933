//! Test beds with networks drawn by strategies.

use cohaptic_wan::{LinkModel, Path};

use super::Testbed;
use crate::link::ToLink;
use crate::strategies::{ImpairedLink, ImpairedNetwork};

impl Testbed {
    /// Sets all links to the links of a network. A strategy has drawn the network, or a printed test contains the network. Host number n of the network is host
    /// number n of this test bed.
    ///
    /// # Panics
    ///
    /// If the numbers of hosts differ.
    pub fn network(mut self, network: &ImpairedNetwork) -> Self {
        let hosts = self.setup.hosts();
        assert!(network.hosts() == hosts, "the network has {} hosts and the test bed has {hosts}: expected the same number", network.hosts());
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
