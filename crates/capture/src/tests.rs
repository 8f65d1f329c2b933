use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::DropCause;
use pcap_parser::traits::PcapNGPacketBlock;
use pcap_parser::{Block, PcapNGSlice};
use proptest::prelude::*;

use super::*;

fn record(sequence: u64, at: u64, size: u64, fate: Fate) -> PacketRecord {
    let (offered, at) = (Instant::from_nanos(sequence * 1_000), Instant::from_nanos(at));
    PacketRecord { path: (), sequence, copy: 0, offered, at, size: Bytes::new(size), fate, marked: false, damaged: false }
}

fn delivered(sequence: u64, at: u64, size: u64) -> PacketRecord {
    record(sequence, at, size, Fate::Delivered(Instant::from_nanos(at)))
}

fn capture(frames: &[(PacketRecord, &[u8])]) -> Vec<u8> {
    let mut writer = CaptureWriter::new(Vec::new(), "left->right").unwrap();
    for (record, payload) in frames {
        writer.write(record, payload).unwrap();
    }
    writer.finish().unwrap()
}

#[derive(Clone, PartialEq, Eq, Debug)]
struct Frame {
    nanos: u64,
    original: usize,
    data: Vec<u8>,
    comment: String,
}

/// Reads the frames with an independent library.
fn frames_by_library(file: &[u8]) -> Vec<Frame> {
    let mut frames = Vec::new();
    for block in PcapNGSlice::from_slice(file).unwrap() {
        let block = block.unwrap();
        let pcap_parser::PcapBlockOwned::NG(block) = block else { panic!("another format") };
        if let Block::EnhancedPacket(packet) = &block {
            frames.push(Frame {
                nanos: u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low),
                original: usize::try_from(packet.orig_len()).unwrap(),
                data: packet.packet_data().to_vec(),
                comment: packet.options[0].as_str().unwrap().to_string(),
            });
        } else if let Block::InterfaceDescription(interface) = &block {
            assert_eq!(interface.linktype.0, 101);
            assert_eq!(interface.ts_resolution(), Some(1_000_000_000));
            assert_eq!(interface.if_name().unwrap().unwrap(), "left->right");
        } else if let Block::SectionHeader(header) = &block {
            assert_eq!((header.major_version, header.minor_version, header.section_len), (1, 0, -1));
        } else {
            panic!("not one of the three kinds");
        }
    }
    frames
}

/// Reads the frames by hand, block by block as the specification says, and checks both lengths of each block.
fn frames_by_hand(mut file: &[u8]) -> Vec<Frame> {
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let mut frames = Vec::new();
    while !file.is_empty() {
        let length = word(file, 4) as usize;
        assert_eq!(length % 4, 0);
        let (block, rest) = file.split_at(length);
        assert_eq!(word(block, length - 4) as usize, length);
        if word(block, 0) == 6 {
            let captured = word(block, 20) as usize;
            let option = 28 + captured.next_multiple_of(4);
            let comment_length = usize::from(u16::from_le_bytes(block[option + 2..option + 4].try_into().unwrap()));
            assert_eq!(&block[option..option + 2], [1, 0]);
            assert_eq!(word(block, length - 8), 0, "the end of the options");
            frames.push(Frame {
                nanos: u64::from(word(block, 12)) << 32 | u64::from(word(block, 16)),
                original: word(block, 24) as usize,
                data: block[28..28 + captured].to_vec(),
                comment: String::from_utf8(block[option + 4..option + 4 + comment_length].to_vec()).unwrap(),
            });
        }
        file = rest;
    }
    frames
}

/// Adds 16-bit words in ones' complement, by another method than the code: in 64 bits, folded at the end.
fn ones_complement(bytes: &[u8]) -> u64 {
    let mut sum: u64 = bytes.chunks(2).map(|pair| u64::from(pair[0]) << 8 | u64::from(pair.get(1).copied().unwrap_or(0))).sum();
    while sum > 0xffff {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    sum
}

#[test]
fn the_fate_stands_in_the_comment() {
    let copy = PacketRecord { copy: 1, marked: true, ..delivered(2, 24_102_000, 3) };
    let damaged = PacketRecord { damaged: true, ..delivered(70_000, u64::MAX, 3) };
    let file = capture(&[
        (record(0, 5, 3, Fate::Dropped(DropCause::QueueFull)), b"abc"),
        (record(2, 2_000, 3, Fate::Duplicated), b"abc"),
        (copy, b"abc"),
        (damaged, b"abd"),
    ]);
    let frames = frames_by_library(&file);
    assert_eq!(frames, frames_by_hand(&file));
    let comments: Vec<&str> = frames.iter().map(|frame| frame.comment.as_str()).collect();
    assert_eq!(comments[..3], ["packet 0 dropped: queue-full", "packet 2 duplicated", "packet 2 delivered after 24.1ms, copy 1, marked"]);
    assert!(comments[3].starts_with("packet 70000 delivered after") && comments[3].ends_with(", damaged"));
    assert_eq!(frames.iter().map(|frame| frame.nanos).collect::<Vec<_>>(), [5, 2_000, 24_102_000, u64::MAX]);
    assert_eq!((frames[1].data[1], frames[2].data[1]), (0, 3), "congestion experienced");
    assert_eq!(frames[3].data[4..6], 4_464_u16.to_be_bytes(), "70 000 modulo 65 536");
}

/// The part of a path on which a packet was dropped stands in the comment, unless it is the link.
#[test]
fn the_part_of_a_path_stands_in_the_comment() {
    let mut writer = CaptureWriter::new(Vec::new(), "a -> b").unwrap();
    for part in [PathPart::Uplink, PathPart::Link, PathPart::Downlink] {
        writer.write(&record(0, 5, 3, Fate::Dropped(DropCause::Loss)).with_path(part), b"abc").unwrap();
        writer.write(&delivered(1, 5, 3).with_path(part), b"abc").unwrap();
    }
    let comments: Vec<String> = frames_by_hand(&writer.finish().unwrap()).into_iter().map(|frame| frame.comment).collect();
    let dropped = ["packet 0 dropped on the uplink: loss", "packet 0 dropped: loss", "packet 0 dropped on the downlink: loss"];
    assert_eq!([&*comments[0], &*comments[2], &*comments[4]], dropped);
    assert!(comments[1] == comments[3] && comments[3] == comments[5]);
}

#[test]
fn a_payload_that_is_not_known_is_cut_off_and_has_no_checksum() {
    let frames = frames_by_hand(&capture(&[(delivered(0, 1, 64), b""), (delivered(1, 2, u64::MAX), b"ab")]));
    assert_eq!((frames[0].original, frames[0].data.len()), (92, 28));
    assert_eq!(frames[0].data[2..4], 92_u16.to_be_bytes());
    assert_eq!(frames[0].data[26..28], [0, 0]);
    assert_eq!((frames[1].original, frames[1].data.len()), (65_535, 30));
}

#[test]
fn a_name_of_any_length_fits() {
    let file = CaptureWriter::new(Vec::new(), &"ä".repeat(40_000)).unwrap().finish().unwrap();
    assert_eq!(PcapNGSlice::from_slice(&file).unwrap().count(), 2);
}

properties! {
    #[test]
    fn headers_and_checksums_are_right(sequence in 0..1_000_000_u64, later in any::<u32>(), payload in prop::collection::vec(any::<u8>(), 0..200), marked: bool) {
        let row = PacketRecord { marked, ..delivered(sequence, sequence * 1_000 + u64::from(later), payload.len() as u64) };
        let file = capture(&[(row, &payload)]);
        let frames = frames_by_library(&file);
        prop_assert_eq!(&frames, &frames_by_hand(&file));
        let data = &frames[0].data;
        prop_assert_eq!(&data[28..], &payload[..]);
        prop_assert_eq!(frames[0].original, data.len());
        // A header with its checksum adds to all ones (RFC 1071).
        prop_assert_eq!(ones_complement(&data[..20]), 0xffff);
        let pseudo = [&data[12..20], &[0, 17], &data[24..26], &data[20..]].concat();
        prop_assert_eq!(ones_complement(&pseudo), 0xffff);
        prop_assert_ne!(&data[26..28], &[0, 0]);
        prop_assert_eq!(usize::from(u16::from_be_bytes([data[24], data[25]])), payload.len() + 8);
    }
}

#[test]
fn a_packet_that_is_known_is_written_as_it_is() {
    let record = PacketRecord { marked: true, ..delivered(3, 9, 44) };
    let packet: Vec<u8> = (0..44).map(|octet| if octet == 0 { 0x45 } else { octet }).collect();
    let mut writer = CaptureWriter::new(Vec::new(), "left->right").unwrap();
    writer.write_packet(&record, &packet).unwrap();
    let frames = frames_by_library(&writer.finish().unwrap());
    let comment = Comment(record.with_path(PathPart::Link)).to_string();
    assert_eq!(frames, [Frame { nanos: 9, original: 44, data: packet, comment }]);
}

#[test]
fn a_datagram_between_known_ends_has_their_addresses() {
    let record = PacketRecord { marked: true, ..delivered(3, 9, 3) };
    for (ends, header, first) in
        [(["10.0.0.1:5000", "203.0.113.7:7"], 20, [0x45, 3, 0, 31]), (["[fd00::1]:5000", "[fd00::2]:7"], 40, [0x60, 0x30, 0, 0])]
    {
        let ends = ends.map(|end| end.parse::<SocketAddr>().unwrap());
        let mut writer = CaptureWriter::new(Vec::new(), "left->right").unwrap();
        writer.write_datagram(&record, ends, b"abc").unwrap();
        let frames = frames_by_library(&writer.finish().unwrap());
        let data = &frames[0].data;
        assert_eq!((&data[..4], data.len(), frames[0].original), (&first[..], header + 11, header + 11));
        let addresses = ends.map(|end| match end.ip() {
            std::net::IpAddr::V4(v4) => v4.octets().to_vec(),
            std::net::IpAddr::V6(v6) => v6.octets().to_vec(),
        });
        let addresses = addresses.concat();
        assert_eq!(data[header - addresses.len()..header], addresses[..]);
        assert_eq!(data[header..header + 6], [0x13, 0x88, 0, 7, 0, 11]);
        let pseudo = [&addresses[..], &[0, 17, 0, 11], &data[header..]].concat();
        assert_eq!(ones_complement(&pseudo), 0xffff);
        if header == 20 {
            assert_eq!(ones_complement(&data[..20]), 0xffff);
        } else {
            assert_eq!(data[4..8], [0, 11, 17, 64], "length, protocol and hops left");
        }
    }
}
