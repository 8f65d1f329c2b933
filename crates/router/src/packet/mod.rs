//! Packets with the header fields for the choice of a link, and the changes of bytes made by links.
//!
//! ```text
//!   frame  │ Ethernet, VLAN tags │ IPv4 or IPv6 header, extensions │ ports … │ data │ padding │
//!          0                     ip                                transport        end
//! ```
//!
//! The module trusts no header: any bytes are read without a panic, and contradictions become [`Content::Malformed`].

mod build;
mod checksum;
mod fragment;
mod headers;
mod segments;

use cohaptic_linkfile::router::Protocol;
use cohaptic_units::Bytes;
use cohaptic_wan::{Damage, PacketInfo};

use checksum::{change, sum, transport_field};
use headers::V4_CHECKSUM;

pub use build::Unreachable;
pub use cohaptic_units::Ecn;
pub use fragment::Fragment;
pub use headers::{Headers, Malformed};
pub use segments::Join;
pub(crate) use segments::{cut, join, slices};

/// Framing of the bytes of a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Framing {
    /// Packets of IP, as from a TUN device.
    Ip,
    /// Ethernet frames.
    Ethernet,
}

/// Packet in the router, with all its bytes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Packet {
    /// All bytes, as received or as changed since then.
    bytes: Vec<u8>,
    content: Content,
    /// Whether the checksum of TCP or UDP is known to be right, by the word of the device that gave the packet.
    is_checked: bool,
}

/// Kind of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Content {
    /// Packet of IP.
    Ip {
        /// Index of the first byte of the IP header.
        at: usize,
        /// Contents of the headers.
        headers: Headers,
    },
    /// Ethernet frame without IP, such as ARP.
    NotIp,
    /// Bytes that claim to be a packet of IP, but contradict themselves.
    Malformed(Malformed),
}

impl Packet {
    /// Reads the headers in the bytes of a device. If the sender left a checksum to the network device, as Linux does on virtual devices, the checksum is
    /// computed.
    #[must_use]
    pub fn new(mut bytes: Vec<u8>, framing: Framing) -> Self {
        let at = match framing {
            Framing::Ip => Some(0),
            Framing::Ethernet => network_layer(&bytes),
        };
        let Some(at) = at else { return Self { bytes, content: Content::NotIp, is_checked: false } };
        let content = match Headers::read(&bytes[at..]) {
            Ok(headers) => {
                checksum::complete(&mut bytes[at..], &headers);
                Content::Ip { at, headers }
            }
            Err(malformed) => Content::Malformed(malformed),
        };
        Self { bytes, content, is_checked: false }
    }

    /// Reads the headers of a packet of IP whose maker has computed the checksums. A device may join such packets to a segment.
    #[must_use]
    pub fn checked(bytes: Vec<u8>) -> Self {
        let content = Headers::read(&bytes).map_or_else(Content::Malformed, |headers| Content::Ip { at: 0, headers });
        Self { bytes, content, is_checked: true }
    }

    /// Returns the kind of the packet, with the headers.
    #[must_use]
    pub const fn content(&self) -> &Content {
        &self.content
    }

    /// Returns all bytes, as they go to a device.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the properties that a link needs: the length of the IP packet without frame and padding, and whether the ends understand ECN.
    #[must_use]
    pub fn info(&self) -> PacketInfo {
        match &self.content {
            Content::Ip { headers, .. } => PacketInfo { size: Bytes::new(headers.length as u64), ecn: headers.ecn },
            Content::NotIp | Content::Malformed(_) => Bytes::new(self.bytes.len() as u64).into(),
        }
    }

    /// Returns the number of the packet's flow, for queues with a queue per flow. Packets that are no packets of IP are one flow.
    #[must_use]
    pub fn flow(&self) -> u32 {
        if let Content::Ip { headers, .. } = &self.content { headers.flow() } else { 0 }
    }

    /// Marks the packet with congestion (RFC 3168), unless it is no packet of IP.
    pub fn mark_congestion(&mut self) {
        if let Content::Ip { at, headers } = &mut self.content {
            headers.mark_congestion(&mut self.bytes[*at..]);
        }
    }

    /// Flips bits of the IP packet, counted from its first bit, and corrects the checksums over these bits, so that no receiver detects the damage: see
    /// [`cohaptic_wan::Checksum::Passes`]. Bits beyond the end of the packet are ignored.
    pub fn damage(&mut self, damage: &Damage) {
        // A damaged packet goes out alone and unchanged: in a segment its checksum would be computed anew.
        self.is_checked = false;
        if let Content::Ip { at, headers } = &self.content {
            let end = at + headers.length;
            apply(&mut self.bytes[*at..end], headers, damage);
        }
    }
}

/// Types of VLAN tags (IEEE 802.1Q) in Ethernet frames (IEEE 802.3).
const TAGGED: [u16; 2] = [0x8100, 0x88a8];
const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86dd;

/// Bytes of the two addresses at the beginning of a frame.
const ADDRESSES: usize = 12;

/// Tags in a frame, at most: providers use a tag within a tag, and nothing deeper is in use.
const MOST_TAGS: usize = 2;

/// Returns the index of the first byte of the IP header, or `None` if the frame carries something else.
fn network_layer(frame: &[u8]) -> Option<usize> {
    let mut at = ADDRESSES;
    for _ in 0..=MOST_TAGS {
        let kind = u16::from_be_bytes([*frame.get(at)?, *frame.get(at + 1)?]);
        at += 2;
        match kind {
            IPV4 | IPV6 => return Some(at),
            // After the type of a tag come two bytes of the tag, then the next type.
            kind if TAGGED.contains(&kind) => at += 2,
            _ => return None,
        }
    }
    None
}

/// Flips bits of a packet. A right checksum is right afterwards, and a wrong checksum is as wrong as before; a flipped bit of a checksum is therefore flipped
/// back.
///
/// Of a header only the checksum is corrected: a packet with damaged addresses goes to the new addresses. A later fragment has no checksum to correct.
fn apply(packet: &mut [u8], headers: &Headers, damage: &Damage) {
    let covered = headers.covered;
    let is_v4 = headers.source.is_ipv4();
    let field = transport_field(packet, headers);
    // Without a transport header the sum covers no bytes.
    let begin = headers.transport.unwrap_or(packet.len());
    // The addresses belong to the pseudo-header, which the checksum of the transport protocol covers.
    let addresses = if is_v4 { 12..20 } else { 8..40 };
    let of_transport = |packet: &[u8]| [sum(&packet[addresses.clone()]), sum(&packet[begin..])];
    // Sums before and after the damage are enough to correct a checksum: see `checksum::change`.
    let before = (sum(&packet[..covered]), of_transport(packet));
    damage.apply(packet);
    if is_v4 {
        let now = sum(&packet[..covered]);
        change(packet, V4_CHECKSUM, before.0, now);
    }
    if let Some(field) = field {
        let now = of_transport(packet);
        // The checksum of ICMP for IPv4 has no pseudo-header.
        if headers.protocol != Protocol::ICMP {
            change(packet, field, before.1[0], now[0]);
        }
        change(packet, field, before.1[1], now[1]);
        // Zero would mean that the datagram has no checksum. In ones' complement, all ones are equal to zero.
        if headers.protocol == Protocol::UDP && packet[field..field + 2] == [0, 0] {
            packet[field..field + 2].fill(0xff);
        }
    }
}

#[cfg(test)]
mod tests {
    use etherparse::{EtherType, PacketBuilder, VlanId};

    use super::*;

    fn frame(tags: u8) -> Vec<u8> {
        let builder = PacketBuilder::ethernet2([2, 0, 0, 0, 0, 1], [2, 0, 0, 0, 0, 2]);
        let mut frame = Vec::new();
        let vlan = VlanId::try_new(7).unwrap();
        match tags {
            0 => builder.ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).udp(1, 2).write(&mut frame, &[]).unwrap(),
            1 => builder.single_vlan(vlan).ipv6([1; 16], [2; 16], 64).udp(1, 2).write(&mut frame, &[]).unwrap(),
            _ => builder.double_vlan(vlan, vlan).ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).udp(1, 2).write(&mut frame, &[]).unwrap(),
        }
        frame
    }

    /// Each part of the address makes another flow, in both directions and versions; fragments of one packet are one flow, whatever their ports.
    #[test]
    fn flows_differ_by_each_part_of_their_address() {
        let of = |builder: etherparse::PacketBuilderStep<etherparse::UdpHeader>| {
            let mut bytes = Vec::new();
            builder.write(&mut bytes, b"data").unwrap();
            bytes
        };
        let flow = |bytes: Vec<u8>| Packet::new(bytes, Framing::Ip).flow();
        let v4 =
            |source, destination, ports: (u16, u16)| of(PacketBuilder::ipv4([10, 0, 0, source], [10, 0, 0, destination], 64).udp(ports.0, ports.1));
        let v6 = |source, destination, ports: (u16, u16)| of(PacketBuilder::ipv6([source; 16], [destination; 16], 64).udp(ports.0, ports.1));
        let mut tcp = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).tcp(1, 2, 0, 0).write(&mut tcp, b"data").unwrap();
        let all = [
            flow(v4(1, 2, (1, 2))),
            flow(v4(2, 1, (2, 1))),
            flow(v4(1, 3, (1, 2))),
            flow(v4(1, 2, (1, 3))),
            flow(v4(1, 2, (3, 2))),
            flow(v6(1, 2, (1, 2))),
            flow(v6(2, 1, (2, 1))),
            flow(tcp),
            flow(vec![0; 30]),
        ];
        assert!(all.iter().enumerate().all(|(place, flow)| all[..place].iter().all(|other| other != flow)), "{all:?}");
        let fragment = |ports, more: u8, offset: u8| {
            let mut bytes = v4(1, 2, ports);
            (bytes[6], bytes[7]) = (more << 5, offset);
            flow(bytes)
        };
        assert_eq!(fragment((1, 2), 1, 0), fragment((77, 88), 0, 9));
        assert_ne!(fragment((1, 2), 1, 0), all[0]);
    }

    #[test]
    fn packets_are_found_behind_tags() {
        assert_eq!([0, 1, 2].map(|tags| network_layer(&frame(tags))), [Some(14), Some(18), Some(22)]);
    }

    #[test]
    fn what_carries_no_packet_is_told() {
        let mut arp = frame(0);
        arp[12..14].copy_from_slice(&EtherType::ARP.0.to_be_bytes());
        assert_eq!(network_layer(&arp), None);
        for length in 0..14 {
            assert_eq!(network_layer(&frame(0)[..length]), None);
        }
        let mut tags = vec![0; 12];
        tags.extend([0x81, 0x00, 0, 7].repeat(9));
        assert_eq!(network_layer(&tags), None);
    }
}
