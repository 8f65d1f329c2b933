//! Packets that the program makes by itself: datagrams of UDP, answers to echo requests, and messages that a destination is unreachable.

use core::net::{IpAddr, SocketAddr};

use cohaptic_linkfile::router::Protocol;

use super::checksum::{fold, of_sum, offset, pseudo_header, sum, transport_field};
use super::headers::{Headers, V4_CHECKSUM};
use super::{Content, Packet};

/// Length of the header of UDP \[bytes\].
const UDP_HEADER: usize = 8;

/// Reason why a destination is unreachable (RFC 792, RFC 4443).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unreachable {
    /// There is no route to the network.
    Network,
    /// The host does not answer.
    Host,
    /// No program listens at the port.
    Port,
}

impl Packet {
    /// Returns a datagram of UDP with right checksums. Returns `None` if the addresses differ in their version, or if the datagram is longer than a packet.
    #[must_use]
    pub fn datagram(source: SocketAddr, destination: SocketAddr, data: &[u8]) -> Option<Self> {
        let length = u16::try_from(UDP_HEADER + data.len()).ok()?;
        let mut segment = Vec::with_capacity(usize::from(length));
        segment.extend([source.port(), destination.port(), length, 0].map(u16::to_be_bytes).concat());
        segment.extend_from_slice(data);
        Self::around(source.ip(), destination.ip(), Protocol::UDP, &segment)
    }

    /// Returns the data of a datagram of UDP. Returns `None` for any other packet, a fragment, and a datagram whose checksum is wrong.
    #[must_use]
    pub fn datagram_data(&self) -> Option<&[u8]> {
        let (bytes, headers) = self.whole(Protocol::UDP)?;
        let begin = headers.transport?;
        let length = usize::from(u16::from_be_bytes([*bytes.get(begin + 4)?, *bytes.get(begin + 5)?]));
        is_right(bytes, headers).then(|| bytes.get(begin + UDP_HEADER..begin + length))?
    }

    /// Returns the answer to an echo request of ICMP (RFC 792) or of ICMPv6 (RFC 4443), or `None` if the packet is no whole and right echo request.
    #[must_use]
    pub fn echo_reply(&self) -> Option<Self> {
        let Content::Ip { headers, .. } = &self.content else { return None };
        let (request, answer) = if headers.source.is_ipv4() { (8, 0) } else { (128, 129) };
        let protocol = icmp(headers.source);
        let (bytes, headers) = self.whole(protocol)?;
        let mut message = bytes.get(headers.transport?..)?.to_vec();
        if message.len() < 8 || message[0] != request || !is_right(bytes, headers) {
            return None;
        }
        message[0] = answer;
        Self::around(headers.destination, headers.source, protocol, &message)
    }

    /// Returns the message of `by` that the destination of a packet is unreachable. The message quotes the packet as far as its sender needs to find the
    /// socket: the ends, and the four bytes after the ports, which are the sequence number of TCP. Returns `None` if the addresses differ in their version.
    #[must_use]
    pub fn unreachable(by: IpAddr, protocol: Protocol, [source, destination]: [SocketAddr; 2], sequence: u32, why: Unreachable) -> Option<Self> {
        let (kind, code) = match (by.is_ipv4(), why) {
            (true, Unreachable::Network) => (3, 0),
            (true, Unreachable::Host) => (3, 1),
            (true, Unreachable::Port) => (3, 3),
            (false, Unreachable::Network) => (1, 0),
            (false, Unreachable::Host) => (1, 3),
            (false, Unreachable::Port) => (1, 4),
        };
        let mut begin = [source.port(), destination.port()].map(u16::to_be_bytes).concat();
        begin.extend(sequence.to_be_bytes());
        let quoted = Self::quoted(source.ip(), destination.ip(), protocol, &begin)?;
        let mut message = vec![kind, code, 0, 0, 0, 0, 0, 0];
        message.extend(quoted);
        Self::around(by, source.ip(), icmp(by), &message)
    }

    /// Returns the headers of the packet that an error message of ICMP for IPv4 quotes (RFC 792). The length is that of the quote, which the sender of the
    /// message may have cut. Returns `None` for every other packet, and for a quote without a whole header.
    #[must_use]
    pub fn quoted_headers(&self) -> Option<Headers> {
        // Unreachable, source quench, redirect, time exceeded, parameter problem.
        const ERRORS: [u8; 5] = [3, 4, 5, 11, 12];
        let (bytes, headers) = self.whole(Protocol::ICMP)?;
        let message = bytes.get(headers.transport?..)?;
        let mut quote = message.get(8..).filter(|_| ERRORS.contains(&message[0]))?.to_vec();
        let length = u16::try_from(quote.len()).ok()?;
        quote.get_mut(2..4)?.copy_from_slice(&length.to_be_bytes());
        Headers::read(&quote).ok()
    }

    /// Returns a packet of IP around a transport header with its data, and computes both checksums.
    fn around(source: IpAddr, destination: IpAddr, protocol: Protocol, segment: &[u8]) -> Option<Self> {
        let mut bytes = Self::quoted(source, destination, protocol, segment)?;
        let headers = Headers::read(&bytes).ok()?;
        let begin = bytes.len() - segment.len();
        let field = begin + offset(protocol)?;
        bytes.get_mut(field..field + 2)?.fill(0);
        let checksum = of_sum(protocol, fold(u64::from(covered_beside(&headers, begin)) + u64::from(sum(&bytes[begin..]))));
        bytes[field..field + 2].copy_from_slice(&checksum.to_be_bytes());
        Some(Self::checked(bytes))
    }

    /// Returns a header of IP before the bytes `segment`, which stay as they are.
    pub(super) fn quoted(source: IpAddr, destination: IpAddr, protocol: Protocol, segment: &[u8]) -> Option<Vec<u8>> {
        const TTL: u8 = 64;
        let mut bytes = Vec::with_capacity(40 + segment.len());
        match (source, destination) {
            (IpAddr::V4(source), IpAddr::V4(destination)) => {
                let length = u16::try_from(20 + segment.len()).ok()?.to_be_bytes();
                // The flag "don't fragment" is set, so that the identification has no meaning (RFC 6864).
                bytes.extend([0x45, 0, length[0], length[1], 0, 0, 0x40, 0, TTL, protocol.0, 0, 0]);
                bytes.extend([source.octets(), destination.octets()].concat());
                let checksum = (!sum(&bytes)).to_be_bytes();
                bytes[V4_CHECKSUM..V4_CHECKSUM + 2].copy_from_slice(&checksum);
            }
            (IpAddr::V6(source), IpAddr::V6(destination)) => {
                let length = u16::try_from(segment.len()).ok()?.to_be_bytes();
                bytes.extend([0x60, 0, 0, 0, length[0], length[1], protocol.0, TTL]);
                bytes.extend([source.octets(), destination.octets()].concat());
            }
            (IpAddr::V4(_), IpAddr::V6(_)) | (IpAddr::V6(_), IpAddr::V4(_)) => return None,
        }
        bytes.extend_from_slice(segment);
        Some(bytes)
    }

    /// Returns bytes and headers of a packet of IP that is no fragment and has the protocol.
    fn whole(&self, protocol: Protocol) -> Option<(&[u8], &Headers)> {
        let Content::Ip { at, headers } = &self.content else { return None };
        (headers.is_whole && headers.protocol == protocol).then_some((&self.bytes[*at..*at + headers.length], headers))
    }
}

/// Returns the protocol of control messages that belongs to an address.
const fn icmp(address: IpAddr) -> Protocol {
    if address.is_ipv4() { Protocol::ICMP } else { Protocol::ICMPV6 }
}

/// Returns the sum that a checksum covers beside the bytes from `begin` on: the pseudo-header, which ICMP for IPv4 does not have.
fn covered_beside(headers: &Headers, begin: usize) -> u16 {
    if headers.protocol == Protocol::ICMP { 0 } else { pseudo_header(headers, begin) }
}

/// Returns whether the checksum of the transport protocol is right, or absent as UDP allows. `bytes` end with the packet.
fn is_right(bytes: &[u8], headers: &Headers) -> bool {
    let Some(begin) = headers.transport else { return false };
    transport_field(bytes, headers).is_none() || fold(u64::from(covered_beside(headers, begin)) + u64::from(sum(&bytes[begin..]))) == 0xffff
}

#[cfg(test)]
mod tests {
    use etherparse::{IcmpEchoHeader, Icmpv4Type, PacketBuilder, SlicedPacket, TransportSlice};

    use super::*;
    use crate::packet::Framing;

    const V4: [&str; 2] = ["10.0.0.1:1000", "10.0.0.2:2000"];
    const V6: [&str; 2] = ["[fd00::1]:1000", "[fd00::2]:2000"];

    fn ends(texts: [&str; 2]) -> [SocketAddr; 2] {
        texts.map(|text| text.parse().unwrap())
    }

    #[test]
    fn a_datagram_is_the_one_of_another_program_and_damage_is_seen() {
        for texts in [V4, V6] {
            let [source, destination] = ends(texts);
            let packet = Packet::datagram(source, destination, b"hello").unwrap();
            let mut expected = Vec::new();
            match (source.ip(), destination.ip()) {
                (IpAddr::V4(from), IpAddr::V4(to)) => {
                    PacketBuilder::ipv4(from.octets(), to.octets(), 64).udp(1000, 2000).write(&mut expected, b"hello").unwrap();
                }
                (IpAddr::V6(from), IpAddr::V6(to)) => {
                    PacketBuilder::ipv6(from.octets(), to.octets(), 64).udp(1000, 2000).write(&mut expected, b"hello").unwrap();
                }
                _ => unreachable!(),
            }
            assert_eq!(packet.bytes(), expected);
            assert_eq!(packet.datagram_data(), Some(b"hello".as_slice()));
            for bit in packet.bytes().len() * 8 - 40..packet.bytes().len() * 8 {
                let mut bytes = packet.bytes().to_vec();
                bytes[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(Packet::new(bytes, Framing::Ip).datagram_data(), None);
            }
        }
        let [source, destination] = [V4[0], V6[0]].map(|text| text.parse().unwrap());
        assert_eq!(Packet::datagram(source, destination, b""), None);
        assert_eq!(Packet::datagram(source, source, &[0; 65_536]), None);
    }

    #[test]
    fn an_echo_is_answered_with_the_same_data() {
        let mut bytes = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).icmpv4_echo_request(7, 8).write(&mut bytes, b"data").unwrap();
        let answer = Packet::new(bytes, Framing::Ip).echo_reply().unwrap();
        let sliced = SlicedPacket::from_ip(answer.bytes()).unwrap();
        let Some(TransportSlice::Icmpv4(icmp)) = sliced.transport else { panic!("no answer of ICMP") };
        assert_eq!(icmp.icmp_type(), Icmpv4Type::EchoReply(IcmpEchoHeader { id: 7, seq: 8 }));
        assert_eq!(icmp.payload(), b"data");
        assert_eq!(sum(&answer.bytes()[20..]), 0xffff);
        // An answer is not answered.
        assert_eq!(answer.echo_reply(), None);
        let mut bytes = Vec::new();
        PacketBuilder::ipv6([1; 16], [2; 16], 64).icmpv6_echo_request(7, 8).write(&mut bytes, b"data").unwrap();
        let answer = Packet::new(bytes, Framing::Ip).echo_reply().unwrap();
        assert_eq!(answer.bytes()[40], 129);
        assert!(is_right(answer.bytes(), &Headers::read(answer.bytes()).unwrap()));
    }

    #[test]
    fn a_message_quotes_the_ends() {
        for (texts, by, kind, header) in [(V4, "10.0.0.9", [3, 3], 20), (V6, "fd00::9", [1, 4], 40)] {
            let packet = Packet::unreachable(by.parse().unwrap(), Protocol::UDP, ends(texts), 7, Unreachable::Port).unwrap();
            assert_eq!(packet.bytes()[header..header + 2], kind);
            let quoted = Headers::read(&packet.bytes()[header + 8..]).unwrap();
            assert_eq!((quoted.destination, quoted.ports), (ends(texts)[1].ip(), Some([1000, 2000])));
            assert!(is_right(packet.bytes(), &Headers::read(packet.bytes()).unwrap()));
        }
    }

    /// The quote of a long packet is cut, and has its ends all the same.
    #[test]
    fn the_quote_of_an_error_message_is_read() {
        let [source, destination] = ends(V4);
        let error = Packet::unreachable("10.0.0.9".parse().unwrap(), Protocol::UDP, [source, destination], 0, Unreachable::Port).unwrap();
        let mut bytes = error.bytes().to_vec();
        // The length in the quote is that of the quoted packet, of which few bytes are here.
        bytes[30..32].copy_from_slice(&1500_u16.to_be_bytes());
        let quoted = Packet::new(bytes.clone(), Framing::Ip).quoted_headers().unwrap();
        assert_eq!((quoted.source, quoted.destination, quoted.ports), (source.ip(), destination.ip(), Some([1000, 2000])));
        // An echo request has data and no quote, and a message may end before the quote does.
        bytes[20] = 8;
        assert_eq!(Packet::new(bytes, Framing::Ip).quoted_headers(), None);
        for packet in [Packet::datagram(source, destination, b"hello"), Packet::around(source.ip(), destination.ip(), Protocol::ICMP, &[3; 20])] {
            assert_eq!(packet.unwrap().quoted_headers(), None);
        }
    }
}
