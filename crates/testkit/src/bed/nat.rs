//! NATs, firewalls and interfaces of a test bed.

use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_wan::NodeId;

use super::{Bed, Testbed};
use crate::core::{Shared, shown};
use crate::nat::{self, Behaviour, Protocol, parse_words};
use crate::trace::Happening;

impl Testbed {
    /// Puts hosts behind a NAT. The hosts get addresses of a new network, 192.168.k.n for host n of NAT number k, and the NAT puts its external address on
    /// packets over IPv4. IPv6 is filtered in the same way, but not translated. Hosts outside find neither the names nor the addresses of
    /// hosts inside. Hosts of one network have links to each other and to their NAT, and the NAT has links to the hosts of the network outside. A NAT added
    /// before can be behind a further NAT.
    ///
    /// The words are a kind, and columns of the table with other values. Without a kind, the NAT is `home`.
    ///
    /// | kind | `mapping` | `filter` | `ports` | `hairpin` | `udp-timeout` |
    /// | --- | --- | --- | --- | --- | --- |
    /// | `open` | `endpoint-independent` | `endpoint-independent` | `kept` | `yes` | 300 s |
    /// | `address` | `endpoint-independent` | `address-dependent` | `kept` | `no` | 300 s |
    /// | `home` | `endpoint-independent` | `address-and-port-dependent` | `kept` | `no` | 300 s; 30 s before an answer (`udp-unanswered-timeout`) |
    /// | `strict` | `address-and-port-dependent` | `address-and-port-dependent` | `random` | `no` | 120 s |
    /// | `cgnat` | `endpoint-independent` | `endpoint-independent` | `random` | `yes` | 300 s |
    ///
    /// The network inside a `cgnat` is 100.64.k.n. Only outbound packets refresh a mapping. A taken port, and each port with `ports random`, is replaced by
    /// a random port from the seed. Connections of TCP follow RFC 5382: an established connection ends after `tcp-timeout` (7440 s), and any other after
    /// `tcp-transitory-timeout` (240 s), without a message to either end. An unexpected SYN is answered by a reset after 6 s, unless the host inside has sent a
    /// SYN to the same address by then. The terms are those of RFC 4787.
    ///
    /// ```
    /// use cohaptic_testkit::Testbed;
    ///
    /// let seen = Testbed::new(["laptop", "server"]).nat("router", "home", ["laptop"]).link("router", "server", "delay 20ms").run(|bed| async move {
    ///     let server = bed.host("server").bind("0.0.0.0:7").unwrap();
    ///     let laptop = bed.host("laptop").bind("192.168.1.1:5000").unwrap();
    ///     laptop.send_to(b"who am I?", "server:7").await.unwrap();
    ///     server.recv_from(&mut [0; 9]).await.unwrap().1
    /// });
    /// assert_eq!(seen.to_string(), "10.0.0.3:5000");
    /// ```
    ///
    /// # Panics
    ///
    /// If the words are wrong, there are no such hosts, one of them is behind another NAT or firewall, or another host has the name.
    pub fn nat<'a>(mut self, name: &str, words: &str, hosts: impl IntoIterator<Item = &'a str>) -> Self {
        self.add_middlebox(name, words, true, hosts);
        self
    }

    /// Puts hosts behind a firewall. A firewall lets packets out, and answers in. The hosts keep their addresses and names. The words are `filter`, the
    /// timeouts of [`Testbed::nat`], or nothing for the filter and the timeouts of `home`.
    ///
    /// # Panics
    ///
    /// As [`Testbed::nat`].
    pub fn firewall<'a>(mut self, name: &str, words: &str, hosts: impl IntoIterator<Item = &'a str>) -> Self {
        self.add_middlebox(name, words, false, hosts);
        self
    }

    /// Gives a host several interfaces, such as the two networks of a phone. An interface has addresses and links of its own, and can be behind a NAT: give its
    /// name in place of the name of the host. The first interface is the uplink, from whose address unbound sockets send; [`Host::uplink`](crate::Host::uplink)
    /// chooses the uplink. A socket bound to the address of an interface (`"lte:0"`) uses that interface. The name of the host stands for the addresses of its
    /// uplink.
    ///
    /// ```
    /// use cohaptic_testkit::Testbed;
    ///
    /// let bed = Testbed::new(["phone", "server"]).interfaces("phone", ["wifi", "lte"]).nat("home", "home", ["wifi"]).nat("carrier", "cgnat", ["lte"]);
    /// let seen = bed.run(|bed| async move {
    ///     let server = bed.host("server").bind("0.0.0.0:7").unwrap();
    ///     let phone = bed.host("phone").bind("0.0.0.0:0").unwrap();
    ///     let mut seen = Vec::new();
    ///     for uplink in ["wifi", "lte"] {
    ///         bed.host("phone").uplink(uplink);
    ///         phone.send_to(b"who am I?", "server:7").await.unwrap();
    ///         seen.push(server.recv_from(&mut [0; 9]).await.unwrap().1.ip().to_string());
    ///     }
    ///     seen
    /// });
    /// assert_eq!(seen, ["10.0.0.5", "10.0.0.6"]);
    /// ```
    ///
    /// # Panics
    ///
    /// If there is no such host, the host is behind a NAT or has interfaces already, or another host has one of the names.
    pub fn interfaces<'a>(mut self, host: &str, interfaces: impl IntoIterator<Item = &'a str>) -> Self {
        self.setup.add_interfaces(host, &interfaces.into_iter().collect::<Vec<_>>());
        self
    }

    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    fn add_middlebox<'a>(&mut self, name: &str, words: &str, translates: bool, hosts: impl IntoIterator<Item = &'a str>) {
        let behaviour = parse_words(words, Behaviour::default(), translates).unwrap_or_else(|error| panic!("`{name}`: {error}"));
        self.setup.add_middlebox(name, behaviour, translates, &hosts.into_iter().collect::<Vec<_>>());
    }
}

/// NAT or firewall of a running test bed.
#[derive(Clone)]
pub struct Nat {
    shared: Arc<Shared>,
    node: NodeId,
}

/// Mapping of a NAT: an endpoint inside, and the external endpoint of its packets.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct NatMapping {
    /// Protocol of the mapping.
    pub protocol: NatProtocol,
    /// Address and port inside.
    pub inside: SocketAddr,
    /// Address and port outside. Equal to `inside` where nothing is translated.
    pub outside: SocketAddr,
    /// Receivers of the endpoint inside in living sessions, sorted.
    pub peers: Vec<SocketAddr>,
}

/// Protocol of a mapping.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum NatProtocol {
    /// UDP.
    Udp,
    /// TCP.
    Tcp,
}

impl fmt::Display for NatMapping {
    /// Writes the mapping, such as `UDP 192.168.1.1:5000 is 10.0.0.3:5000 for 10.0.0.2:7`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { protocol, inside, outside, peers } = self;
        let protocol = match protocol {
            NatProtocol::Udp => "UDP",
            NatProtocol::Tcp => "TCP",
        };
        let peers: Vec<String> = peers.iter().map(SocketAddr::to_string).collect();
        write!(f, "{protocol} {inside} is {outside} for {}", peers.join(", "))
    }
}

impl Nat {
    /// Returns the name of the NAT.
    #[must_use]
    pub fn name(&self) -> String {
        self.shared.names()[self.node.index()].clone()
    }

    /// Removes all mappings and sessions, as after a restart of the device.
    pub fn forget(&self) {
        self.shared.with(|core| core.forget_mappings(self.node));
    }

    /// Changes the behaviour from now on. A kind sets all columns of the table of [`Testbed::nat`]; each other word sets its column alone. Mappings stay, and
    /// have the new filter and the new timeouts. The addresses inside do not change.
    ///
    /// # Panics
    ///
    /// If the words are wrong.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    pub fn set(&self, words: &str) {
        // A panic within the access would lose the state, and so comes afterwards.
        let set = self.shared.with(|core| {
            let is_nat = core.is_nat(self.node);
            let behaviour = core.behaviour_of(self.node);
            *behaviour = parse_words(words, behaviour.clone(), is_nat)?;
            core.wire.note(Happening::Reconfigured(self.node));
            Ok(())
        });
        set.unwrap_or_else(|error: crate::WordsError| panic!("{error}"));
    }

    /// Returns the present mappings, sorted by protocol and endpoint inside. A firewall has a mapping of each endpoint inside to itself.
    #[must_use]
    pub fn mappings(&self) -> Vec<NatMapping> {
        let of = |(protocol, is_six, inside, outside, peers): nat::Listed| NatMapping {
            protocol: match protocol {
                Protocol::Udp => NatProtocol::Udp,
                Protocol::Tcp => NatProtocol::Tcp,
            },
            inside: shown(inside, is_six),
            outside: shown(outside, is_six),
            peers: peers.into_iter().map(|peer| shown(peer, is_six)).collect(),
        };
        self.shared.with(|core| core.mappings_of(self.node)).into_iter().map(of).collect()
    }

    /// Returns the number of packets from outside dropped for want of a mapping, or by the filter.
    #[must_use]
    pub fn filtered(&self) -> u64 {
        self.shared.with(|core| core.filtered_of(self.node))
    }
}

impl fmt::Debug for Nat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Nat").field("name", &self.name()).finish_non_exhaustive()
    }
}

impl Bed {
    /// Returns the NAT or firewall named `name`.
    ///
    /// # Panics
    ///
    /// If no NAT or firewall has the name.
    #[must_use]
    pub fn nat(&self, name: &str) -> Nat {
        let node = self.names().node(name);
        assert!(self.shared.with(|core| core.is_middlebox(node)), "`{name}` is a host: `Bed::host` returns it");
        Nat { shared: Arc::clone(&self.shared), node }
    }
}

#[cfg(test)]
mod tests {
    use std::panic::Location;

    use super::*;
    use crate::again::Drawn;
    use crate::seed::{Place, Seed};

    #[test]
    fn a_printed_test_has_the_nats_and_firewalls() {
        let bed =
            Testbed::new(["a", "b", "c"]).firewall("w", "udp-timeout 9s", ["b"]).nat("n", "strict hairpin yes", ["a", "w"]).link("a", "n", "loss 1%");
        let text = bed.again(&Seed::choose(Some(3), &Place::of(&|| ())), Location::caller()).test(&Drawn::default(), true);
        let calls: Vec<&str> = text.lines().skip(2).take(3).map(str::trim).collect();
        assert_eq!(
            calls,
            [
                "Testbed::new([\"a\", \"b\", \"c\"])",
                ".firewall(\"w\", \"udp-timeout 9s\", [\"b\"])",
                ".nat(\"n\", \"strict hairpin yes\", [\"a\", \"w\"])"
            ]
        );
    }
}
