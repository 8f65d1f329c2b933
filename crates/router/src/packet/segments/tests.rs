use std::sync::Arc;

use cohaptic_tests_common::properties;
use etherparse::{PacketBuilder, TcpOptions};
use proptest::prelude::*;

use super::*;
use crate::packet::checksum::{self, pseudo_header, sum};
use crate::packet::headers::V4_CHECKSUM;
use crate::packet::{Content, Headers, Malformed, Packet};

/// Recipe for a segment.
#[derive(Clone, Debug)]
struct Wanted {
    is_v4: bool,
    is_tcp: bool,
    /// TCP flags beside the acknowledgement.
    flags: u8,
    /// Words of four bytes with TCP options.
    options: u8,
    sequence: u32,
    identification: u16,
    /// Bytes of data in each packet but the last.
    size: usize,
    data: Vec<u8>,
}

fn wanted() -> impl Strategy<Value = Wanted> {
    let flags = prop::sample::select(vec![0, PUSH, FIN, PUSH | FIN, ECHO, CWR, CWR | ECHO | PUSH]);
    let words = (any::<[bool; 3]>(), flags, 0_u8..=10, any::<u32>(), any::<u16>(), any::<u64>());
    (words, 1_usize..1400, 1_usize..20_000).prop_map(|(([is_v4, is_tcp, is_even], flags, options, sequence, identification, seed), size, more)| {
        // The segment has more than one packet, and no more packets than `join` puts together.
        let length = (size + more).min(size * MOST_PACKETS).min(60_000);
        let length = if is_even { length.next_multiple_of(size) } else { length };
        let data = (0..length as u64).map(|place| (seed.wrapping_mul(place + 1) >> 56) as u8).collect();
        Wanted { is_v4, is_tcp, flags, options, sequence, identification, size, data }
    })
}

const MOST_PACKETS: usize = 64;

/// Returns the bytes that a kernel gives for the segment: the virtio header and the segment.
fn segment(wanted: &Wanted) -> Vec<u8> {
    let Wanted { is_v4, is_tcp, flags, options, sequence, identification, size, data } = wanted;
    let builder = if *is_v4 { PacketBuilder::ipv4([10, 1, 0, 1], [10, 2, 0, 1], 64) } else { PacketBuilder::ipv6([0xfd; 16], [0xfe; 16], 64) };
    let mut packet = Vec::new();
    if *is_tcp {
        let options = TcpOptions::try_from_slice(&vec![1; usize::from(*options) * 4]).unwrap();
        builder.tcp(5000, 5001, *sequence, 900).ack(77).options_raw(options.as_slice()).unwrap().write(&mut packet, data).unwrap();
    } else {
        builder.udp(5000, 5001).write(&mut packet, data).unwrap();
    }
    let at = if *is_v4 { 20 } else { 40 };
    if *is_tcp {
        packet[at + TCP_FLAGS] |= flags;
    }
    if *is_v4 {
        packet[4..6].copy_from_slice(&identification.to_be_bytes());
        // Without the flag that forbids fragments, the identification has a meaning.
        packet[6] = 0;
    }
    correct(&mut packet);
    let headers = Headers::read(&packet).unwrap();
    let field = checksum::offset(headers.protocol).unwrap();
    let pseudo = pseudo_header(&headers, at);
    packet[at + field..at + field + 2].copy_from_slice(&pseudo.to_be_bytes());
    let kind = if !is_tcp {
        UDP
    } else if *is_v4 {
        TCP_V4
    } else {
        TCP_V6
    };
    let reduced = if *is_tcp && flags & CWR != 0 { REDUCED } else { 0 };
    let length = if *is_tcp { at + 20 + usize::from(*options) * 4 } else { at + 8 };
    let word = |number: usize| u16::try_from(number).unwrap();
    let (headers, size, begin, field) = (word(length), word(*size), word(at), word(field));
    let mut bytes = Vec::new();
    Offload { flags: NEEDS_CHECKSUM, kind: kind | reduced, headers, size, begin, field }.write(&mut bytes);
    bytes.extend(packet);
    bytes
}

/// Computes the checksums of a packet.
fn correct(packet: &mut [u8]) {
    let headers = Headers::read(packet).unwrap();
    if headers.source.is_ipv4() {
        packet[V4_CHECKSUM..V4_CHECKSUM + 2].fill(0);
        let checksum = !sum(&packet[..20]);
        packet[V4_CHECKSUM..V4_CHECKSUM + 2].copy_from_slice(&checksum.to_be_bytes());
    }
    let at = headers.transport.unwrap();
    let field = at + checksum::offset(headers.protocol).unwrap();
    packet[field..field + 2].copy_from_slice(&pseudo_header(&headers, at).to_be_bytes());
    let checksum = checksum::of_sum(headers.protocol, sum(&packet[at..]));
    packet[field..field + 2].copy_from_slice(&checksum.to_be_bytes());
}

fn cut_all(bytes: &[u8]) -> Vec<Packet> {
    let mut packets = Vec::new();
    cut(bytes, &mut packets);
    packets
}

fn joined(packets: &[Arc<Packet>]) -> (usize, Vec<u8>) {
    let mut head = Vec::new();
    let count = join(packets, Join::TcpAndUdp, &mut head);
    let bytes = slices(&packets[..count], &head).iter().flat_map(|slice| slice.to_vec()).collect();
    (count, bytes)
}

fn shared(packets: Vec<Packet>) -> Vec<Arc<Packet>> {
    packets.into_iter().map(Arc::new).collect()
}

properties! {
    /// `etherparse` reads every packet as complete, with right checksums, and the packets together carry the data of the segment.
    #[test]
    fn the_packets_of_a_segment_are_right(wanted in wanted()) {
        let packets = cut_all(&segment(&wanted));
        prop_assert_eq!(packets.len(), wanted.data.len().div_ceil(wanted.size));
        let mut data = Vec::new();
        for (number, packet) in packets.iter().enumerate() {
            let sliced = etherparse::PacketHeaders::from_ip_slice(packet.bytes()).unwrap();
            let read = Headers::read(packet.bytes()).map(|headers| Content::Ip { at: 0, headers });
            prop_assert_eq!(Ok(packet.content), read);
            let (is_first, is_last) = (number == 0, number + 1 == packets.len());
            let payload = sliced.payload.slice();
            prop_assert!(payload.len() == wanted.size || is_last);
            let net = sliced.net.unwrap();
            if let Some((header, _)) = net.ipv4_ref() {
                prop_assert_eq!(header.header_checksum, header.calc_header_checksum());
                prop_assert_eq!(header.identification, wanted.identification.wrapping_add(u16::try_from(number).unwrap()));
            }
            match sliced.transport.unwrap() {
                etherparse::TransportHeader::Tcp(header) => {
                    let expected = match &net {
                        etherparse::NetHeaders::Ipv4(ip, _) => header.calc_checksum_ipv4(ip, payload),
                        etherparse::NetHeaders::Ipv6(ip, _) => header.calc_checksum_ipv6(ip, payload),
                        etherparse::NetHeaders::Arp(_) => unreachable!(),
                    };
                    prop_assert_eq!(header.checksum, expected.unwrap());
                    prop_assert_eq!(header.sequence_number, wanted.sequence.wrapping_add(u32::try_from(data.len()).unwrap()));
                    let flag = |flag| wanted.flags & flag != 0;
                    prop_assert_eq!((header.fin, header.psh), (flag(FIN) && is_last, flag(PUSH) && is_last));
                    prop_assert_eq!((header.cwr, header.ece, header.ack), (flag(CWR) && is_first, flag(ECHO), true));
                }
                etherparse::TransportHeader::Udp(header) => {
                    let expected = match &net {
                        etherparse::NetHeaders::Ipv4(ip, _) => header.calc_checksum_ipv4(ip, payload),
                        etherparse::NetHeaders::Ipv6(ip, _) => header.calc_checksum_ipv6(ip, payload),
                        etherparse::NetHeaders::Arp(_) => unreachable!(),
                    };
                    prop_assert_eq!(header.checksum, expected.unwrap());
                }
                etherparse::TransportHeader::Icmpv4(_) | etherparse::TransportHeader::Icmpv6(_) => unreachable!(),
            }
            data.extend_from_slice(payload);
        }
        prop_assert_eq!(data, wanted.data);
    }

    #[test]
    fn cut_and_joined_a_segment_is_what_it_was(wanted in wanted()) {
        let segment = segment(&wanted);
        let (count, bytes) = joined(&shared(cut_all(&segment)));
        prop_assert_eq!((count, bytes), (wanted.data.len().div_ceil(wanted.size), segment));
    }

    /// Any packets of a flow, with headers changed in any byte: cutting the joined packets gives the same packets, and no packet is lost.
    #[test]
    fn joined_and_cut_packets_are_what_they_were(
        wanted in wanted(), changes in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..48, 1_u8..), 0..8),
    ) {
        let mut packets = cut_all(&segment(&wanted));
        // The next segment of the same flow.
        let sequence = wanted.sequence.wrapping_add(u32::try_from(wanted.data.len()).unwrap());
        let identification = wanted.identification.wrapping_add(u16::try_from(packets.len()).unwrap());
        packets.extend(cut_all(&segment(&Wanted { sequence, identification, ..wanted })));
        for (which, place, bits) in changes {
            let packet = which.get_mut::<Packet>(&mut packets);
            let mut bytes = packet.bytes.clone();
            let place = place % bytes.len();
            bytes[place] ^= bits;
            // Bytes that are no longer a packet of this kind are the subject of another test.
            let (Ok(headers), Content::Ip { headers: before, .. }) = (Headers::read(&bytes), packet.content) else { continue };
            if headers.length == bytes.len() && headers.transport == before.transport && headers.protocol == before.protocol && headers.covered == before.covered {
                correct(&mut bytes);
                *packet = Packet { bytes, content: Content::Ip { at: 0, headers }, is_checked: true };
            }
        }
        let packets = shared(packets);
        let mut rest = packets.as_slice();
        while !rest.is_empty() {
            let (count, bytes) = joined(rest);
            let again = cut_all(&bytes);
            prop_assert_eq!(again.len(), count);
            let ignored = |packet: &Packet| if packet.bytes[0] >> 4 == 4 && packet.bytes[6] & 0x40 != 0 { vec![4, 5, 10, 11] } else { Vec::new() };
            for (found, expected) in again.iter().zip(rest) {
                let ignored = ignored(expected);
                let mut differ = found.bytes.iter().zip(&expected.bytes).enumerate().filter(|(place, (a, b))| a != b && !ignored.contains(place));
                prop_assert!(found.bytes.len() == expected.bytes.len() && differ.next().is_none());
            }
            rest = &rest[count..];
        }
    }

    /// A damaged packet is neither joined nor given a new checksum, at any place in the flow.
    #[test]
    fn a_damaged_packet_goes_out_alone_as_it_is(wanted in wanted(), which in any::<prop::sample::Index>(), place in any::<prop::sample::Index>()) {
        let mut packets = cut_all(&segment(&wanted));
        let which = which.index(packets.len());
        let place = place.index(packets[which].bytes.len());
        // The damage of a link, without the correction of checksums.
        packets[which].is_checked = false;
        packets[which].bytes[place] ^= 0x10;
        let packets = shared(packets);
        if which > 0 {
            prop_assert_eq!(joined(&packets).0, which);
        }
        let (count, bytes) = joined(&packets[which..]);
        prop_assert_eq!((count, &bytes[Offload::LENGTH..]), (1, packets[which].bytes()));
        prop_assert_eq!(&bytes[..Offload::LENGTH], &[0; Offload::LENGTH]);
    }

    /// Random bytes, and a segment with some bytes changed: every packet cut from such bytes can be handled, and all other bytes count as malformed.
    #[test]
    fn hostile_bytes_are_refused(
        mut noise in prop::collection::vec(any::<u8>(), 0..200), wanted in wanted(),
        changes in prop::collection::vec((0_usize..80, any::<u8>()), 0..6), cut_off in any::<prop::sample::Index>(),
    ) {
        let mut changed = segment(&wanted);
        changes.iter().for_each(|(place, byte)| if let Some(found) = changed.get_mut(*place) { *found = *byte; });
        changed.truncate(cut_off.index(changed.len() + 1).max(40));
        if let Some(version) = noise.get_mut(Offload::LENGTH) {
            *version = if *version & 1 == 0 { 0x45 } else { 0x60 };
        }
        for bytes in [noise, changed] {
            let packets = cut_all(&bytes);
            prop_assert!(!packets.is_empty());
            let are_packets = packets.iter().all(|packet| matches!(packet.content, Content::Ip { .. }));
            prop_assert!(are_packets || packets.len() == 1);
            let packets = shared(packets);
            let mut rest = packets.as_slice();
            while !rest.is_empty() {
                let (count, bytes) = joined(rest);
                prop_assert!(count > 0 && bytes.len() <= Offload::LENGTH + (1 << 16));
                rest = &rest[count..];
            }
        }
    }
}

#[test]
fn a_header_that_contradicts_its_packet_is_malformed() {
    let wanted = Wanted { is_v4: true, is_tcp: true, flags: 0, options: 0, sequence: 1, identification: 1, size: 100, data: vec![7; 250] };
    let good = segment(&wanted);
    assert_eq!(cut_all(&good).len(), 3);
    let with = |change: fn(&mut Offload)| {
        let (mut offload, packet) = Offload::read(&good).unwrap();
        change(&mut offload);
        let mut bytes = Vec::new();
        offload.write(&mut bytes);
        bytes.extend(packet);
        cut_all(&bytes)
    };
    let changes: [fn(&mut Offload); 8] = [
        |offload| offload.kind = TCP_V6,
        |offload| offload.kind = UDP,
        |offload| offload.kind = 3,
        |offload| offload.size = 0,
        |offload| offload.flags = 0,
        |offload| offload.begin = 24,
        |offload| offload.field = 6,
        // A packet that is no segment, with a checksum beyond its end.
        |offload| (offload.kind, offload.field) = (NO_SEGMENT, 10_000),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let packets = with(change);
        assert_eq!(packets.iter().map(|packet| *packet.content()).collect::<Vec<_>>(), [Content::Malformed(Malformed::Offload)], "{number}");
    }
    let short = cut_all(&good[..9]);
    assert_eq!(*short[0].content(), Content::Malformed(Malformed::Offload));
    // One byte more than the length in the header, and one byte less.
    assert_eq!(*cut_all(&[good.as_slice(), &[0]].concat())[0].content(), Content::Malformed(Malformed::Offload));
    assert_eq!(*cut_all(&good[..good.len() - 1])[0].content(), Content::Malformed(Malformed::Length));
}

#[test]
fn a_packet_with_a_wrong_checksum_of_its_header_is_not_joined() {
    let wanted = Wanted { is_v4: true, is_tcp: true, flags: 0, options: 0, sequence: 1, identification: 1, size: 100, data: vec![7; 300] };
    let mut packets = cut_all(&segment(&wanted));
    packets[1].bytes[V4_CHECKSUM] ^= 1;
    let packets = shared(packets);
    assert_eq!((joined(&packets).0, joined(&packets[1..]).0), (1, 1));
}

/// Unfragmentable IPv4 packets mostly have the identification zero.
#[test]
fn datagrams_without_an_identification_are_joined() {
    let datagram = |number: u8, identification: u16, flags: u8| {
        let mut bytes = Vec::new();
        PacketBuilder::ipv4([10, 1, 0, 1], [10, 2, 0, 1], 64).udp(1, 2).write(&mut bytes, &[number; 9]).unwrap();
        bytes[4..6].copy_from_slice(&identification.to_be_bytes());
        bytes[6] = flags;
        correct(&mut bytes);
        let headers = Headers::read(&bytes).unwrap();
        Packet { bytes, content: Content::Ip { at: 0, headers }, is_checked: true }
    };
    let count =
        |identification: [u16; 3], flags| joined(&shared((1..).zip(identification).map(|(number, word)| datagram(number, word, flags)).collect())).0;
    assert_eq!(
        [count([0, 0, 0], 0x40), count([0, 0, 0], 0), count([65_535, 0, 1], 0), count([5, 5, 6], 0x40), count([5, 6, 6], 0x40)],
        [3, 1, 3, 2, 2]
    );
    assert_eq!(join(&shared(vec![datagram(1, 1, 0), datagram(2, 2, 0)]), Join::Tcp, &mut Vec::new()), 1);
}
