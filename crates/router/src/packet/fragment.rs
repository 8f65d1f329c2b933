//! Fragments of IP (RFC 791, section 2.3; RFC 8200, section 4.5): reading, and cutting of a packet that is longer than a device takes.

use core::net::IpAddr;

use cohaptic_linkfile::router::Protocol;

use super::checksum::sum;
use super::headers::V4_CHECKSUM;
use super::{Content, Packet};

/// Number of the extension header of a fragment.
const FRAGMENT: u8 = 44;
/// Length of the headers before the data of a fragment \[bytes\]: of IPv4 without options, and of IPv6 with the extension header.
const HEADERS: [usize; 2] = [20, 48];

/// Part of a packet that was cut.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fragment<'a> {
    /// Identification, the same in all fragments of a packet.
    pub identification: u32,
    /// Protocol of the whole packet.
    pub protocol: Protocol,
    /// Place of the data in the packet \[bytes\].
    pub offset: usize,
    /// `true` if no fragment comes after this one.
    pub is_last: bool,
    /// Data of the fragment.
    pub data: &'a [u8],
}

impl Packet {
    /// Returns the packet as a fragment. Returns `None` for a whole packet, and for a fragment of IPv6 with further extension headers before that of the
    /// fragment.
    #[must_use]
    pub fn fragment(&self) -> Option<Fragment<'_>> {
        let Content::Ip { at, headers } = &self.content else { return None };
        let bytes = self.bytes.get(*at..*at + headers.length).filter(|_| !headers.is_whole)?;
        if headers.source.is_ipv4() {
            let fixed: &[u8; 20] = bytes.first_chunk()?;
            let field = u16::from_be_bytes([fixed[6], fixed[7]]);
            return Some(Fragment {
                identification: u16::from_be_bytes([fixed[4], fixed[5]]).into(),
                protocol: headers.protocol,
                // The lower 13 bits count units of eight bytes; the bit above them announces more fragments.
                offset: usize::from(field & 0x1fff) * 8,
                is_last: field & 0x2000 == 0,
                data: bytes.get(usize::from(fixed[0] & 0xf) * 4..)?,
            });
        }
        let (fixed, data) = bytes.split_first_chunk::<48>()?;
        let field = u16::from_be_bytes([fixed[42], fixed[43]]);
        (fixed[6] == FRAGMENT).then_some(Fragment {
            identification: u32::from_be_bytes([fixed[44], fixed[45], fixed[46], fixed[47]]),
            protocol: Protocol(fixed[40]),
            // The upper 13 bits count units of eight bytes; the lowest bit announces more fragments.
            offset: usize::from(field & !0b111),
            is_last: field & 1 == 0,
            data,
        })
    }

    /// Returns a packet of IP around a transport header with its data, whose checksum stays as it is, such as the whole of a packet that was cut. Returns
    /// `None` if the addresses differ in their version, or the packet is too long.
    #[must_use]
    pub fn around_segment(source: IpAddr, destination: IpAddr, protocol: Protocol, segment: &[u8]) -> Option<Self> {
        Self::quoted(source, destination, protocol, segment).map(Self::checked)
    }

    /// Cuts a packet without IP options and extension headers into fragments of at most `mtu` bytes, at least 68. A packet that is short enough is its only
    /// fragment.
    #[must_use]
    pub fn cut(self, mtu: usize, identification: u32) -> Vec<Self> {
        let Content::Ip { at: 0, headers } = &self.content else { return vec![self] };
        if headers.length <= mtu {
            return vec![self];
        }
        let (source, destination, protocol) = (headers.source, headers.destination, headers.protocol);
        let version = usize::from(source.is_ipv6());
        let segment = &self.bytes[if source.is_ipv4() { 20 } else { 40 }..];
        let most = (mtu.max(68) - HEADERS[version]) / 8 * 8;
        let pieces = segment.chunks(most).enumerate();
        let fragment = |(place, data): (usize, &[u8])| {
            let (offset, more) = (place * most, (place + 1) * most < segment.len());
            let bytes = if version == 0 {
                v4(source, destination, protocol, data, identification, offset, more)?
            } else {
                let field = u16::try_from(offset).ok()? | u16::from(more);
                let mut extended = vec![protocol.0, 0];
                extended.extend(field.to_be_bytes());
                extended.extend(identification.to_be_bytes());
                extended.extend(data);
                Self::quoted(source, destination, Protocol(FRAGMENT), &extended)?
            };
            Some(Self::checked(bytes))
        };
        pieces.filter_map(fragment).collect()
    }
}

/// Returns a fragment of IPv4.
fn v4(source: IpAddr, destination: IpAddr, protocol: Protocol, data: &[u8], identification: u32, offset: usize, more: bool) -> Option<Vec<u8>> {
    let mut bytes = Packet::quoted(source, destination, protocol, data)?;
    let field = u16::try_from(offset / 8).ok()? | if more { 0x2000 } else { 0 };
    // The identification of IPv4 has the lower half of the bits.
    let [.., high, low] = identification.to_be_bytes();
    bytes[4..8].copy_from_slice(&[[high, low], field.to_be_bytes()].concat());
    bytes[V4_CHECKSUM..V4_CHECKSUM + 2].fill(0);
    let checksum = (!sum(&bytes[..20])).to_be_bytes();
    bytes[V4_CHECKSUM..V4_CHECKSUM + 2].copy_from_slice(&checksum);
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use etherparse::Ipv4Header;

    use super::*;

    #[test]
    fn a_packet_is_the_sum_of_its_fragments() {
        for (source, destination) in [("10.0.0.1:1", "10.0.0.2:2"), ("[fd00::1]:1", "[fd00::2]:2")] {
            let data: Vec<u8> = (0..4000_u32).map(|place| u8::try_from(place % 251).unwrap()).collect();
            let whole = Packet::datagram(source.parse().unwrap(), destination.parse().unwrap(), &data).unwrap();
            assert_eq!(whole.fragment(), None);
            let fragments = whole.clone().cut(1500, 0x0001_0203);
            assert_eq!(fragments.len(), 3);
            let mut segment = Vec::new();
            for (place, fragment) in fragments.iter().enumerate() {
                assert!(fragment.bytes().len() <= 1500);
                let part = fragment.fragment().unwrap();
                assert_eq!((part.protocol, part.offset, part.is_last), (Protocol::UDP, segment.len(), place == 2));
                assert_eq!(part.identification & 0xffff, 0x0203);
                segment.extend(part.data);
                if let Ok((header, _)) = Ipv4Header::from_slice(fragment.bytes()) {
                    assert_eq!(header.header_checksum, header.calc_header_checksum());
                }
            }
            let [from, to] = [source, destination].map(|text| text.parse::<std::net::SocketAddr>().unwrap().ip());
            let joined = Packet::around_segment(from, to, Protocol::UDP, &segment).unwrap();
            assert_eq!(joined.datagram_data(), Some(data.as_slice()));
            assert_eq!(whole.clone().cut(5000, 0), [whole]);
        }
    }
}
