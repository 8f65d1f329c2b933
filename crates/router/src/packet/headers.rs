//! The headers of IPv4 (RFC 791) and IPv6 (RFC 8200), just far enough to tell one packet from another.

use core::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use cohaptic_linkfile::router::Protocol;

use super::checksum;

/// What the headers of a packet say.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Headers {
    /// Where the packet comes from.
    pub source: IpAddr,
    /// Where it goes to.
    pub destination: IpAddr,
    /// What it carries, behind all extension headers.
    pub protocol: Protocol,
    /// The ports of source and destination, if it is TCP or UDP and they are in this packet: of a packet that was cut into fragments they are in the
    /// first alone.
    pub ports: Option<[u16; 2]>,
    /// What it says of congestion.
    pub ecn: Ecn,
    /// The bytes of the fixed header and, with IPv4, its options: what its checksum covers.
    pub(super) covered: usize,
    /// Where the header of the transport protocol begins; `None` if it is not in this packet.
    pub(super) transport: Option<usize>,
    /// Whether it is no fragment.
    pub(super) is_whole: bool,
    /// The bytes of the packet, at most as many as were read.
    pub length: usize,
}

/// Why the bytes are no packet.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Malformed {
    /// There is no whole header.
    Short,
    /// Neither version 4 nor 6.
    Version,
    /// The header says that it is longer than the packet, or shorter than any.
    HeaderLength,
    /// The packet says that it is longer than what came, or shorter than its header.
    Length,
    /// The device says of it what it is not: a segment of another protocol or length, a checksum that is not in it.
    Offload,
}

/// What a packet says of congestion (RFC 3168): the two bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ecn(u8);

impl Ecn {
    /// Congestion experienced.
    pub(crate) const CONGESTION: Self = Self(0b11);

    /// Whether both ends understand it: any codepoint but 00.
    #[must_use]
    pub const fn is_capable(self) -> bool {
        self.0 != 0
    }

    /// The two bits.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }
}

impl Headers {
    /// Reads them. Bytes beyond the length that the packet says it has are padding.
    ///
    /// # Errors
    ///
    /// [`Malformed`]. Extension headers that are cut off are no error: the protocol is then that of the first one that is not whole.
    pub fn read(bytes: &[u8]) -> Result<Self, Malformed> {
        match bytes.first().map(|byte| byte >> 4) {
            None => Err(Malformed::Short),
            Some(4) => read_v4(bytes),
            Some(6) => read_v6(bytes),
            Some(_) => Err(Malformed::Version),
        }
    }

    /// Sets both bits in the bytes that were read.
    pub(super) fn mark_congestion(&mut self, bytes: &mut [u8]) {
        match self.source {
            IpAddr::V4(_) => {
                let before = [bytes[0], bytes[1]];
                bytes[1] |= Ecn::CONGESTION.0;
                checksum::change(bytes, V4_CHECKSUM, u16::from_be_bytes(before), u16::from_be_bytes([bytes[0], bytes[1]]));
            }
            // The traffic class lies across two bytes: its lowest bits are the middle of the second.
            IpAddr::V6(_) => bytes[1] |= Ecn::CONGESTION.0 << 4,
        }
        self.ecn = Ecn::CONGESTION;
    }
}

/// Where the checksum stands in a header of IPv4.
pub(super) const V4_CHECKSUM: usize = 10;

fn read_v4(bytes: &[u8]) -> Result<Headers, Malformed> {
    let fixed: &[u8; 20] = bytes.first_chunk().ok_or(Malformed::Short)?;
    let header = usize::from(fixed[0] & 0xf) * 4;
    let length = usize::from(u16::from_be_bytes([fixed[2], fixed[3]]));
    if header < fixed.len() || header > bytes.len() {
        return Err(Malformed::HeaderLength);
    }
    if length < header || length > bytes.len() {
        return Err(Malformed::Length);
    }
    let fragment = u16::from_be_bytes([fixed[6], fixed[7]]);
    // 13 bits of offset; the bit above says that more follow.
    let (offset, more) = (fragment & 0x1fff, fragment & 0x2000 != 0);
    let protocol = Protocol(fixed[9]);
    let transport = (offset == 0).then_some(header);
    Ok(Headers {
        source: Ipv4Addr::new(fixed[12], fixed[13], fixed[14], fixed[15]).into(),
        destination: Ipv4Addr::new(fixed[16], fixed[17], fixed[18], fixed[19]).into(),
        protocol,
        ports: transport.and_then(|at| ports(&bytes[..length], protocol, at)),
        ecn: Ecn(fixed[1] & 0b11),
        covered: header,
        transport,
        is_whole: offset == 0 && !more,
        length,
    })
}

fn read_v6(bytes: &[u8]) -> Result<Headers, Malformed> {
    const FIXED: usize = 40;
    let fixed: &[u8; FIXED] = bytes.first_chunk().ok_or(Malformed::Short)?;
    let length = FIXED + usize::from(u16::from_be_bytes([fixed[4], fixed[5]]));
    if length > bytes.len() {
        return Err(Malformed::Length);
    }
    let address = |at: usize| Ipv6Addr::from(core::array::from_fn::<u8, 16, _>(|index| fixed[at + index])).into();
    let found = walk(&bytes[..length], fixed[6], FIXED);
    Ok(Headers {
        source: address(8),
        destination: address(24),
        protocol: found.protocol,
        ports: found.at.and_then(|at| ports(&bytes[..length], found.protocol, at)),
        ecn: Ecn(fixed[1] >> 4 & 0b11),
        covered: FIXED,
        transport: found.at,
        is_whole: found.whole,
        length,
    })
}

/// What stands behind the extension headers.
struct Found {
    protocol: Protocol,
    at: Option<usize>,
    whole: bool,
}

/// Goes from one extension header to the next (RFC 8200, section 4; RFC 4302; RFC 6564).
fn walk(packet: &[u8], first: u8, begin: usize) -> Found {
    const FRAGMENT: u8 = 44;
    const AUTHENTICATION: u8 = 51;
    let (mut next, mut at, mut whole) = (first, begin, true);
    loop {
        let unit = match next {
            // Hop-by-hop, routing, destination options, mobility, host identity, shim6.
            0 | 43 | 60 | 135 | 139 | 140 => 8,
            FRAGMENT | AUTHENTICATION => 4,
            _ => return Found { protocol: Protocol(next), at: Some(at), whole },
        };
        let Some(&[following, size, high, low]) = packet.get(at..).and_then(|rest| rest.first_chunk()) else { break };
        let length = match next {
            FRAGMENT => 8,
            AUTHENTICATION => (usize::from(size) + 2) * unit,
            _ => (usize::from(size) + 1) * unit,
        };
        if at + length > packet.len() {
            break;
        }
        if next == FRAGMENT {
            let fragment = u16::from_be_bytes([high, low]);
            whole = whole && fragment & !0b110 == 0;
            if fragment >> 3 != 0 {
                return Found { protocol: Protocol(following), at: None, whole };
            }
        }
        (next, at) = (following, at + length);
    }
    Found { protocol: Protocol(next), at: None, whole }
}

fn ports(packet: &[u8], protocol: Protocol, at: usize) -> Option<[u16; 2]> {
    if !protocol.has_ports() {
        return None;
    }
    let bytes: &[u8; 4] = packet.get(at..)?.first_chunk()?;
    Some([u16::from_be_bytes([bytes[0], bytes[1]]), u16::from_be_bytes([bytes[2], bytes[3]])])
}
