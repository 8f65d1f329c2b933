//! Flipped bits are the bits of the link and no others, except for checksums, which stay as right or as wrong as before.

use cohaptic_router::{Content, Framing, Packet};
use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::{Chance, Checksum, Corruption, Damage, Fate, Flips, Link, LinkConfig, LinkName};
use etherparse::{NetSlice, PacketBuilder, SlicedPacket, TransportSlice};
use proptest::prelude::*;

/// Returns the damage that a link does to a packet of `size` bytes.
fn damage(seed: u64, size: u64, count: u32, within: Option<core::ops::Range<u64>>) -> Damage {
    let bits = Flips::Bits { packets: Chance::independent(Probability::ONE), count };
    let config = LinkConfig { corruption: Some(Corruption { bits, within, checksum: Checksum::Passes }), ..LinkConfig::default() };
    let mut link = Link::new(seed, &LinkName::between("a", "b"), config);
    link.handle_packet(Instant::ZERO, Bytes::new(size), ()).unwrap();
    link.handle_timeout(Instant::ZERO).unwrap();
    let event = link.poll_event().unwrap();
    assert_eq!(event.fate, Fate::Delivered(Instant::ZERO));
    event.damage.unwrap()
}

fn packet(kind: u8, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let v4 = || PacketBuilder::ipv4([10, 1, 0, 1], [10, 2, 0, 1], 64);
    let v6 = || PacketBuilder::ipv6([0xfd; 16], [0xfe; 16], 64);
    match kind {
        0 => v4().udp(5000, 5001).write(&mut bytes, data).unwrap(),
        1 => v4().tcp(5000, 5001, 9, 9).write(&mut bytes, data).unwrap(),
        2 => v4().icmpv4_echo_request(3, 4).write(&mut bytes, data).unwrap(),
        3 => v6().udp(5000, 5001).write(&mut bytes, data).unwrap(),
        4 => v6().tcp(5000, 5001, 9, 9).write(&mut bytes, data).unwrap(),
        _ => v6().icmpv6_echo_request(3, 4).write(&mut bytes, data).unwrap(),
    }
    bytes
}

/// Returns whether all checksums are right, as computed by `etherparse` and by this function.
fn is_right(bytes: &[u8]) -> bool {
    let sliced = SlicedPacket::from_ip(bytes).unwrap();
    let (NetSlice::Ipv4(_) | NetSlice::Ipv6(_)) = sliced.net.as_ref().unwrap() else { unreachable!() };
    let transport = |source: &[u8], destination: &[u8], protocol: u8, segment: &[u8]| {
        let mut sum: u64 =
            [source, destination].iter().flat_map(|address| address.chunks(2)).map(|word| u64::from(word[0]) << 8 | u64::from(word[1])).sum();
        sum += u64::from(protocol) + segment.len() as u64;
        sum += segment.chunks(2).map(|word| u64::from(word[0]) << 8 | word.get(1).map_or(0, |low| u64::from(*low))).sum::<u64>();
        while sum > 0xffff {
            sum = (sum & 0xffff) + (sum >> 16);
        }
        sum == 0xffff
    };
    match sliced.net.unwrap() {
        NetSlice::Ipv4(slice) => {
            let header = slice.header().to_header();
            let segment = slice.payload().payload;
            let is_icmp = matches!(sliced.transport, Some(TransportSlice::Icmpv4(_)));
            let of_segment = if is_icmp { icmp(segment) } else { transport(&header.source, &header.destination, header.protocol.0, segment) };
            header.header_checksum == header.calc_header_checksum() && of_segment
        }
        NetSlice::Ipv6(slice) => {
            let header = slice.header().to_header();
            transport(&header.source, &header.destination, header.next_header.0, slice.payload().payload)
        }
        NetSlice::Arp(_) => unreachable!(),
    }
}

fn icmp(segment: &[u8]) -> bool {
    let mut sum: u64 = segment.chunks(2).map(|word| u64::from(word[0]) << 8 | word.get(1).map_or(0, |low| u64::from(*low))).sum();
    while sum > 0xffff {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    sum == 0xffff
}

properties! {
    /// Flips in the data change only the data and the checksum: exactly the damaged bits are flipped, and the checksum is right.
    #[test]
    fn the_bits_of_the_data_are_flipped_and_no_checksum_notices(
        kind in 0_u8..6, data in prop::collection::vec(any::<u8>(), 1..100), seed in any::<u64>(), count in 1_u32..20,
    ) {
        let before = packet(kind, &data);
        prop_assert!(is_right(&before));
        let begin = before.len() - data.len();
        let damage = damage(seed, before.len() as u64, count, Some(begin as u64..before.len() as u64));
        let mut packet = Packet::new(before.clone(), Framing::Ip);
        packet.damage(&damage);
        let mut expected = before;
        damage.apply(&mut expected);
        prop_assert_eq!(&packet.bytes()[begin..], &expected[begin..]);
        prop_assert!(is_right(packet.bytes()));
    }

    /// The checksum of IPv4 covers the addresses and so does the checksum of the transport protocol, except ICMP for IPv4. Both are right for the damaged
    /// addresses.
    #[test]
    fn the_bits_of_the_addresses_are_flipped_and_no_checksum_notices(kind in 0_u8..6, seed in any::<u64>(), count in 1_u32..20) {
        let before = packet(kind, b"some data");
        let addresses = if kind < 3 { 12..20 } else { 8..40 };
        let damage = damage(seed, before.len() as u64, count, Some(addresses.start as u64..addresses.end as u64));
        let mut packet = Packet::new(before.clone(), Framing::Ip);
        packet.damage(&damage);
        let mut expected = before.clone();
        damage.apply(&mut expected);
        prop_assert_ne!(&expected, &before);
        prop_assert_eq!(&packet.bytes()[addresses.clone()], &expected[addresses]);
        prop_assert!(is_right(packet.bytes()));
    }

    /// Flips at any place: nothing panics, bits outside of checksums are the bits of the link, and padding stays the same.
    #[test]
    fn any_bit_may_be_flipped(kind in 0_u8..6, data in prop::collection::vec(any::<u8>(), 0..40), seed in any::<u64>(), count in 1_u32..40, padding in 0_usize..9) {
        let before = packet(kind, &data);
        let mut padded = [[0; 12].as_slice(), if kind < 3 { &[8, 0] } else { &[0x86, 0xdd] }, &before].concat();
        padded.resize(padded.len() + padding, 0xa5);
        let damage = damage(seed, before.len() as u64, count, None);
        let mut packet = Packet::new(padded, Framing::Ethernet);
        packet.damage(&damage);
        let mut expected = before.clone();
        damage.apply(&mut expected);
        let header = if kind < 3 { 20 } else { 40 };
        let field = header + [6, 16, 2][usize::from(kind % 3)];
        let checksums = [10..if kind < 3 { 12 } else { 10 }, field..field + 2];
        for (place, (found, expected)) in packet.bytes()[14..14 + before.len()].iter().zip(&expected).enumerate() {
            prop_assert!(found == expected || checksums.iter().any(|range| range.contains(&place)), "byte {}", place);
        }
        prop_assert!(packet.bytes()[14 + before.len()..].iter().all(|byte| *byte == 0xa5));
    }
}

#[test]
fn a_wrong_checksum_stays_wrong_and_none_stays_none() {
    let mut bytes = packet(0, b"some data");
    bytes[26] ^= 0x10;
    let mut wrong = Packet::new(bytes.clone(), Framing::Ip);
    wrong.damage(&damage(5, bytes.len() as u64, 3, Some(28..37)));
    assert!(!is_right(wrong.bytes()));
    bytes[26..28].fill(0);
    let mut none = Packet::new(bytes.clone(), Framing::Ip);
    none.damage(&damage(5, bytes.len() as u64, 3, Some(28..37)));
    assert_eq!(none.bytes()[26..28], [0, 0]);
    assert!(matches!(none.content(), Content::Ip { .. }));
}

/// A UDP checksum that comes out as zero is written as all ones: zero would mean that there is no checksum (RFC 768).
#[test]
fn a_checksum_that_comes_out_as_zero_does_not_vanish() {
    let damaged = |last: [u8; 2]| {
        let bytes = packet(0, &[1, 2, last[0], last[1]]);
        let mut packet = Packet::new(bytes.clone(), Framing::Ip);
        packet.damage(&damage(5, bytes.len() as u64, 3, Some(28..30)));
        packet.bytes().to_vec()
    };
    // A checksum is the difference to all ones. Put into the data, it makes the new checksum zero.
    let checksum = <[u8; 2]>::try_from(&damaged([0; 2])[26..28]).unwrap();
    let found = damaged(checksum);
    assert_eq!((&found[26..28], is_right(&found)), (&[0xff; 2][..], true));
}
