//! Names and addresses of the hosts of a test bed.

use std::collections::BTreeMap;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::names::Names;

/// Names and present addresses of all hosts.
///
/// Host number n, counted from 1, has the addresses 10.0.0.n and `fd00::n`, unless the test has chosen other addresses by
/// [`Testbed::address`](crate::Testbed::address). Beyond 255 the addresses go on with 10.0.1.0, as numbers of four bytes do. Addresses given out later, by
/// [`Host::change_addresses`](crate::Host::change_addresses), follow the addresses of all hosts.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AddressPlan {
    names: Arc<Names>,
    /// Short form of the present addresses of each host, of IPv4 and of IPv6, indexed by host.
    current: Vec<[u32; 2]>,
    /// Owner of the addresses of number `index + 1`, in IPv4 and in IPv6; `None` if the host has other addresses by now. Numbers beyond the end were never
    /// given in turn.
    owners: Vec<[Option<NodeId>; 2]>,
    /// Hosts with addresses chosen by the test, by version of IP (true for 6) and short form. Few or none, and looked at after `owners`.
    chosen: BTreeMap<(bool, u32), NodeId>,
    /// Nodes of the interfaces of hosts with several. The addresses of such a host in `current` are those of its uplink, and the host is the owner of the
    /// addresses of all its interfaces.
    interfaces: BTreeMap<NodeId, Vec<NodeId>>,
}

/// Addresses of one host.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Addresses {
    /// Address of IPv4.
    pub v4: Ipv4Addr,
    /// Address of IPv6.
    pub v6: Ipv6Addr,
}

/// Addresses of number 0. No host has the number 0.
const FIRST: (u32, u128) = (Ipv4Addr::new(10, 0, 0, 0).to_bits(), 0xfd00 << 112);

impl Addresses {
    /// Short forms of 127.0.0.1 and of `::1`.
    pub(crate) const LOOPBACK: [u32; 2] = [Ipv4Addr::LOCALHOST.to_bits().wrapping_sub(FIRST.0), 0];

    pub(crate) fn numbered(number: u32) -> Self {
        Self { v4: Ipv4Addr::from_bits(FIRST.0.wrapping_add(number)), v6: Ipv6Addr::from_bits(FIRST.1 + u128::from(number)) }
    }

    /// Returns the address in 32 bits: its distance to the address of number 0 of the same version. For the addresses of hosts the distance is their number,
    /// equal in both versions. In IPv6 the loopback address becomes 0, and every address that no host can have becomes `u32::MAX`.
    #[inline]
    pub(crate) const fn short(address: IpAddr) -> u32 {
        match address {
            IpAddr::V4(v4) => v4.to_bits().wrapping_sub(FIRST.0),
            IpAddr::V6(v6) => {
                let number = v6.to_bits().wrapping_sub(FIRST.1);
                #[expect(clippy::cast_possible_truncation, reason = "it is small enough")]
                if v6.is_loopback() {
                    0
                } else if number > 0 && number < u32::MAX as u128 {
                    number as u32
                } else {
                    u32::MAX
                }
            }
        }
    }

    /// Returns the address with the [short](Self::short) form `short`. For `u32::MAX` in IPv6 the result is an address of no host, not the original address.
    #[inline]
    pub(crate) fn long(short: u32, is_six: bool) -> IpAddr {
        match (is_six, short) {
            (false, _) => Ipv4Addr::from_bits(FIRST.0.wrapping_add(short)).into(),
            (true, 0) => Ipv6Addr::LOCALHOST.into(),
            (true, number) => Self::numbered(number).v6.into(),
        }
    }

    /// Returns whether the address with the short form `short` is a loopback address.
    #[inline]
    pub(crate) const fn is_loopback(short: u32, is_six: bool) -> bool {
        let bits = short.wrapping_add(FIRST.0);
        if is_six { short == 0 } else { bits >> 24 == 127 }
    }

    /// Returns whether `short` is a broadcast address of IPv4: 255.255.255.255, or 10.255.255.255, the broadcast address of the network of the hosts.
    #[inline]
    pub(crate) const fn is_broadcast(short: u32) -> bool {
        let bits = short.wrapping_add(FIRST.0);
        bits == u32::MAX || bits == FIRST.0 | 0x00ff_ffff
    }

    /// Returns whether `short` is a multicast address of IPv4 (RFC 1112): 224.0.0.0/4. Groups of IPv6 have a form of their
    /// own, `Group`.
    #[inline]
    pub(crate) const fn is_multicast(short: u32) -> bool {
        short.wrapping_add(FIRST.0) >> 28 == 0b1110
    }

    /// Returns whether the address belongs to the network of the hosts: 10.0.0.0/8 or `fd00::/8`. Nobody answers at such an address without a host. Other
    /// networks cannot be reached.
    pub(crate) const fn is_of_network(address: IpAddr) -> bool {
        match address {
            IpAddr::V4(v4) => v4.octets()[0] == 10,
            IpAddr::V6(v6) => v6.octets()[0] == 0xfd,
        }
    }

    /// Returns the short form of an address that a test has chosen for a host, or why no host can have the address.
    pub(crate) fn choose(address: IpAddr) -> Result<u32, String> {
        let short = Self::short(address);
        match address {
            IpAddr::V4(v4) => {
                // Addresses from 240.0.0.0 on are reserved (RFC 1112, section 4).
                let is_special = v4.is_unspecified() || v4.is_loopback() || v4.is_multicast() || v4.octets()[0] >= 240 || Self::is_broadcast(short);
                (!is_special)
                    .then_some(short)
                    .ok_or_else(|| format!("{v4} cannot be the address of a host: expected an address such as 192.168.1.10"))
            }
            IpAddr::V6(v6) if short == 0 || short == u32::MAX => {
                Err(format!("{v6} cannot be the address of a host: expected an address from fd00::1 to fd00::ffff:fffe"))
            }
            IpAddr::V6(_) => Ok(short),
        }
    }

    /// Returns the address of the same version as `other`.
    #[must_use]
    pub(crate) const fn like(&self, other: IpAddr) -> IpAddr {
        match other {
            IpAddr::V4(_) => IpAddr::V4(self.v4),
            IpAddr::V6(_) => IpAddr::V6(self.v6),
        }
    }

    /// Returns whether `address` is an address of the host.
    #[must_use]
    pub fn has(&self, address: IpAddr) -> bool {
        self.like(address) == address
    }
}

impl AddressPlan {
    /// Creates the plan. `chosen` holds the addresses chosen by the test in short form, by host and version of IP (true for 6).
    pub(crate) fn new(names: Arc<Names>, chosen: &BTreeMap<(NodeId, bool), u32>) -> Self {
        let taken = chosen.iter().map(|((host, is_six), short)| ((*is_six, *short), *host)).collect();
        let mut plan = Self { current: Vec::with_capacity(names.len()), names, owners: Vec::new(), chosen: taken, interfaces: BTreeMap::new() };
        for host in (0..plan.names.len()).map(NodeId::new) {
            let number = plan.fresh(host);
            plan.current.push([number; 2]);
        }
        for ((host, is_six), short) in chosen {
            let version = usize::from(*is_six);
            let given = std::mem::replace(&mut plan.current[host.index()][version], *short);
            // The number given in turn would otherwise lead to the host at an address that the host does not have.
            plan.let_go(version, given);
        }
        plan
    }

    /// Gives the next number without an address chosen by the test.
    fn fresh(&mut self, host: NodeId) -> u32 {
        loop {
            let number = u32::try_from(self.owners.len() + 1).unwrap_or(u32::MAX);
            let is_free = ![false, true].into_iter().any(|is_six| self.chosen.contains_key(&(is_six, number)));
            // The number of a chosen address is skipped. Its entry has no owner, so that later numbers keep their index.
            self.owners.push(if is_free { [Some(host); 2] } else { [None; 2] });
            if is_free {
                return number;
            }
        }
    }

    /// Takes an address given in turn away from its host.
    fn let_go(&mut self, version: usize, number: u32) {
        self.owners.iter_mut().skip(Self::place(number)).take(1).for_each(|owner| owner[version] = None);
    }

    /// Gives a host the addresses of these nodes. The first node is the uplink.
    pub(crate) fn add_interfaces(&mut self, host: NodeId, nodes: &[NodeId]) {
        for (version, short) in self.current[host.index()].into_iter().enumerate() {
            self.let_go(version, short);
        }
        let owned = self.owners.iter_mut().flatten().flatten().chain(self.chosen.values_mut());
        owned.filter(|owner| nodes.contains(owner)).for_each(|owner| *owner = host);
        self.interfaces.insert(host, nodes.to_vec());
        self.set_uplink(host, nodes[0]);
    }

    /// Gives a host the addresses of one of its interfaces as its usual ones.
    pub(crate) fn set_uplink(&mut self, host: NodeId, node: NodeId) {
        self.current[host.index()] = self.current[node.index()];
    }

    /// Returns the node with the usual addresses of a host: the host itself, or its uplink.
    pub(crate) fn uplink(&self, host: NodeId) -> NodeId {
        self.nodes_of(host).iter().copied().find(|node| self.current[node.index()] == self.current[host.index()]).unwrap_or(host)
    }

    /// Returns the interfaces of a host with several; empty for other hosts.
    pub(crate) fn nodes_of(&self, host: NodeId) -> &[NodeId] {
        self.interfaces.get(&host).map_or(&[], Vec::as_slice)
    }

    /// Returns the host of a node, which is the node itself unless the node is an interface.
    pub(crate) fn host_of(&self, node: NodeId) -> NodeId {
        self.interfaces.iter().find(|(_, nodes)| nodes.contains(&node)).map_or(node, |(host, _)| *host)
    }

    /// Returns the node by which a host has the address of the short form `short`: the host itself, or one of its interfaces. `None` if no interface has the
    /// address.
    pub(crate) fn node_at(&self, host: NodeId, short: u32, is_six: bool) -> Option<NodeId> {
        match self.nodes_of(host) {
            [] => Some(host),
            nodes => nodes.iter().copied().find(|node| self.short(*node, is_six) == short),
        }
    }

    /// Gives a host addresses that no host has had. The former addresses belong to no host from now on. `inside` is the address of IPv4 of a host behind a
    /// NAT, in short form.
    pub(crate) fn change(&mut self, host: NodeId, inside: Option<u32>) -> Addresses {
        let node = self.uplink(host);
        let before = self.current[node.index()];
        for (version, short) in before.into_iter().enumerate() {
            // The key stays if the address was chosen, so that the address is not given in turn.
            if self.chosen.get(&(version == 1, short)) != Some(&host) {
                self.let_go(version, short);
            }
        }
        let number = self.fresh(host);
        self.current[node.index()] = [number; 2];
        if let Some(inside) = inside {
            self.let_go(0, number);
            self.chosen.insert((false, inside), host);
            self.current[node.index()][0] = inside;
        }
        self.set_uplink(host, node);
        self.of(host)
    }

    /// Returns the names of the hosts, in the given order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    pub(crate) const fn shared_names(&self) -> &Arc<Names> {
        &self.names
    }

    /// Returns the addresses of the host named `name`, or `None` if there is no such host. Upper and lower case are the same, and a final dot is ignored, as
    /// with all names of hosts (RFC 4343).
    #[must_use]
    pub fn addresses(&self, name: &str) -> Option<Addresses> {
        self.names.find(name).map(|host| self.of(host))
    }

    /// Returns the name of the present owner of this address.
    #[must_use]
    pub fn owner(&self, address: IpAddr) -> Option<&str> {
        self.owner_node(address).map(|host| &*self.names[host.index()])
    }

    pub(crate) fn owner_node(&self, address: IpAddr) -> Option<NodeId> {
        self.owner_of(Addresses::short(address), address.is_ipv6())
    }

    /// Returns the host with the address of the short form `short`.
    #[inline]
    pub(crate) fn owner_of(&self, short: u32, is_six: bool) -> Option<NodeId> {
        // Most packets go to addresses given in turn, so `owners` is looked at first.
        match self.owners.get(Self::place(short)) {
            Some(owner) if owner[usize::from(is_six)].is_some() => owner[usize::from(is_six)],
            _ if self.chosen.is_empty() => None,
            _ => self.chooser_of(short, is_six),
        }
    }

    /// Returns the host with an address chosen by the test.
    #[cold]
    fn chooser_of(&self, short: u32, is_six: bool) -> Option<NodeId> {
        self.chosen.get(&(is_six, short)).copied().filter(|host| self.has(*host, short, is_six))
    }

    /// Returns whether packets can be sent to the address, even to an address of no host: the address belongs to the network of the hosts, or the test has
    /// chosen the address for a host.
    pub(crate) fn is_reachable(&self, address: IpAddr) -> bool {
        Addresses::is_of_network(address) || self.chosen.contains_key(&(address.is_ipv6(), Addresses::short(address)))
    }

    /// Returns the index in `owners` of the addresses of number `number`. For number 0, which no host has, the index wraps beyond the end.
    #[inline]
    const fn place(number: u32) -> usize {
        // Zero, the number of loopback in IPv6, becomes an index beyond all entries.
        number.wrapping_sub(1) as usize
    }

    /// Returns the short form of the present address of a host.
    #[inline]
    pub(crate) fn short(&self, host: NodeId, is_six: bool) -> u32 {
        self.current[host.index()][usize::from(is_six)]
    }

    /// Returns whether the address with the short form `short` is an address of the host, loopback included.
    #[inline]
    pub(crate) fn is_own(&self, host: NodeId, short: u32, is_six: bool) -> bool {
        self.short(host, is_six) == short
            || Addresses::is_loopback(short, is_six)
            // Asked first: few runs have interfaces, and each segment of TCP comes here.
            || !self.interfaces.is_empty() && self.is_of_interface(host, short, is_six)
    }

    /// Returns whether the host has the address, loopback excluded.
    pub(crate) fn has(&self, host: NodeId, short: u32, is_six: bool) -> bool {
        self.short(host, is_six) == short || self.is_of_interface(host, short, is_six)
    }

    /// Returns whether one of several interfaces of the host has the address.
    #[cold]
    pub(crate) fn is_of_interface(&self, host: NodeId, short: u32, is_six: bool) -> bool {
        self.nodes_of(host).iter().any(|node| self.short(*node, is_six) == short)
    }

    #[inline]
    pub(crate) fn of(&self, host: NodeId) -> Addresses {
        let [four, six] = self.current[host.index()];
        Addresses { v4: Addresses::numbered(four).v4, v6: Addresses::numbered(six).v6 }
    }
}

impl fmt::Display for AddressPlan {
    /// Writes a line per host, such as `server 10.0.0.2 fd00::2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.names.iter().enumerate().try_for_each(|(host, name)| {
            let Addresses { v4, v6 } = self.of(NodeId::new(host));
            writeln!(f, "{name} {v4} {v6}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_addresses_are_those_of_their_hosts() {
        let names: Arc<Names> = Arc::new(["a", "b", "c"].map(String::from).into_iter().collect());
        let short = |text: &str| Addresses::choose(text.parse().unwrap());
        // Host `a` has the address that would have been given to `b`, and `c` one of another network.
        let chosen = [((0, false), "10.0.0.2"), ((2, false), "192.168.1.10"), ((1, true), "fd00::5")];
        let chosen = chosen.map(|((host, is_six), text)| ((NodeId::new(host), is_six), short(text).unwrap())).into_iter().collect();
        let mut plan = AddressPlan::new(names, &chosen);
        assert_eq!(plan.to_string(), "a 10.0.0.2 fd00::1\nb 10.0.0.3 fd00::5\nc 192.168.1.10 fd00::4\n");
        let owner = |plan: &AddressPlan, text: &str| plan.owner(text.parse().unwrap()).map(str::to_owned);
        for (address, host) in [
            ("10.0.0.1", None),
            ("10.0.0.2", Some("a")),
            ("10.0.0.3", Some("b")),
            ("192.168.1.10", Some("c")),
            ("fd00::2", None),
            ("fd00::3", None),
            ("fd00::5", Some("b")),
            ("10.0.0.5", None),
            ("fd01::1", None),
        ] {
            assert_eq!(owner(&plan, address).as_deref(), host, "{address}");
        }
        // Addresses of different versions may have one short form: 127.0.0.1 and `fd00::7500:1`, `::1` and 10.0.0.0.
        for (address, is_own) in [
            ("10.0.0.2", true),
            ("fd00::1", true),
            ("10.0.0.1", false),
            ("127.0.0.1", true),
            ("127.9.9.9", true),
            ("fd00::7500:1", false),
            ("::1", true),
            ("10.0.0.0", false),
            ("fd00::", false),
            ("::ffff:10.0.0.2", false),
        ] {
            let ip: IpAddr = address.parse().unwrap();
            assert_eq!(plan.is_own(NodeId::new(0), Addresses::short(ip), ip.is_ipv6()), is_own, "{address}");
        }
        let moved = plan.change(NodeId::new(2), None);
        assert_eq!((moved.v4.to_string(), moved.v6.to_string()), ("10.0.0.6".into(), "fd00::6".into()));
        assert_eq!((owner(&plan, "192.168.1.10"), owner(&plan, "fd00::4"), owner(&plan, "10.0.0.6")), (None, None, Some("c".into())));
        for text in ["127.0.0.1", "0.0.0.0", "224.0.0.1", "255.255.255.255", "10.255.255.255", "250.0.0.1", "::1", "::", "fe80::1", "fd00::1:0:1"] {
            assert!(short(text).is_err(), "{text}");
        }
    }
}
