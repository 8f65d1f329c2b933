//! From a frame to the UDP datagram in it.

use std::hash::{DefaultHasher, Hash, Hasher};

use pcap_parser::Linktype;

use super::reader::Frame;

/// What matching needs of a datagram.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Datagram {
    /// When it was captured, in nanoseconds since 1970.
    pub(super) nanos: i128,
    pub(super) destination_port: u16,
    /// Length and hash of the payload. With 10⁶ datagrams, two different ones have the same hash with probability 3·10⁻⁸.
    pub(super) payload: (usize, u64),
    /// The IPv4 identification.
    pub(super) identification: Option<u16>,
}

const UDP: u8 = 17;
const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86DD;
/// 802.1Q, 802.1ad, and the older tag of nested VLANs.
const VLAN: [u16; 3] = [0x8100, 0x88A8, 0x9100];

/// The datagram; `None` if there is another protocol in the frame, a fragment, or too little of it.
pub(super) fn datagram(frame: &Frame<'_>) -> Option<Datagram> {
    let packet = match frame.link_type {
        Linktype::ETHERNET => by_ether_type(frame.data.get(12..)?)?,
        // "Cooked" captures: the type stands at the end of the first header and at the start of the second.
        Linktype::LINUX_SLL => by_ether_type(frame.data.get(14..)?)?,
        Linktype::LINUX_SLL2 => is_ip(half(frame.data, 0)?).then(|| frame.data.get(20..)).flatten()?,
        Linktype::NULL | Linktype::LOOP => frame.data.get(4..)?,
        Linktype::RAW | Linktype::IPV4 | Linktype::IPV6 => frame.data,
        // BSD's own number for raw IP.
        Linktype(12 | 14) => frame.data,
        _ => return None,
    };
    let (identification, udp) = match packet.first()? >> 4 {
        4 => ipv4(packet)?,
        6 => (None, ipv6(packet)?),
        _ => return None,
    };
    // The length of the datagram, of which the capture may hold less; padding of short frames is beyond it.
    let length = usize::from(half(udp, 4)?);
    let payload = udp.get(8..length.min(udp.len()))?;
    let mut hasher = DefaultHasher::new();
    payload.hash(&mut hasher);
    Some(Datagram { nanos: frame.nanos, destination_port: half(udp, 2)?, payload: (payload.len(), hasher.finish()), identification })
}

/// What follows an Ethernet type, VLAN tags passed over, if it is IP.
fn by_ether_type(mut from: &[u8]) -> Option<&[u8]> {
    while VLAN.contains(&half(from, 0)?) {
        from = from.get(4..)?;
    }
    is_ip(half(from, 0)?).then(|| &from[2..])
}

const fn is_ip(ether_type: u16) -> bool {
    ether_type == IPV4 || ether_type == IPV6
}

/// The identification and what the packet carries, if that is a whole UDP datagram.
fn ipv4(packet: &[u8]) -> Option<(Option<u16>, &[u8])> {
    let header = usize::from(packet.first()? & 0xf) * 4;
    // More fragments, or not the first.
    let is_fragment = half(packet, 6)? & 0x3fff != 0;
    (*packet.get(9)? == UDP && !is_fragment && header >= 20).then_some(())?;
    Some((half(packet, 4), packet.get(header..)?))
}

fn ipv6(packet: &[u8]) -> Option<&[u8]> {
    (*packet.get(6)? == UDP).then(|| packet.get(40..)).flatten()
}

fn half(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
}
