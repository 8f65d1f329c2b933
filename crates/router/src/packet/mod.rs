//! Packets: as much of their headers as it takes to choose a link, and what a link may do to their bytes.
//!
//! ```text
//!   frame  │ Ethernet, VLAN tags │ IPv4 or IPv6 header, extensions │ ports … │ data │ padding │
//!          0                     ip                                transport        end
//! ```
//!
//! Nothing here believes what a packet says of itself: any bytes are read without a panic, and what makes no sense is [`Content::Malformed`].

mod checksum;
mod headers;
mod segments;

use cohaptic_linkfile::router::Protocol;
use cohaptic_units::Bytes;
use cohaptic_wan::{Damage, PacketInfo};

use checksum::{change, sum, transport_field};
use headers::V4_CHECKSUM;

pub use headers::{Ecn, Headers, Malformed};
pub(crate) use segments::{Join, cut, join, slices};

/// How the bytes of a device are framed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Framing {
    /// Packets of IP, as from a TUN device.
    Ip,
    /// Frames of Ethernet.
    Ethernet,
}

/// A packet on its way, with all its bytes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Packet {
    bytes: Vec<u8>,
    content: Content,
    /// Whether the checksum of TCP or UDP is known to be right, by the word of the device that gave the packet.
    is_checked: bool,
}

/// What a packet is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Content {
    /// A packet of IP that begins at this byte.
    Ip {
        /// Its first byte.
        at: usize,
        /// What its headers say.
        headers: Headers,
    },
    /// A frame of Ethernet that carries something else, such as ARP.
    NotIp,
    /// It says that it is a packet of IP and is none.
    Malformed(Malformed),
}

impl Packet {
    /// Reads the headers of what a device gave. A checksum that the sender left to its network device, as Linux does on virtual devices, is computed.
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

    /// What it is.
    #[must_use]
    pub const fn content(&self) -> &Content {
        &self.content
    }

    /// All its bytes, as they go to a device.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// What a link needs to know of it: the length of the packet of IP, without frame and padding, and whether its ends understand ECN.
    #[must_use]
    pub fn info(&self) -> PacketInfo {
        match &self.content {
            Content::Ip { headers, .. } => PacketInfo { size: Bytes::new(headers.length as u64), ecn_capable: headers.ecn.is_capable() },
            Content::NotIp | Content::Malformed(_) => Bytes::new(self.bytes.len() as u64).into(),
        }
    }

    /// Says in its header that there was congestion (RFC 3168).
    pub fn mark_congestion(&mut self) {
        if let Content::Ip { at, headers } = &mut self.content {
            headers.mark_congestion(&mut self.bytes[*at..]);
        }
    }

    /// Flips bits of the packet of IP, counted from its first, and sets right the checksums that cover them, so that the damage is not found: see
    /// [`cohaptic_wan::Checksum::Passes`]. Bits beyond the end of the packet are left out.
    pub fn damage(&mut self, damage: &Damage) {
        // What was damaged goes out as it is, and alone: in a segment its checksum would be computed anew.
        self.is_checked = false;
        if let Content::Ip { at, headers } = &self.content {
            let end = at + headers.length;
            apply(&mut self.bytes[*at..end], headers, damage);
        }
    }
}

/// The tags of VLANs (IEEE 802.1Q) in frames of Ethernet (IEEE 802.3).
const TAGGED: [u16; 2] = [0x8100, 0x88a8];
const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86dd;

/// Two addresses of six bytes.
const ADDRESSES: usize = 12;

/// A tag within a tag is what providers use; more are not in use.
const MOST_TAGS: usize = 2;

/// Where the packet of IP begins; `None` if the frame carries something else.
fn network_layer(frame: &[u8]) -> Option<usize> {
    let mut at = ADDRESSES;
    for _ in 0..=MOST_TAGS {
        let kind = u16::from_be_bytes([*frame.get(at)?, *frame.get(at + 1)?]);
        at += 2;
        match kind {
            IPV4 | IPV6 => return Some(at),
            // The tag itself, and then the kind again.
            kind if TAGGED.contains(&kind) => at += 2,
            _ => return None,
        }
    }
    None
}

/// Flips the bits of a packet. A checksum that was right is right afterwards, and one that was wrong is as wrong as before: a flipped bit of a checksum is
/// therefore flipped back.
///
/// Of a header the checksum is set right and nothing else: a packet whose addresses were hit goes where they say now. A fragment that is not the first
/// has no checksum that could be set right.
fn apply(packet: &mut [u8], headers: &Headers, damage: &Damage) {
    let covered = headers.covered;
    let is_v4 = headers.source.is_ipv4();
    let field = transport_field(packet, headers);
    let begin = headers.transport.unwrap_or(packet.len());
    // The addresses are part of the pseudo-header.
    let addresses = if is_v4 { 12..20 } else { 8..40 };
    let of_transport = |packet: &[u8]| [sum(&packet[addresses.clone()]), sum(&packet[begin..])];
    let before = (sum(&packet[..covered]), of_transport(packet));
    damage.apply(packet);
    if is_v4 {
        let now = sum(&packet[..covered]);
        change(packet, V4_CHECKSUM, before.0, now);
    }
    if let Some(field) = field {
        let now = of_transport(packet);
        if headers.protocol != Protocol::ICMP {
            change(packet, field, before.1[0], now[0]);
        }
        change(packet, field, before.1[1], now[1]);
        // Zero would say that there is no checksum; both are zero in ones' complement.
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
