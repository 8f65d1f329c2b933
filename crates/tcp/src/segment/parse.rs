//! Reading of a segment from the octets of an IP packet.

use core::fmt;
use core::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use super::checksum::Sum;
use super::encode::{IPV4_HEADER, IPV6_HEADER, TCP, TCP_HEADER, pseudo};
use super::{Ecn, Flags, Options, Segment};

/// Reason for which octets are not a valid segment.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum ParseError {
    /// The packet has fewer octets than its headers need or say.
    Truncated,
    /// The version of the packet is neither IPv4 nor IPv6.
    Version,
    /// A length in a header is impossible: shorter than the fixed header, or a TCP header longer than the packet.
    Length,
    /// The protocol of the packet is not TCP, or the TCP header comes after IPv6 extension headers.
    Protocol,
    /// The packet is a fragment of an IPv4 packet.
    Fragment,
    /// The checksum of the IPv4 header or of the TCP segment is wrong.
    Checksum,
}

impl fmt::Display for ParseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated => f.write_str("the packet is cut off"),
            Self::Version => f.write_str("the packet is neither IPv4 nor IPv6"),
            Self::Length => f.write_str("a length in a header is impossible"),
            Self::Protocol => f.write_str("the packet does not carry TCP"),
            Self::Fragment => f.write_str("the packet is a fragment"),
            Self::Checksum => f.write_str("a checksum is wrong"),
        }
    }
}

impl core::error::Error for ParseError {}

impl<'a> Segment<'a> {
    /// Reads an IPv4 or IPv6 packet and checks its checksums. The segment borrows its data from `packet`. Octets after the end of the packet are ignored.
    ///
    /// # Errors
    ///
    /// If the packet is damaged, is a fragment, or does not carry TCP.
    pub fn parse(packet: &'a [u8]) -> Result<Self, ParseError> {
        match packet.first().ok_or(ParseError::Truncated)? >> 4 {
            4 => Self::parse_v4(packet),
            6 => Self::parse_v6(packet),
            _ => Err(ParseError::Version),
        }
    }

    fn parse_v4(packet: &'a [u8]) -> Result<Self, ParseError> {
        let fixed = packet.first_chunk::<IPV4_HEADER>().ok_or(ParseError::Truncated)?;
        let header_length = usize::from(fixed[0] & 15) * 4;
        let length = usize::from(u16::from_be_bytes([fixed[2], fixed[3]]));
        if header_length < IPV4_HEADER || length < header_length {
            return Err(ParseError::Length);
        }
        // Ethernet pads short frames, so that octets may follow the packet.
        let packet = packet.get(..length).ok_or(ParseError::Truncated)?;
        let (header, tcp) = packet.split_at(header_length);
        // The sum over a header that contains its own checksum is zero if the checksum is right.
        if Sum::default().add(header).finish() != 0 {
            return Err(ParseError::Checksum);
        }
        if fixed[9] != TCP {
            return Err(ParseError::Protocol);
        }
        // The flag of more fragments and the 13 bits of the fragment offset must be zero.
        if fixed[6] & 0x3f != 0 || fixed[7] != 0 {
            return Err(ParseError::Fragment);
        }
        let address = |at: usize| Ipv4Addr::new(fixed[at], fixed[at + 1], fixed[at + 2], fixed[at + 3]);
        // The pseudo header begins with both addresses.
        let sum = Sum::default().add(&fixed[12..20]);
        Self::parse_tcp(tcp, sum, [IpAddr::V4(address(12)), IpAddr::V4(address(16))], Ecn::from_bits(fixed[1]), fixed[8])
    }

    fn parse_v6(packet: &'a [u8]) -> Result<Self, ParseError> {
        let (fixed, rest) = packet.split_first_chunk::<IPV6_HEADER>().ok_or(ParseError::Truncated)?;
        let length = usize::from(u16::from_be_bytes([fixed[4], fixed[5]]));
        let tcp = rest.get(..length).ok_or(ParseError::Truncated)?;
        if fixed[6] != TCP {
            return Err(ParseError::Protocol);
        }
        let address = |at: usize| {
            let mut octets = [0; 16];
            octets.copy_from_slice(&fixed[at..at + 16]);
            IpAddr::V6(Ipv6Addr::from(octets))
        };
        // ECN is in the low two bits of the traffic class, which begins in the middle of octet 0. Both addresses, in octets 8 to 39, begin the pseudo header.
        Self::parse_tcp(tcp, Sum::default().add(&fixed[8..]), [address(8), address(24)], Ecn::from_bits(fixed[1] >> 4), fixed[7])
    }

    /// Reads the TCP segment `tcp`. `addresses_sum` is the sum over both addresses of the pseudo header; the other arguments are fields of the IP header.
    fn parse_tcp(tcp: &'a [u8], addresses_sum: Sum, [from, to]: [IpAddr; 2], ecn: Ecn, ttl: u8) -> Result<Self, ParseError> {
        let fixed = tcp.first_chunk::<TCP_HEADER>().ok_or(ParseError::Truncated)?;
        if addresses_sum.add_word(pseudo(tcp.len())).add(tcp).finish() != 0 {
            return Err(ParseError::Checksum);
        }
        let header_length = usize::from(fixed[12] >> 4) * 4;
        let options = tcp.get(TCP_HEADER..header_length).ok_or(ParseError::Length)?;
        let short = |at: usize| u16::from_be_bytes([fixed[at], fixed[at + 1]]);
        let long = |at: usize| u32::from_be_bytes([fixed[at], fixed[at + 1], fixed[at + 2], fixed[at + 3]]);
        Ok(Self {
            source: SocketAddr::new(from, short(0)),
            destination: SocketAddr::new(to, short(2)),
            sequence: long(4),
            acknowledgement: long(8),
            flags: Flags::from_bits(fixed[13]),
            window: short(14),
            options: Options::read(options),
            ecn,
            ttl,
            payload: tcp[header_length..].into(),
        })
    }
}
