//! Test beds with networks drawn by strategies.

use cohaptic_wan::{LinkModel, NodeId, Path};

use super::Testbed;
use crate::link::ToLink;
use crate::strategies::{ImpairedLink, ImpairedNetwork};

impl Testbed {
    /// Sets all links to the links of a network. A strategy has drawn the network, or a printed test contains the network. Host number n of the network is host
    /// number n of this test bed. A host behind a NAT ([`Networks::behind_nats`](crate::strategies::Networks::behind_nats)) named `client` is behind a NAT
    /// named `nat-client`.
    ///
    /// # Panics
    ///
    /// If the numbers of hosts differ.
    pub fn network(mut self, network: &ImpairedNetwork) -> Self {
        let hosts = self.setup.hosts();
        assert!(network.hosts() == hosts, "the network has {} hosts and the test bed has {hosts}: expected the same number", network.hosts());
        // A NAT stands in the place of its host: the links of the host are those of the NAT.
        let mut outside: Vec<NodeId> = (0..hosts).map(NodeId::new).collect();
        for (host, words) in network.nats() {
            let name = self.setup.names[host.index()].clone();
            let nat = format!("nat-{name}");
            self = self.nat(&nat, &words, [&*name]).link_both(&name, &nat, "");
            outside[host.index()] = self.setup.names.node(&nat);
        }
        for (from, to, link) in network.links() {
            self.setup.set_path(Path { from: outside[from.index()], to: outside[to.index()] }, link);
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
