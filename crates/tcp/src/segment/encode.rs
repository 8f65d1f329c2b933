//! Writing of a segment to the octets of an IP packet.

use alloc::vec::Vec;
use core::net::{IpAddr, SocketAddr};

use super::Segment;
use super::checksum::Sum;

/// Length of an IPv4 header without options \[byte\].
pub(crate) const IPV4_HEADER: usize = 20;
/// Length of an IPv6 header without extension headers \[byte\].
pub(crate) const IPV6_HEADER: usize = 40;
/// Length of a TCP header without options \[byte\].
pub(crate) const TCP_HEADER: usize = 20;
/// Protocol number of TCP in the IP header.
pub(super) const TCP: u8 = 6;

impl Segment<'_> {
    /// Returns the IP packet (RFC 791 or 8200, and RFC 9293) of the segment, with correct checksums.
    ///
    /// # Panics
    ///
    /// If the two addresses have different IP versions, or a length does not fit into 16 bits: an IPv4 packet, or the part of an IPv6 packet after the header,
    /// longer than 65,535 octets.
    #[must_use]
    pub fn to_packet(&self) -> Vec<u8> {
        let mut packet = Vec::with_capacity(self.packet_length());
        let length = self.packet_length();
        let sum = match (self.source.ip(), self.destination.ip()) {
            (IpAddr::V4(from), IpAddr::V4(to)) => {
                let length = u16::try_from(length).expect("a packet has at most 65,535 octets").to_be_bytes();
                // The flag "don't fragment" is set, so that the identification has no meaning and may be zero (RFC 6864).
                packet.extend([0x45, self.ecn.bits(), length[0], length[1], 0, 0, 0x40, 0, self.ttl, TCP, 0, 0]);
                packet.extend(from.octets());
                packet.extend(to.octets());
                let checksum = Sum::default().add(&packet).finish();
                packet[10..12].copy_from_slice(&checksum.to_be_bytes());
                Sum::default().add(&from.octets()).add(&to.octets())
            }
            (IpAddr::V6(from), IpAddr::V6(to)) => {
                let length = u16::try_from(length - IPV6_HEADER).expect("a packet has at most 65,535 octets").to_be_bytes();
                packet.extend([0x60, self.ecn.bits() << 4, 0, 0, length[0], length[1], TCP, self.ttl]);
                packet.extend(from.octets());
                packet.extend(to.octets());
                Sum::default().add(&from.octets()).add(&to.octets())
            }
            (IpAddr::V4(_), IpAddr::V6(_)) | (IpAddr::V6(_), IpAddr::V4(_)) => unreachable!("addresses of two versions on one segment"),
        };
        let start = packet.len();
        self.write_tcp(&mut packet);
        let checksum = sum.add_word(pseudo(packet.len() - start)).add(&packet[start..]).finish();
        packet[start + 16..start + 18].copy_from_slice(&checksum.to_be_bytes());
        packet
    }

    /// Appends the TCP header, with a checksum and an urgent pointer of zero, the options and the data.
    fn write_tcp(&self, packet: &mut Vec<u8>) {
        let words = u8::try_from((TCP_HEADER + self.options.length()) / 4).unwrap_or(15);
        for port in [&self.source, &self.destination].map(SocketAddr::port) {
            packet.extend(port.to_be_bytes());
        }
        packet.extend(self.sequence.to_be_bytes());
        packet.extend(self.acknowledgement.to_be_bytes());
        packet.extend([words << 4, self.flags.bits()]);
        packet.extend(self.window.to_be_bytes());
        packet.extend([0; 4]);
        self.options.write(packet);
        packet.extend_from_slice(&self.payload);
    }
}

/// Returns the sum of the length and the protocol in the pseudo header. Both IP versions place the fields differently, but the sum is the same.
pub(super) fn pseudo(tcp_length: usize) -> u64 {
    u64::try_from(tcp_length).unwrap_or(0) + u64::from(TCP)
}
