//! NATs, firewalls and interfaces of a test bed: the hosts behind each NAT, the addresses inside, and the next hop of a packet.

use std::collections::BTreeMap;
use std::net::Ipv4Addr;

use cohaptic_wan::NodeId;

use crate::address::Addresses;
use crate::names::Names;
use crate::nat::Behaviour;

/// NAT or firewall, a node of the network without programs.
#[derive(Clone, Debug)]
pub(crate) struct Middlebox {
    pub(crate) node: NodeId,
    pub(crate) behaviour: Behaviour,
    /// `true` for a NAT, with translation of IPv4; `false` for a firewall.
    pub(crate) translates: bool,
    /// Hosts, NATs and firewalls directly behind, in the order of addresses.
    pub(crate) inside: Vec<NodeId>,
}

/// Interfaces of a host with several. An interface is a node of the network with addresses and links of its own; the host itself has no links.
#[derive(Clone, Debug)]
pub(crate) struct Interfaces {
    pub(crate) host: NodeId,
    /// Nodes of the interfaces. The first is the uplink at the beginning.
    pub(crate) nodes: Vec<NodeId>,
}

impl Interfaces {
    /// Returns the line of a link file for the interfaces.
    pub(crate) fn line(&self, names: &Names) -> String {
        let nodes: Vec<&str> = self.nodes.iter().map(|node| &*names[node.index()]).collect();
        format!("interfaces {}: {}", names[self.host.index()], nodes.join(" "))
    }

    /// Returns the call of the builder for the interfaces.
    pub(crate) fn call(&self, names: &Names) -> String {
        let nodes: Vec<String> = self.nodes.iter().map(|node| format!("{:?}", names[node.index()])).collect();
        format!(".interfaces({:?}, [{}])", names[self.host.index()], nodes.join(", "))
    }
}

/// Most NATs of a test bed, and most addresses behind a NAT, because the third number of an address counts the NATs and the fourth the hosts.
const MOST: usize = 254;

impl Middlebox {
    /// Returns the word for this node in messages and files.
    pub(crate) const fn noun(&self) -> &'static str {
        if self.translates { "nat" } else { "firewall" }
    }

    /// Returns the words of the behaviour.
    pub(crate) fn words(&self) -> String {
        if self.translates { self.behaviour.to_string() } else { self.behaviour.of_firewall() }
    }

    /// Returns the line of a link file for this node.
    pub(crate) fn line(&self, names: &Names) -> String {
        let inside: Vec<&str> = self.inside.iter().map(|node| &*names[node.index()]).collect();
        let words = self.words();
        let space = if words.is_empty() { "" } else { " " };
        format!("{} {}{space}{words}: {}", self.noun(), names[self.node.index()], inside.join(" "))
    }

    /// Returns the call of the builder for this node.
    pub(crate) fn call(&self, names: &Names) -> String {
        let inside: Vec<String> = self.inside.iter().map(|node| format!("{:?}", names[node.index()])).collect();
        format!(".{}({:?}, {:?}, [{}])", self.noun(), names[self.node.index()], self.words(), inside.join(", "))
    }
}

/// Checks that a further NAT or firewall can have `inside` hosts behind it.
/// `before` is the number of NATs before.
pub(crate) fn check_size(before: usize, translates: bool, inside: usize) -> Result<(), String> {
    if inside == 0 {
        return Err("expected the names of the hosts inside".to_owned());
    }
    if translates && before == MOST {
        return Err(format!("expected at most {MOST} NATs"));
    }
    if translates && inside > MOST { Err(format!("expected at most {MOST} hosts behind a NAT")) } else { Ok(()) }
}

/// Tree of the network: the NAT or firewall directly above each node.
#[derive(Clone, Debug)]
pub(crate) struct Topology {
    /// Node directly above, indexed by node; `None` for the hosts of the outermost network.
    parents: Vec<Option<NodeId>>,
    /// NAT around the network of a node, indexed by node. A firewall has no network of its own.
    networks: Vec<Option<NodeId>>,
    /// First three numbers of the addresses behind a NAT, and the number given last.
    given: BTreeMap<NodeId, ([u8; 3], u8)>,
}

impl Topology {
    /// Creates the tree of `nodes` nodes. A NAT or firewall stands in `boxes` after all nodes behind.
    pub(crate) fn new(nodes: usize, boxes: &[Middlebox]) -> Self {
        let mut tree = Self { parents: vec![None; nodes], networks: vec![None; nodes], given: BTreeMap::new() };
        for Middlebox { node, inside, .. } in boxes {
            inside.iter().for_each(|below| tree.parents[below.index()] = Some(*node));
        }
        let is_nat = |node: NodeId| boxes.iter().any(|middlebox| middlebox.node == node && middlebox.translates);
        for node in (0..nodes).map(NodeId::new) {
            let network = tree.line(node).skip(1).find(|above| is_nat(*above));
            tree.networks[node.index()] = network;
        }
        for (number, nat) in (1..).zip(boxes.iter().filter(|middlebox| middlebox.translates)) {
            let [one, two] = if nat.behaviour.is_carrier() { [100, 64] } else { [192, 168] };
            tree.given.insert(nat.node, ([one, two, number], 0));
        }
        tree
    }

    /// Returns the addresses of all nodes behind NATs, in short form. The nodes of a network have the numbers from 1 on, in the order of the test, and
    /// nodes behind a firewall come before the firewall.
    pub(crate) fn addresses(&mut self, boxes: &[Middlebox]) -> BTreeMap<(NodeId, bool), u32> {
        let mut order = Vec::new();
        boxes.iter().filter(|middlebox| middlebox.translates).for_each(|nat| list(nat, boxes, &mut order));
        order.into_iter().filter_map(|node| Some(((node, false), self.fresh(node)?))).collect()
    }

    /// Returns a new address of IPv4 in the network of `node`, in short form. `None` for a node of the outermost network, and if all
    /// addresses of the network were given.
    pub(crate) fn fresh(&mut self, node: NodeId) -> Option<u32> {
        let ([one, two, three], last) = self.given.get_mut(&self.networks[node.index()]?)?;
        *last = last.checked_add(1).filter(|number| usize::from(*number) <= MOST)?;
        Some(Addresses::short(Ipv4Addr::new(*one, *two, *three, *last).into()))
    }

    /// Returns the node directly above.
    pub(crate) fn parent(&self, node: NodeId) -> Option<NodeId> {
        self.parents[node.index()]
    }

    /// Returns a node and all nodes above, from the node upwards.
    fn line(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        std::iter::successors(Some(node), |node| self.parent(*node))
    }

    /// Returns whether `node` is in the network of a NAT.
    pub(crate) fn is_inside(&self, node: NodeId) -> bool {
        self.networks[node.index()].is_some()
    }

    /// Returns the NAT around the network of `to` if that network does not contain `from`: neither name nor address of `to` means anything there. A NAT belongs
    /// to the network behind as well.
    pub(crate) fn hides(&self, from: NodeId, to: NodeId) -> Option<NodeId> {
        self.networks[to.index()].filter(|network| self.line(from).all(|above| above != *network))
    }

    /// Returns whether there is a link between two nodes: either node is directly above, or both nodes are in the same network.
    pub(crate) fn is_link(&self, one: NodeId, other: NodeId) -> bool {
        let [above_one, above_other] = [one, other].map(|node| self.parent(node));
        above_one == above_other || above_one == Some(other) || above_other == Some(one)
    }

    /// Returns the next node on the way of a packet from `at` to `to`. `None` if no way leads to an address inside a network of IPv4.
    pub(crate) fn hop(&self, at: NodeId, to: NodeId, is_six: bool) -> Option<NodeId> {
        if !is_six && self.hides(at, to).is_some() {
            return None;
        }
        let above = self.parent(at);
        // Downwards through a node of the own network, or of the network below; otherwise upwards.
        self.line(to).find(|node| self.parent(*node) == Some(at) || self.parent(*node) == above).or(above)
    }
}

/// Lists the nodes in the network of a NAT, nodes behind firewalls included.
fn list(middlebox: &Middlebox, boxes: &[Middlebox], order: &mut Vec<NodeId>) {
    for node in &middlebox.inside {
        if let Some(firewall) = boxes.iter().find(|other| other.node == *node && !other.translates) {
            list(firewall, boxes, order);
        }
        order.push(*node);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nat::parse_words;

    #[test]
    fn packets_take_the_only_way_through_the_tree() {
        let nodes = NodeId::new;
        // Hosts 0 to 3; 0 and 1 at home (4), 2 behind a firewall (5) at home (6), both homes at a carrier (7).
        let middlebox = |node, words: &str, translates, inside: &[usize]| Middlebox {
            node: nodes(node),
            behaviour: parse_words(words, Behaviour::default(), translates).unwrap(),
            translates,
            inside: inside.iter().map(|node| nodes(*node)).collect(),
        };
        let boxes = [
            middlebox(4, "home", true, &[0, 1]),
            middlebox(5, "", false, &[2]),
            middlebox(6, "open", true, &[5]),
            middlebox(7, "cgnat", true, &[4, 6]),
        ];
        let mut tree = Topology::new(8, &boxes);
        let addresses: Vec<String> =
            tree.addresses(&boxes).into_iter().map(|((node, _), short)| format!("{} {}", node.0, Addresses::long(short, false))).collect();
        assert_eq!(addresses, ["0 192.168.1.1", "1 192.168.1.2", "2 192.168.2.1", "4 100.64.3.1", "5 192.168.2.2", "6 100.64.3.2"]);
        assert_eq!(tree.fresh(nodes(0)), Some(Addresses::short([192, 168, 1, 3].into())));
        let way = |mut at: usize, to: usize, is_six| {
            let mut way = vec![at];
            while at != to {
                let Some(next) = tree.hop(nodes(at), nodes(to), is_six) else { return vec![] };
                at = next.index();
                way.push(at);
            }
            way
        };
        for (from, to, four, six) in [
            (0, 1, vec![0, 1], vec![0, 1]),
            (0, 3, vec![0, 4, 7, 3], vec![0, 4, 7, 3]),
            (3, 0, vec![], vec![3, 7, 4, 0]),
            (2, 3, vec![2, 5, 6, 7, 3], vec![2, 5, 6, 7, 3]),
            (2, 0, vec![], vec![2, 5, 6, 4, 0]),
            (0, 6, vec![0, 4, 6], vec![0, 4, 6]),
            (0, 7, vec![0, 4, 7], vec![0, 4, 7]),
            (6, 2, vec![6, 5, 2], vec![6, 5, 2]),
            (3, 4, vec![], vec![3, 7, 4]),
        ] {
            assert_eq!((way(from, to, false), way(from, to, true)), (four, six), "{from} -> {to}");
        }
        let links: Vec<(usize, usize)> = (0..8)
            .flat_map(|one| (one + 1..8).map(move |other| (one, other)))
            .filter(|(one, other)| tree.is_link(nodes(*one), nodes(*other)))
            .collect();
        assert_eq!(links, [(0, 1), (0, 4), (1, 4), (2, 5), (3, 7), (4, 6), (4, 7), (5, 6), (6, 7)]);
    }
}
