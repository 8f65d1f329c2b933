//! Headers of IPv4 (RFC 791) and IPv6 (RFC 8200), read just far enough for the rules of a router and for checksums.

use core::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use cohaptic_linkfile::router::Protocol;
use cohaptic_units::Ecn;
use cohaptic_wan::flow_number;

use super::checksum;

/// Contents of a packet's headers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Headers {
    /// Address of the sender.
    pub source: IpAddr,
    /// Address of the receiver.
    pub destination: IpAddr,
    /// Protocol after all extension headers.
    pub protocol: Protocol,
    /// Ports of source and destination, or `None` if the protocol is neither TCP nor UDP or the ports are not in this packet. Of a fragmented packet, only the
    /// first fragment has ports.
    pub ports: Option<[u16; 2]>,
    /// Congestion bits.
    pub ecn: Ecn,
    /// Length of the fixed header and, with IPv4, its options \[bytes\]. The checksum of the IPv4 header covers these bytes.
    pub(super) covered: usize,
    /// Index of the first byte of the transport header, or `None` if the header is not in this packet.
    pub transport: Option<usize>,
    /// `true` if the packet is no fragment.
    pub is_whole: bool,
    /// Length of the packet \[bytes\], at most the number of bytes read.
    pub length: usize,
}

/// Reason why bytes are no packet of IP.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[non_exhaustive]
pub enum Malformed {
    /// The bytes end within the fixed header.
    Short,
    /// The version is neither 4 nor 6.
    Version,
    /// The length of the header exceeds the packet, or is less than the fixed header.
    HeaderLength,
    /// The length of the packet exceeds the bytes received, or is less than the header.
    Length,
    /// The virtio header contradicts the packet: a segment of another protocol or length, or a checksum outside of the packet.
    Offload,
}

impl Headers {
    /// Reads the headers. Bytes beyond the length given in the packet are padding.
    ///
    /// # Errors
    ///
    /// [`Malformed`]. Extension headers that are cut off are no error: the protocol is then the number of the first incomplete header.
    pub fn read(bytes: &[u8]) -> Result<Self, Malformed> {
        match bytes.first().map(|byte| byte >> 4) {
            None => Err(Malformed::Short),
            Some(4) => read_v4(bytes),
            Some(6) => read_v6(bytes),
            Some(_) => Err(Malformed::Version),
        }
    }

    /// Returns the number of the flow, from both addresses and, of a whole packet, from protocol and ports. All fragments of a packet are one flow.
    pub(super) fn flow(&self) -> u32 {
        let halves = |address: IpAddr| match address {
            IpAddr::V4(v4) => [0, v4.to_bits().into()],
            IpAddr::V6(v6) => {
                let [a, b, c, d, e, f, g, h] = v6.segments().map(u64::from);
                [a << 48 | b << 32 | c << 16 | d, e << 48 | f << 32 | g << 16 | h]
            }
        };
        let ([s1, s0], [d1, d0]) = (halves(self.source), halves(self.destination));
        let [source, destination] = self.ports.unwrap_or_default().map(u64::from);
        // Later fragments have no ports, so the first fragment must not count its ports.
        let ends = if self.is_whole { u64::from(self.protocol.0) << 32 | source << 16 | destination } else { u64::MAX };
        flow_number(&[s1, s0, d1, d0, ends])
    }

    /// Sets both congestion bits in `bytes`, from which the headers were read. Corrects the checksum of an IPv4 header.
    pub(super) fn mark_congestion(&mut self, bytes: &mut [u8]) {
        match self.source {
            IpAddr::V4(_) => {
                let before = [bytes[0], bytes[1]];
                bytes[1] |= Ecn::Congestion.bits();
                checksum::change(bytes, V4_CHECKSUM, u16::from_be_bytes(before), u16::from_be_bytes([bytes[0], bytes[1]]));
            }
            // The traffic class of IPv6 spans two bytes; its two lowest bits are bits 4 and 5 of the second byte.
            IpAddr::V6(_) => bytes[1] |= Ecn::Congestion.bits() << 4,
        }
        self.ecn = Ecn::Congestion;
    }
}

/// Index of the checksum in an IPv4 header.
pub(super) const V4_CHECKSUM: usize = 10;

/// Reads an IPv4 header.
fn read_v4(bytes: &[u8]) -> Result<Headers, Malformed> {
    let fixed: &[u8; 20] = bytes.first_chunk().ok_or(Malformed::Short)?;
    // The header length counts words of four bytes.
    let header = usize::from(fixed[0] & 0xf) * 4;
    let length = usize::from(u16::from_be_bytes([fixed[2], fixed[3]]));
    // Checked before the length, which is compared with the header.
    if header < fixed.len() || header > bytes.len() {
        return Err(Malformed::HeaderLength);
    }
    if length < header || length > bytes.len() {
        return Err(Malformed::Length);
    }
    let fragment = u16::from_be_bytes([fixed[6], fixed[7]]);
    // The lower 13 bits are the offset of the fragment. The next bit announces more fragments.
    let (offset, more) = (fragment & 0x1fff, fragment & 0x2000 != 0);
    let protocol = Protocol(fixed[9]);
    let transport = (offset == 0).then_some(header);
    Ok(Headers {
        source: Ipv4Addr::new(fixed[12], fixed[13], fixed[14], fixed[15]).into(),
        destination: Ipv4Addr::new(fixed[16], fixed[17], fixed[18], fixed[19]).into(),
        protocol,
        ports: transport.and_then(|at| ports(&bytes[..length], protocol, at)),
        ecn: Ecn::from_bits(fixed[1]),
        covered: header,
        transport,
        is_whole: offset == 0 && !more,
        length,
    })
}

/// Reads an IPv6 header with its extension headers.
fn read_v6(bytes: &[u8]) -> Result<Headers, Malformed> {
    const FIXED: usize = 40;
    let fixed: &[u8; FIXED] = bytes.first_chunk().ok_or(Malformed::Short)?;
    // The length field counts the bytes after the fixed header.
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
        ecn: Ecn::from_bits(fixed[1] >> 4),
        covered: FIXED,
        transport: found.at,
        is_whole: found.whole,
        length,
    })
}

/// Result of a walk over the extension headers.
struct Found {
    /// Protocol after the last complete extension header.
    protocol: Protocol,
    /// Index of the transport header, or `None` if the header is not in this packet.
    at: Option<usize>,
    /// `true` if the packet is no fragment.
    whole: bool,
}

/// Walks over the extension headers (RFC 8200, section 4; RFC 4302; RFC 6564), from the header of kind `first` at index `begin`.
fn walk(packet: &[u8], first: u8, begin: usize) -> Found {
    const FRAGMENT: u8 = 44;
    const AUTHENTICATION: u8 = 51;
    let (mut next, mut at, mut whole) = (first, begin, true);
    loop {
        let unit = match next {
            // Hop-by-hop options, routing, destination options, mobility, host identity, shim6: lengths count units of eight bytes.
            0 | 43 | 60 | 135 | 139 | 140 => 8,
            FRAGMENT | AUTHENTICATION => 4,
            _ => return Found { protocol: Protocol(next), at: Some(at), whole },
        };
        // A header that is cut off ends the walk without a transport header.
        let Some(&[following, size, high, low]) = packet.get(at..).and_then(|rest| rest.first_chunk()) else { break };
        let length = match next {
            FRAGMENT => 8,
            AUTHENTICATION => (usize::from(size) + 2) * unit,
            _ => (usize::from(size) + 1) * unit,
        };
        if at + length > packet.len() {
            break;
        }
        // An offset or the flag for more fragments makes a fragment; an offset of zero still has the transport header. The two reserved bits are ignored.
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

/// Returns the ports at the index `at` of the transport header, or `None` if the protocol has no ports or the packet ends before them.
fn ports(packet: &[u8], protocol: Protocol, at: usize) -> Option<[u16; 2]> {
    if !protocol.has_ports() {
        return None;
    }
    let bytes: &[u8; 4] = packet.get(at..)?.first_chunk()?;
    Some([u16::from_be_bytes([bytes[0], bytes[1]]), u16::from_be_bytes([bytes[2], bytes[3]])])
}
