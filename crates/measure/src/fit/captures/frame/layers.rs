//! Headers between the header of a link and IP: 802.2, tags of VLANs, MPLS, PPP.

use super::{CUT, Kind, half};

const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86DD;

/// Returns the octets after an Ethernet type. Skips tags of VLANs and labels of MPLS.
pub(super) fn by_type(mut ether_type: u16, mut rest: &[u8]) -> Result<&[u8], Kind> {
    loop {
        match ether_type {
            IPV4 | IPV6 => return Ok(rest),
            // 802.1Q, 802.1ad, and the older tag of nested VLANs.
            0x8100 | 0x88A8 | 0x9100 => {
                ether_type = half(rest, 2).ok_or(CUT)?;
                rest = &rest[4..];
            }
            0x8847 | 0x8848 => return mpls(rest),
            0x8864 => return pppoe(rest),
            // Below 1536 the number is a length, and the type stands in a header of 802.2.
            0..0x0600 => (ether_type, rest) = type_of_llc(rest)?,
            other => return Err(ether_type_name(other)),
        }
    }
}

/// Returns the octets after a header of 802.2.
pub(super) fn llc(rest: &[u8]) -> Result<&[u8], Kind> {
    let (ether_type, rest) = type_of_llc(rest)?;
    by_type(ether_type, rest)
}

/// Returns the Ethernet type in a header of 802.2 (RFC 1042), and the octets after the header.
fn type_of_llc(rest: &[u8]) -> Result<(u16, &[u8]), Kind> {
    match rest {
        [0xAA, 0xAA, 3, 0, 0, 0 | 0xF8, high, low, rest @ ..] => Ok((u16::from_be_bytes([*high, *low]), rest)),
        [0x06, 0x06, 3, rest @ ..] => Ok((IPV4, rest)),
        [_, _, _, ..] => Err("802.2".into()),
        _ => Err(CUT),
    }
}

/// Skips labels of MPLS (RFC 3032). The last label has the bit "bottom of stack".
fn mpls(mut rest: &[u8]) -> Result<&[u8], Kind> {
    loop {
        let (label, after) = rest.split_first_chunk::<4>().ok_or(CUT)?;
        rest = after;
        if label[2] & 1 != 0 {
            // Labels do not name their content; the first octet shows IPv4 or IPv6.
            return if matches!(rest.first(), Some(0x40..=0x6F)) { Ok(rest) } else { Err("MPLS without IP".into()) };
        }
    }
}

/// Skips the header of a PPPoE session (RFC 2516), 6 octets, and then PPP.
pub(super) fn pppoe(rest: &[u8]) -> Result<&[u8], Kind> {
    if *rest.get(1).ok_or(CUT)? != 0 { Err("PPPoE discovery".into()) } else { ppp(rest.get(6..).ok_or(CUT)?) }
}

/// Skips the header of PPP (RFC 1661), with or without the address and control field of HDLC (RFC 1662).
pub(super) fn ppp(frame: &[u8]) -> Result<&[u8], Kind> {
    let frame = frame.strip_prefix(&[0xFF, 0x03]).unwrap_or(frame);
    let (protocol, rest) = match frame {
        // The last octet of a protocol number is odd and the others are even, which shows a compressed number.
        [low, rest @ ..] if low & 1 != 0 => (u16::from(*low), rest),
        [high, low, rest @ ..] => (u16::from_be_bytes([*high, *low]), rest),
        _ => return Err(CUT),
    };
    match protocol {
        0x0021 | 0x0057 => Ok(rest),
        0x0281 | 0x0283 => mpls(rest),
        other => Err(format!("PPP protocol 0x{other:04x}").into()),
    }
}

fn ether_type_name(ether_type: u16) -> Kind {
    match ether_type {
        0x0806 => "ARP".into(),
        0x8863 => "PPPoE discovery".into(),
        0x888E => "EAPOL".into(),
        0x88CC => "LLDP".into(),
        0x88E5 => "MACsec".into(),
        0x88F7 => "PTP".into(),
        other => format!("Ethernet type 0x{other:04x}").into(),
    }
}
