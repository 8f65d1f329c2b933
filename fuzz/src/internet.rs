//! Checksums and lengths of IP, TCP and UDP, computed apart from the crates that are tested.

/// Where the transport header of a packet begins, and its protocol, if the packet is IPv4 without options that are cut off, or IPv6 without extension headers.
fn layout(packet: &[u8]) -> Option<(usize, u8)> {
    match packet.first()? >> 4 {
        4 => {
            let header = usize::from(packet[0] & 15) * 4;
            (header >= 20 && packet.len() >= header).then_some((header, *packet.get(9)?))
        }
        6 if packet.len() >= 40 => Some((40, packet[6])),
        _ => None,
    }
}

/// Where the checksum of TCP or UDP stands, if the packet is no fragment and holds it.
fn field(packet: &[u8], transport: usize, protocol: u8) -> Option<usize> {
    let is_fragment = packet[0] >> 4 == 4 && (packet[6] & 0x3f != 0 || packet[7] != 0);
    let at = transport
        + match protocol {
            6 => 16,
            17 => 6,
            _ => return None,
        };
    (!is_fragment && packet.len() >= at + 2).then_some(at)
}

/// The ones' complement sum of 16-bit words (RFC 1071).
fn sum(parts: &[&[u8]]) -> u16 {
    let words = parts.iter().flat_map(|part| part.chunks(2)).map(|pair| u64::from(u16::from_be_bytes([pair[0], pair.get(1).copied().unwrap_or(0)])));
    let mut sum: u64 = words.sum();
    while sum > 0xffff {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    u16::try_from(sum).unwrap()
}

/// The sum of the addresses, the protocol and the length of the segment.
fn pseudo(packet: &[u8], transport: usize, protocol: u8) -> u16 {
    let addresses = if packet[0] >> 4 == 4 { &packet[12..20] } else { &packet[8..40] };
    let length = u32::try_from(packet.len() - transport).unwrap();
    sum(&[addresses, &[0, protocol], &length.to_be_bytes()])
}

/// Makes the lengths those of the packet, and the checksums right. With `is_offloaded` the field of the transport holds the sum of the pseudo-header alone.
/// A packet of other protocols stays as it is but for the header of IP.
pub(crate) fn repair(packet: &mut [u8], is_offloaded: bool) {
    let Some((transport, protocol)) = layout(packet) else { return };
    let Ok(length) = u16::try_from(packet.len()) else { return };
    if packet[0] >> 4 == 4 {
        packet[2..4].copy_from_slice(&length.to_be_bytes());
        packet[10..12].fill(0);
        let checksum = !sum(&[&packet[..transport]]);
        packet[10..12].copy_from_slice(&checksum.to_be_bytes());
    } else {
        packet[4..6].copy_from_slice(&(length - 40).to_be_bytes());
    }
    let Some(field) = field(packet, transport, protocol) else { return };
    if protocol == 17 {
        let length = u16::try_from(packet.len() - transport).unwrap();
        packet[transport + 4..transport + 6].copy_from_slice(&length.to_be_bytes());
    }
    let pseudo = pseudo(packet, transport, protocol);
    packet[field..field + 2].copy_from_slice(&pseudo.to_be_bytes());
    if !is_offloaded {
        let checksum = match !sum(&[&packet[transport..]]) {
            // UDP says by zero that there is no checksum.
            0 if protocol == 17 => 0xffff,
            checksum => checksum,
        };
        packet[field..field + 2].copy_from_slice(&checksum.to_be_bytes());
    }
}

/// Returns whether the checksums of IPv4, TCP and UDP are right, as far as the packet has any.
pub(crate) fn is_right(packet: &[u8]) -> bool {
    let Some((transport, protocol)) = layout(packet) else { return true };
    if packet[0] >> 4 == 4 && sum(&[&packet[..transport]]) != 0xffff {
        return false;
    }
    let Some(field) = field(packet, transport, protocol) else { return true };
    if protocol == 17 && packet[field..field + 2] == [0, 0] {
        return true;
    }
    sum(&[&pseudo(packet, transport, protocol).to_be_bytes(), &packet[transport..]]) == 0xffff
}
