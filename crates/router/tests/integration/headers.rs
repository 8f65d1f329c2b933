//! Headers compared with `etherparse`, an independent implementation.

use std::net::IpAddr;

use cohaptic_linkfile::router::Protocol;
use cohaptic_router::{Content, Framing, Headers, Malformed, Packet};
use cohaptic_tests_common::properties;
use cohaptic_units::Bytes;
use etherparse::{IpFragOffset, IpHeaders, IpNumber, Ipv4Header, Ipv6FragmentHeader, NetSlice, PacketBuilder, SlicedPacket, TransportSlice};
use proptest::prelude::*;

use crate::support::udp_bytes;

fn read(bytes: &[u8]) -> Headers {
    Headers::read(bytes).unwrap()
}

#[test]
fn ports_and_addresses_of_both_families_are_found() {
    let headers = read(&udp_bytes([5000, 53], b"question"));
    assert_eq!((headers.source, headers.destination), (IpAddr::from([10, 1, 0, 1]), IpAddr::from([10, 2, 0, 1])));
    assert_eq!((headers.protocol, headers.ports, headers.length), (Protocol::UDP, Some([5000, 53]), 36));
    let mut bytes = Vec::new();
    PacketBuilder::ipv6([1; 16], [2; 16], 64).tcp(80, 4711, 1, 1000).write(&mut bytes, b"data").unwrap();
    let headers = read(&bytes);
    assert_eq!((headers.source, headers.destination), (IpAddr::from([1; 16]), IpAddr::from([2; 16])));
    assert_eq!((headers.protocol, headers.ports), (Protocol::TCP, Some([80, 4711])));
    let mut bytes = Vec::new();
    PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).icmpv4_echo_request(1, 2).write(&mut bytes, b"ping").unwrap();
    assert_eq!((read(&bytes).protocol, read(&bytes).ports), (Protocol::ICMP, None));
}

#[test]
fn options_lie_between_the_header_and_the_ports() {
    let mut header = Ipv4Header::new(16, 64, IpNumber::UDP, [10, 0, 0, 1], [10, 0, 0, 2]).unwrap();
    header.options = [1; 8].into();
    let bytes = [header.to_bytes().as_slice(), &[0, 7, 0, 8, 0, 8, 0, 0]].concat();
    assert_eq!(read(&bytes).ports, Some([7, 8]));
}

/// Hop-by-hop options, destination options, routing and authentication before UDP: the lengths count three different units.
#[test]
fn extension_headers_are_walked() {
    let chain: [(u8, &[u8]); 4] = [
        (0, &[60, 0, 1, 4, 0, 0, 0, 0]),
        (60, &[43, 1, 1, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
        (43, &[51, 0, 4, 0, 0, 0, 0, 0]),
        (51, &[17, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1]),
    ];
    let extensions: Vec<u8> = chain.iter().flat_map(|(_, header)| header.iter().copied()).collect();
    let udp = [0, 7, 0, 8, 0, 8, 0, 0];
    let length = u16::try_from(extensions.len() + udp.len()).unwrap();
    let mut bytes = vec![0x60, 0, 0, 0];
    bytes.extend(length.to_be_bytes());
    bytes.extend([0, 64]);
    bytes.extend([3; 32]);
    bytes.extend(&extensions);
    bytes.extend(udp);
    let headers = read(&bytes);
    assert_eq!((headers.protocol, headers.ports), (Protocol::UDP, Some([7, 8])));
    // The chain is cut off in the routing header, so the protocol is the number of this incomplete header.
    bytes.truncate(40 + 8 + 16 + 4);
    let length = u16::try_from(bytes.len() - 40).unwrap().to_be_bytes();
    bytes[4..6].copy_from_slice(&length);
    assert_eq!((read(&bytes).protocol, read(&bytes).ports), (Protocol(43), None));
}

#[test]
fn only_the_first_fragment_has_ports() {
    for (offset, more, expected) in [(0, true, Some([5, 6])), (8, true, None), (8, false, None)] {
        let mut header = Ipv4Header::new(8, 64, IpNumber::UDP, [10, 0, 0, 1], [10, 0, 0, 2]).unwrap();
        header.fragment_offset = IpFragOffset::try_new(offset).unwrap();
        header.more_fragments = more;
        let bytes = [header.to_bytes().as_slice(), &[0, 5, 0, 6, 0, 8, 0, 0]].concat();
        assert_eq!((read(&bytes).protocol, read(&bytes).ports), (Protocol::UDP, expected));
        let fragment = Ipv6FragmentHeader::new(IpNumber::UDP, IpFragOffset::try_new(offset).unwrap(), more, 99);
        let mut bytes = vec![0x60, 0, 0, 0, 0, 16, 44, 64];
        bytes.extend([3; 32]);
        bytes.extend(fragment.to_bytes());
        bytes.extend([0, 5, 0, 6, 0, 8, 0, 0]);
        assert_eq!((read(&bytes).protocol, read(&bytes).ports), (Protocol::UDP, expected));
    }
}

#[test]
fn what_is_no_packet_is_told_by_its_fault() {
    let good = udp_bytes([1, 2], b"data");
    let with = |place: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[place] = byte;
        Headers::read(&bytes)
    };
    assert_eq!(Headers::read(&[]), Err(Malformed::Short));
    assert_eq!(Headers::read(&good[..19]), Err(Malformed::Short));
    assert_eq!(with(0, 0x55), Err(Malformed::Version));
    assert_eq!(with(0, 0x44), Err(Malformed::HeaderLength));
    assert_eq!(with(0, 0x4f), Err(Malformed::HeaderLength));
    assert_eq!(with(3, 19), Err(Malformed::Length));
    assert_eq!(with(3, 33), Err(Malformed::Length));
    let mut v6 = vec![0x60; 40];
    assert_eq!(Headers::read(&v6[..39]), Err(Malformed::Short));
    v6[4..6].copy_from_slice(&[0, 1]);
    assert_eq!(Headers::read(&v6), Err(Malformed::Length));
    // In an Ethernet frame, a malformed packet differs from a frame without IP.
    let frame = |kind: [u8; 2]| Packet::new([[0; 12].as_slice(), &kind, &good[..10]].concat(), Framing::Ethernet);
    assert_eq!(*frame([8, 0]).content(), Content::Malformed(Malformed::Short));
    assert_eq!(*frame([8, 6]).content(), Content::NotIp);
}

/// Frames have at least 60 bytes: the bytes after the packet do not belong to the packet.
#[test]
fn padding_does_not_count() {
    let packet = udp_bytes([1, 2], b"ab");
    let mut frame = [[0; 12].as_slice(), &[8, 0], &packet].concat();
    frame.resize(60, 0);
    let packet = Packet::new(frame, Framing::Ethernet);
    assert_eq!(packet.info().size, Bytes::new(30));
    assert_eq!(packet.bytes().len(), 60);
}

#[test]
fn congestion_is_marked_and_the_checksum_follows() {
    for (tos, capable) in [(0b00, false), (0b01, true), (0b10, true), (0b11, true)] {
        let mut bytes = udp_bytes([1, 2], b"data");
        bytes[1] = 0b1011_1000 | tos;
        let mut header = Ipv4Header::from_slice(&bytes).unwrap().0;
        header.header_checksum = header.calc_header_checksum();
        bytes[..20].copy_from_slice(&header.to_bytes());
        let mut packet = Packet::new(bytes, Framing::Ip);
        assert_eq!(packet.info().ecn.is_capable(), capable);
        packet.mark_congestion();
        let marked = Ipv4Header::from_slice(packet.bytes()).unwrap().0;
        assert_eq!((marked.ecn.value(), marked.dscp.value()), (0b11, 0b10_1110));
        assert_eq!(marked.header_checksum, marked.calc_header_checksum());
    }
    let mut bytes = Vec::new();
    PacketBuilder::ipv6([1; 16], [2; 16], 64).udp(1, 2).write(&mut bytes, &[]).unwrap();
    bytes[0] |= 0x0a;
    bytes[1] |= 0b1010_0000 | 0x05;
    let mut packet = Packet::new(bytes.clone(), Framing::Ip);
    assert!(packet.info().ecn.is_capable());
    packet.mark_congestion();
    bytes[1] |= 0b0011_0000;
    assert_eq!(packet.bytes(), bytes, "only the two bits changed");
}

/// Returns a packet built by `etherparse`, with its protocol and ports.
fn built() -> impl Strategy<Value = (Vec<u8>, Protocol, Option<[u16; 2]>)> {
    let data = prop::collection::vec(any::<u8>(), 0..200);
    (any::<bool>(), 0_u8..3, any::<[u8; 16]>(), any::<[u8; 16]>(), any::<[u16; 2]>(), data).prop_map(
        |(is_v4, kind, source, destination, ports, data)| {
            let [v4_source, v4_destination] = [source, destination].map(|address| *address.first_chunk().unwrap());
            let builder = if is_v4 { PacketBuilder::ipv4(v4_source, v4_destination, 64) } else { PacketBuilder::ipv6(source, destination, 64) };
            let mut bytes = Vec::new();
            match kind {
                0 => builder.udp(ports[0], ports[1]).write(&mut bytes, &data).unwrap(),
                1 => builder.tcp(ports[0], ports[1], 1, 2).write(&mut bytes, &data).unwrap(),
                _ => builder.write(&mut bytes, IpNumber(253), &data).unwrap(),
            }
            let protocol = [Protocol::UDP, Protocol::TCP, Protocol(253)][usize::from(kind)];
            (bytes, protocol, (kind < 2).then_some(ports))
        },
    )
}

properties! {
    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..120), first in prop::sample::select(vec![0x45_u8, 0x46, 0x4f, 0x60, 0x00])) {
        let mut bytes = bytes;
        if let Some(byte) = bytes.first_mut() {
            *byte = first;
        }
        if bytes.len() > 6 && first == 0x60 {
            // The length fits, so that the chain of headers is walked.
            let length = u16::try_from(bytes.len().saturating_sub(40)).unwrap().to_be_bytes();
            bytes[4..6].copy_from_slice(&length);
        }
        for framing in [Framing::Ip, Framing::Ethernet] {
            let mut packet = Packet::new(bytes.clone(), framing);
            packet.mark_congestion();
            prop_assert!(packet.info().size.get() <= bytes.len() as u64);
            prop_assert_eq!(packet.bytes().len(), bytes.len());
        }
    }

    #[test]
    fn headers_say_what_they_were_built_from((bytes, protocol, ports) in built()) {
        let headers = read(&bytes);
        prop_assert_eq!((headers.protocol, headers.ports, headers.length), (protocol, ports, bytes.len()));
        let sliced = SlicedPacket::from_ip(&bytes).unwrap();
        let (source, destination) = match sliced.net.unwrap() {
            NetSlice::Ipv4(slice) => (IpAddr::from(slice.header().source_addr()), IpAddr::from(slice.header().destination_addr())),
            NetSlice::Ipv6(slice) => (IpAddr::from(slice.header().source_addr()), IpAddr::from(slice.header().destination_addr())),
            NetSlice::Arp(_) => unreachable!(),
        };
        prop_assert_eq!((headers.source, headers.destination), (source, destination));
        if let Some(TransportSlice::Udp(udp)) = sliced.transport {
            prop_assert_eq!(headers.ports, Some([udp.source_port(), udp.destination_port()]));
        }
    }

    /// A checksum field with only the sum of the pseudo-header becomes the right checksum, and a right checksum stays the same.
    #[test]
    fn a_checksum_that_was_left_out_is_computed((bytes, protocol, _) in built()) {
        prop_assume!(protocol.has_ports());
        let untouched = Packet::new(bytes.clone(), Framing::Ip);
        prop_assert_eq!(untouched.bytes(), bytes.as_slice());
        let (ip, payload) = IpHeaders::from_slice(&bytes).unwrap();
        let addresses: Vec<u8> = match &ip {
            IpHeaders::Ipv4(header, _) => [header.source, header.destination].concat(),
            IpHeaders::Ipv6(header, _) => [header.source, header.destination].concat(),
        };
        let mut sum: u32 = addresses.chunks(2).map(|word| u32::from(u16::from_be_bytes([word[0], word[1]]))).sum();
        sum += u32::from(protocol.0) + u32::try_from(payload.payload.len()).unwrap();
        while sum > 0xffff {
            sum = (sum & 0xffff) + (sum >> 16);
        }
        let field = bytes.len() - payload.payload.len() + if protocol == Protocol::UDP { 6 } else { 16 };
        let mut partial = bytes.clone();
        partial[field..field + 2].copy_from_slice(&u16::try_from(sum).unwrap().to_be_bytes());
        let completed = Packet::new(partial, Framing::Ip);
        prop_assert_eq!(completed.bytes(), bytes.as_slice());
    }
}

/// A computed checksum that comes out as zero is written as all ones: zero would mean that there is no checksum (RFC 768).
#[test]
fn a_checksum_that_is_computed_and_comes_out_as_zero_does_not_vanish() {
    let field = 26..28;
    // A checksum is the difference to all ones. Put into the data, it makes the new checksum zero.
    let missing = udp_bytes([1, 2], &[0; 2])[field.clone()].to_vec();
    let whole = udp_bytes([1, 2], &missing);
    assert_eq!(whole[field.clone()], [0xff; 2]);
    let mut partial = whole.clone();
    // Sum of the pseudo-header: from 10.1.0.1 to 10.2.0.1, UDP, 10 bytes.
    partial[field].copy_from_slice(&(0x0a01_u16 + 0x0001 + 0x0a02 + 0x0001 + 17 + 10).to_be_bytes());
    assert_eq!(Packet::new(partial, Framing::Ip).bytes(), whole);
}
