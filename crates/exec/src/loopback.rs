//! Loopback of a host: packets of the host to itself, on links to and from a node of its own, as if the servers of the host were another host.
//!
//! Both ends of such a packet have the same address, and the kernel most often chooses the port of a test's server as well as the port of a client. So the
//! direction of a packet does not follow from the packet. The sender of the first packet of a flow is the client: the sender of the SYN, or of the first
//! datagram.

use core::net::{IpAddr, SocketAddr};
use std::collections::BTreeMap;

use cohaptic_linkfile::router::Protocol;
use cohaptic_router::{Content, Headers, Packet};
use cohaptic_wan::{NodeId, Path};

/// Loopback of a host, with the directions of its flows.
#[derive(Debug)]
pub(crate) struct Loopback {
    /// Host of the clients and of the servers.
    pub(crate) host: NodeId,
    /// Node that stands for the servers.
    pub(crate) node: NodeId,
    flows: Recent,
}

/// Ends of a flow, or fragments of one packet.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Key {
    /// Protocol and both ends, the lower end first. Protocols other than TCP and UDP have the port 0.
    Flow(Protocol, [SocketAddr; 2]),
    /// Protocol, source, destination and identification.
    Fragments(Protocol, [IpAddr; 2], u32),
}

impl Loopback {
    /// Returns the loopback of a host, without flows.
    pub(crate) fn new(host: NodeId, node: NodeId) -> Self {
        Self { host, node, flows: Recent::default() }
    }

    /// Returns whether a path is one of the two links of this loopback.
    pub(crate) fn has(&self, path: Path) -> bool {
        path.from == self.node || path.to == self.node
    }

    /// Returns the link for a packet of the host to itself.
    pub(crate) fn link(&mut self, packet: &Packet, headers: &Headers) -> Path {
        if self.is_of_client(packet, headers) { Path { from: self.host, to: self.node } } else { Path { from: self.node, to: self.host } }
    }

    fn is_of_client(&mut self, packet: &Packet, headers: &Headers) -> bool {
        let fragments =
            packet.fragment().map(|fragment| Key::Fragments(fragment.protocol, [headers.source, headers.destination], fragment.identification));
        if let (Some(key), None) = (fragments, headers.transport) {
            // A later fragment has no ports. The kernel sends the first fragment before the later ones, so the table has the key.
            return self.flows.get_or_insert(key, true);
        }
        let is_of_client = if let Some(quoted) = packet.quoted_headers() {
            // The receiver of a packet reports the error, so the message goes against the flow of the packet.
            !self.flow(&quoted, false)
        } else if headers.protocol == Protocol::ICMP {
            !is_answer(packet)
        } else {
            self.flow(headers, is_opening(packet))
        };
        if let Some(key) = fragments {
            self.flows.insert(key, is_of_client);
        }
        is_of_client
    }

    /// Returns whether the client of a flow sends a packet. `opens`: the packet opens a connection, even if its ends had a flow before.
    fn flow(&mut self, headers: &Headers, opens: bool) -> bool {
        let [from, to] = headers.ports.unwrap_or_default();
        let (source, destination) = (SocketAddr::new(headers.source, from), SocketAddr::new(headers.destination, to));
        let is_from_lower = source <= destination;
        let key = Key::Flow(headers.protocol, if is_from_lower { [source, destination] } else { [destination, source] });
        if opens {
            self.flows.insert(key, is_from_lower);
        }
        // The table holds whether the lower end is the client.
        self.flows.get_or_insert(key, is_from_lower) == is_from_lower
    }
}

/// Returns a byte of the transport header, counted from its first byte, or `None` if the packet has no such byte.
fn transport_byte(packet: &Packet, place: usize) -> Option<u8> {
    let Content::Ip { at, headers } = packet.content() else { return None };
    packet.bytes().get(at + headers.transport? + place).copied()
}

/// Returns whether a packet of ICMP answers a question: an echo reply, or one of the old replies to questions about times and addresses (RFC 792, RFC 950).
fn is_answer(packet: &Packet) -> bool {
    transport_byte(packet, 0).is_some_and(|kind| matches!(kind, 0 | 14 | 16 | 18))
}

/// Returns whether a packet is the first of a connection of TCP: a SYN that acknowledges nothing.
fn is_opening(packet: &Packet) -> bool {
    const SYN: u8 = 0x02;
    const ACK: u8 = 0x10;
    let Content::Ip { headers, .. } = packet.content() else { return false };
    headers.protocol == Protocol::TCP && transport_byte(packet, 13).is_some_and(|flags| flags & (SYN | ACK) == SYN)
}

/// Directions of the latest flows, in bounded memory: at least the latest [`Recent::MOST`] flows, and at most twice as many.
#[derive(Debug, Default)]
struct Recent {
    /// Flows with a packet since the latest change of generations.
    young: BTreeMap<Key, bool>,
    /// Flows of the generation before.
    old: BTreeMap<Key, bool>,
}

impl Recent {
    /// Flows of a generation. Few runs have as many flows, because each flow needs a socket. A forgotten flow counts as a new flow. Tests fill the table, and
    /// have a smaller one.
    const MOST: usize = if cfg!(test) { 1 << 12 } else { 1 << 16 };

    /// Returns the value of a key. An unknown key gets the value `new`.
    fn get_or_insert(&mut self, key: Key, new: bool) -> bool {
        if let Some(value) = self.young.get(&key) {
            return *value;
        }
        let value = self.old.get(&key).copied().unwrap_or(new);
        self.insert(key, value);
        value
    }

    fn insert(&mut self, key: Key, value: bool) {
        self.young.insert(key, value);
        if self.young.len() >= Self::MOST {
            self.old = core::mem::take(&mut self.young);
        }
    }
}

#[cfg(test)]
mod tests {
    use etherparse::PacketBuilder;

    use super::*;

    const HOST: NodeId = NodeId(0);
    const NODE: NodeId = NodeId(2);

    /// Returns whether packets go from the client to the server.
    fn directions<const N: usize>(packets: [Packet; N]) -> [bool; N] {
        let mut loopback = Loopback::new(HOST, NODE);
        packets.map(|packet| goes_to_server(&mut loopback, &packet))
    }

    fn goes_to_server(loopback: &mut Loopback, packet: &Packet) -> bool {
        let Content::Ip { headers, .. } = packet.content() else { panic!("no packet of IP: {packet:?}") };
        let path = loopback.link(packet, headers);
        assert!(loopback.has(path) && (path.from == HOST) != (path.to == HOST), "{path:?}");
        path.from == HOST
    }

    fn datagram([from, to]: [u16; 2]) -> Packet {
        Packet::datagram(local(from), local(to), b"data").unwrap()
    }

    fn local(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn segment([from, to]: [u16; 2], is_syn: bool, is_ack: bool) -> Packet {
        let mut builder = PacketBuilder::ipv4([127, 0, 0, 1], [127, 0, 0, 1], 64).tcp(from, to, 7, 1000);
        builder = if is_syn { builder.syn() } else { builder };
        builder = if is_ack { builder.ack(8) } else { builder };
        let mut bytes = Vec::new();
        builder.write(&mut bytes, &[]).unwrap();
        Packet::checked(bytes)
    }

    fn icmp(
        of: impl FnOnce(etherparse::PacketBuilderStep<etherparse::IpHeaders>) -> etherparse::PacketBuilderStep<etherparse::Icmpv4Header>,
    ) -> Packet {
        let mut bytes = Vec::new();
        of(PacketBuilder::ipv4([127, 0, 0, 1], [127, 0, 0, 1], 64)).write(&mut bytes, &[0; 32]).unwrap();
        Packet::checked(bytes)
    }

    /// The first sender is the client, whether its port is the higher or the lower one.
    #[test]
    fn the_first_datagram_of_a_flow_comes_from_its_client() {
        let questions = [[50_000, 80], [80, 50_000], [50_000, 80], [81, 50_000], [50_000, 81], [50_000, 80], [9, 9]];
        assert_eq!(directions(questions.map(datagram)), [true, false, true, true, false, true, true]);
    }

    /// A SYN opens a connection, so both ends of an earlier connection may change their roles. A SYN that acknowledges opens nothing.
    #[test]
    fn the_sender_of_the_syn_is_the_client() {
        let [there, back] = [[40_000, 50_000], [50_000, 40_000]];
        let connection = [segment(there, true, false), segment(back, true, true), segment(there, false, true), segment(there, true, false)];
        assert_eq!(directions(connection), [true, false, true, true]);
        let other_way = [segment(there, true, false), segment(back, true, false), segment(there, true, true), segment(back, false, true)];
        assert_eq!(directions(other_way), [true, true, false, true]);
        // Datagrams with the same ports are another flow.
        assert_eq!(directions([segment(there, true, false), datagram(back), datagram(there)]), [true, true, false]);
    }

    /// Later fragments follow the first, also between packets of the other direction.
    #[test]
    fn fragments_take_the_way_of_their_packet() {
        let long = |ends: [u16; 2], identification| {
            let packet = Packet::datagram(local(ends[0]), local(ends[1]), &[7; 4000]).unwrap();
            <[Packet; 3]>::try_from(packet.cut(1500, identification)).unwrap()
        };
        let ([question, second, third], [answer, after, last]) = (long([50_000, 80], 1), long([80, 50_000], 2));
        let all = [question, second, answer, third, after, last];
        assert_eq!(directions(all), [true, true, false, true, false, false]);
    }

    #[test]
    fn answers_and_errors_of_icmp_go_back() {
        let [request, reply] = [icmp(|ip| ip.icmpv4_echo_request(1, 1)), icmp(|ip| ip.icmpv4_echo_reply(1, 1))];
        let closed = |[from, to]: [u16; 2]| {
            Packet::unreachable(local(0).ip(), Protocol::UDP, [local(from), local(to)], 0, cohaptic_router::Unreachable::Port).unwrap()
        };
        assert_eq!(directions([request, reply]), [true, false]);
        // The first error is about a question, and the second one about an answer that comes after the end of the client.
        let [there, back] = [[50_000, 80], [80, 50_000]];
        assert_eq!(directions([datagram(there), closed(there), closed(back)]), [true, false, true]);
    }

    /// A flow that goes on is remembered however many others come and go, and memory has a bound.
    #[test]
    fn a_busy_flow_outlives_many_others() {
        let mut loopback = Loopback::new(HOST, NODE);
        assert!(goes_to_server(&mut loopback, &datagram([50_000, 80])));
        for other in 0..5 * u32::try_from(Recent::MOST).unwrap() / 2 {
            let ports = [10_000 + u16::try_from(other % 10_000).unwrap(), 1 + u16::try_from(other / 10_000).unwrap()];
            assert!(goes_to_server(&mut loopback, &datagram(ports)));
            if other % 1000 == 0 {
                assert!(!goes_to_server(&mut loopback, &datagram([80, 50_000])));
            }
        }
        assert!(loopback.flows.young.len() + loopback.flows.old.len() <= 2 * Recent::MOST);
    }
}
