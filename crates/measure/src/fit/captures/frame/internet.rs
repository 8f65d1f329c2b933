//! Headers of IPv4 (RFC 791), and of IPv6 with extension headers (RFC 8200).

use super::{CUT, Kind, half};

/// A UDP datagram inside a packet.
pub(super) struct Carried<'a> {
    /// Identification of the IPv4 header; `None` for IPv6.
    pub(super) identification: Option<u16>,
    /// Captured part of the datagram, from its header on.
    pub(super) udp: &'a [u8],
    /// Length of the datagram according to IP \[byte\]; `None` if IP says zero.
    pub(super) length: Option<usize>,
}

/// Finds the UDP datagram in an IP packet.
pub(super) fn carried(packet: &[u8]) -> Result<Carried<'_>, Kind> {
    match packet.first().ok_or(CUT)? >> 4 {
        4 => ipv4(packet),
        6 => {
            let header = packet.first_chunk::<40>().ok_or(CUT)?;
            let payload = usize::from(half(header, 4).unwrap_or(0));
            let (udp, passed) = upper_layer(header[6], &packet[40..], true)?;
            Ok(Carried { identification: None, udp, length: payload.checked_sub(passed).filter(|length| *length > 0) })
        }
        _ => Err("no IP".into()),
    }
}

fn ipv4(packet: &[u8]) -> Result<Carried<'_>, Kind> {
    let header = packet.first_chunk::<20>().ok_or(CUT)?;
    let octets = usize::from(header[0] & 0xF) * 4;
    if octets < 20 {
        return Err("malformed IPv4".into());
    }
    // Refuses the first of several fragments (flag "more fragments") and later fragments (offset).
    if half(header, 6).is_none_or(|fragment| fragment & 0x3FFF != 0) {
        return Err("fragments of IPv4".into());
    }
    let total = usize::from(half(header, 2).unwrap_or(0));
    let (udp, passed) = upper_layer(header[9], packet.get(octets..).ok_or(CUT)?, false)?;
    Ok(Carried { identification: half(header, 4), udp, length: total.checked_sub(octets + passed).filter(|length| *length > 0) })
}

/// Skips extension headers up to UDP. Returns the datagram and the number of skipped octets.
fn upper_layer(mut next: u8, all: &[u8], has_extensions: bool) -> Result<(&[u8], usize), Kind> {
    let mut rest = all;
    loop {
        let octets = match next {
            17 => return Ok((rest, all.len() - rest.len())),
            // Hop by hop, routing, destination, mobility, host identity, shim: the second octet counts units of 8 octets after the first 8.
            0 | 43 | 60 | 135 | 139 | 140 if has_extensions => (usize::from(*rest.get(1).ok_or(CUT)?) + 1) * 8,
            44 if has_extensions => {
                // A whole packet with a fragment header has offset and "more" zero (RFC 6946).
                if half(rest, 2).ok_or(CUT)? & 0xFFF9 != 0 {
                    return Err("fragments of IPv6".into());
                }
                8
            }
            // Authentication: the second octet counts units of 4 octets after the first 8.
            51 => (usize::from(*rest.get(1).ok_or(CUT)?) + 2) * 4,
            other => return Err(protocol_name(other)),
        };
        next = *rest.first().ok_or(CUT)?;
        rest = rest.get(octets..).ok_or(CUT)?;
    }
}

fn protocol_name(protocol: u8) -> Kind {
    match protocol {
        1 => "ICMP".into(),
        2 => "IGMP".into(),
        4 => "IPv4 in IP".into(),
        6 => "TCP".into(),
        41 => "IPv6 in IP".into(),
        47 => "GRE".into(),
        50 => "ESP".into(),
        58 => "ICMPv6".into(),
        59 => "IPv6 without a payload".into(),
        89 => "OSPF".into(),
        115 => "L2TP".into(),
        132 => "SCTP".into(),
        136 => "UDP-Lite".into(),
        other => format!("IP protocol {other}").into(),
    }
}
