//! The checksum of the Internet protocols (RFC 1071), and its correction after a change (RFC 1624).

use core::net::IpAddr;

use cohaptic_linkfile::router::Protocol;

use super::Headers;

/// Returns the ones' complement sum of all 16-bit words, folded to 16 bits. An odd last byte is the high byte of its word.
pub(super) fn sum(bytes: &[u8]) -> u16 {
    let (words, rest) = bytes.as_chunks::<4>();
    // The words are added in the byte order of the machine, two at a time. The sum then has its bytes swapped and is right otherwise (RFC 1071, section 2).
    let whole: u64 = words.iter().map(|word| u64::from(u32::from_ne_bytes(*word))).sum();
    let (words, odd) = rest.as_chunks::<2>();
    let rest: u64 = words.iter().map(|word| u64::from(u16::from_be_bytes(*word))).sum();
    fold(u64::from(u16::from_be(fold(whole))) + rest + odd.first().map_or(0, |byte| u64::from(*byte) << 8))
}

/// Adds the carries above 16 bits to the lower 16 bits until no carry is left.
pub(super) fn fold(mut sum: u64) -> u16 {
    while sum > 0xffff {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    u16::try_from(sum).unwrap_or(u16::MAX)
}

/// Corrects the checksum at index `at` after a word, or a sum of words, has changed from `old` to `new`: HC' = ~(~HC + ~m + m') (RFC 1624, equation 3).
pub(super) fn change(bytes: &mut [u8], at: usize, old: u16, new: u16) {
    let Some(field) = bytes.get_mut(at..).and_then(|rest| rest.first_chunk_mut::<2>()) else { return };
    let before = u16::from_be_bytes(*field);
    *field = (!fold(u64::from(!before) + u64::from(!old) + u64::from(new))).to_be_bytes();
}

/// Returns the index of the transport protocol's checksum in the packet, or `None` if the protocol has no known checksum or the field is not in this packet.
pub(super) fn transport_field(packet: &[u8], headers: &Headers) -> Option<usize> {
    let at = headers.transport? + offset(headers.protocol)?;
    let field: &[u8; 2] = packet.get(at..headers.length)?.first_chunk()?;
    // A zero means UDP without a checksum (RFC 768).
    (headers.protocol != Protocol::UDP || *field != [0, 0]).then_some(at)
}

/// Returns the index of the checksum in the header of a transport protocol.
pub(super) fn offset(protocol: Protocol) -> Option<usize> {
    match protocol {
        Protocol::TCP => Some(16),
        Protocol::UDP => Some(6),
        Protocol::ICMP | Protocol::ICMPV6 => Some(2),
        _ => None,
    }
}

/// Computes the checksum of TCP or UDP if the sender left the computation to its network device.
///
/// Linux then leaves the sum of the pseudo-header in the field. A packet whose right checksum happens to equal that sum gets the same checksum again, so the
/// two cases need no distinction.
pub(super) fn complete(packet: &mut [u8], headers: &Headers) {
    if !headers.is_whole || !headers.protocol.has_ports() {
        return;
    }
    let (Some(begin), Some(field)) = (headers.transport, transport_field(packet, headers)) else { return };
    let pseudo = pseudo_header(headers, begin);
    if u16::from_be_bytes([packet[field], packet[field + 1]]) != pseudo {
        return;
    }
    // The field holds the sum of the pseudo-header, so the sum over the segment includes the pseudo-header.
    let checksum = of_sum(headers.protocol, sum(&packet[begin..headers.length]));
    packet[field..field + 2].copy_from_slice(&checksum.to_be_bytes());
}

/// Returns the checksum of bytes with the sum `sum`.
pub(super) const fn of_sum(protocol: Protocol, sum: u16) -> u16 {
    match !sum {
        // Zero would mean that the datagram has no checksum.
        0 if protocol.0 == Protocol::UDP.0 => 0xffff,
        checksum => checksum,
    }
}

/// Returns the sum of addresses, protocol and length of the pseudo-header (RFC 9293, section 3.1; RFC 8200, section 8.1). The transport header begins at
/// `begin`.
pub(super) fn pseudo_header(headers: &Headers, begin: usize) -> u16 {
    let address = |address| match address {
        IpAddr::V4(address) => sum(&address.octets()),
        IpAddr::V6(address) => sum(&address.octets()),
    };
    let length = (headers.length - begin) as u64;
    fold(u64::from(address(headers.source)) + u64::from(address(headers.destination)) + u64::from(headers.protocol.0) + length)
}
