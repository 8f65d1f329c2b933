use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, PacketRecord};
use proptest::prelude::*;

use super::*;
use crate::pcapng::CaptureWriter;

/// A capture of (sequence, time \[µs\], payload), by our own writer; that an independent reader agrees with it is tested there.
fn capture(frames: &[(u64, u64, &[u8])]) -> Vec<u8> {
    let mut writer = CaptureWriter::new(Vec::new(), "test").unwrap();
    for &(sequence, micros, payload) in frames {
        let at = Instant::from_nanos(micros * 1_000);
        let size = Bytes::new(payload.len() as u64);
        let record = PacketRecord { path: (), sequence, copy: 0, offered: at, at, size, fate: Fate::Delivered(at), marked: false, damaged: false };
        writer.write(&record, payload).unwrap();
    }
    writer.finish().unwrap()
}

fn delays(matched: &Matched) -> Vec<(f64, Option<f64>)> {
    matched.measurements.packets().iter().map(|packet| (packet.sent_s, packet.delay_s)).collect()
}

#[test]
fn captures_are_known_by_how_they_begin() {
    // draft-ietf-opsawg-pcap, section 4: 0xA1B2C3D4 with microseconds, 0xA1B23C4D with nanoseconds, in the order of the writer's bytes.
    for magic in [[0xA1, 0xB2, 0xC3, 0xD4], [0xD4, 0xC3, 0xB2, 0xA1], [0xA1, 0xB2, 0x3C, 0x4D], [0x4D, 0x3C, 0xB2, 0xA1]] {
        assert!(is_capture(&magic));
    }
    assert!(is_capture(&capture(&[])));
    for other in [b"t,delay".as_slice(), b"\n\r", b"", &[0xA1, 0xB2, 0xC3, 0x4D]] {
        assert!(!is_capture(other));
    }
}

#[test]
fn datagrams_are_matched_by_what_they_carry() {
    let sent = capture(&[(0, 1_000, b"a"), (1, 2_000, b"b"), (2, 3_000, b"c")]);
    // b is lost, c overtakes a and comes twice, x is foreign.
    let arrived = capture(&[(2, 4_000, b"c"), (9, 4_500, b"x"), (0, 6_000, b"a"), (2, 7_000, b"c")]);
    let matched = between(sent.as_slice(), arrived.as_slice(), Some(49_153)).unwrap();
    assert_eq!(delays(&matched), [(0.0, Some(0.005)), (0.001, None), (0.002, Some(0.001))]);
    assert_eq!((matched.unmatched_sent, matched.unmatched_arrived, matched.ambiguous), (1, 2, 0));
}

#[test]
fn equal_payloads_are_told_apart_by_identification_or_by_order() {
    let sent = capture(&[(0, 0, b"s"), (1, 10, b"s"), (2, 20, b"s")]);
    // By identification: the first is lost.
    let arrived = capture(&[(1, 15, b"s"), (2, 25, b"s")]);
    let matched_by_number = between(sent.as_slice(), arrived.as_slice(), None).unwrap();
    assert_eq!(delays(&matched_by_number), [(0.0, None), (1e-5, Some(5e-6)), (2e-5, Some(5e-6))]);
    assert_eq!(matched_by_number.ambiguous, 0);
    // A path that rewrites identifications leaves the order.
    let rewritten = capture(&[(70, 5, b"s"), (71, 15, b"s"), (72, 25, b"s")]);
    let by_order = between(sent.as_slice(), rewritten.as_slice(), None).unwrap();
    assert_eq!(delays(&by_order), [(0.0, Some(5e-6)), (1e-5, Some(5e-6)), (2e-5, Some(5e-6))]);
    // 65 536 packets later the identification is the same.
    let ambiguous = between(capture(&[(0, 0, b"s"), (65_536, 10, b"s")]).as_slice(), rewritten.as_slice(), None).unwrap();
    assert_eq!(ambiguous.ambiguous, 2);
}

/// A pcap of one UDP datagram with payload "hi" to port 7, in that frame.
fn pcap(magic: [u8; 4], link_type: u32, before_ip: &[u8], ip: &[u8]) -> Vec<u8> {
    let udp = [0, 9, 0, 7, 0, 10, 0, 0, b'h', b'i'];
    // Ethernet pads short frames.
    let data = [before_ip, ip, &udp, &[0; 6]].concat();
    let mut file = magic.to_vec();
    file.extend([2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0]);
    file.extend(link_type.to_le_bytes());
    for word in [5, 250, u32::try_from(data.len()).unwrap(), u32::try_from(data.len()).unwrap()] {
        file.extend(word.to_le_bytes());
    }
    file.extend(data);
    file
}

#[test]
fn frames_of_all_kinds_are_read() {
    const MICROS: [u8; 4] = [0xd4, 0xc3, 0xb2, 0xa1];
    const NANOS: [u8; 4] = [0x4d, 0x3c, 0xb2, 0xa1];
    let mut v4 = [0_u8; 20];
    (v4[0], v4[9]) = (0x45, 17);
    let mut v6 = [0_u8; 40];
    (v6[0], v6[6]) = (0x60, 17);
    let ethernet = |kind: &[u8]| [&[0; 12], kind].concat();
    let files = [
        pcap(MICROS, 1, &ethernet(&[8, 0]), &v4),
        pcap(NANOS, 1, &ethernet(&[0x86, 0xdd]), &v6),
        pcap(MICROS, 1, &ethernet(&[0x81, 0, 0, 5, 8, 0]), &v4),
        pcap(MICROS, 113, &[&[0; 14][..], &[8, 0]].concat(), &v4),
        pcap(MICROS, 276, &[&[0x86, 0xdd][..], &[0; 18]].concat(), &v6),
        pcap(MICROS, 0, &[2, 0, 0, 0], &v4),
        pcap(MICROS, 101, &[], &v6),
    ];
    for (i, file) in files.iter().enumerate() {
        let datagrams = datagrams(End::Sender, file.as_slice(), Some(7)).unwrap_or_else(|error| panic!("{i}: {error}"));
        let nanos = if i == 1 { 5_000_000_250 } else { 5_000_250_000 };
        assert_eq!((datagrams[0].nanos, datagrams[0].payload.0), (nanos, 2), "{i}");
    }
    // A fragment and another protocol are passed over.
    for (place, value) in [(6, 0x20), (7, 1), (9, 6)] {
        let mut other = v4;
        other[place] = value;
        let error = datagrams(End::Receiver, pcap(MICROS, 101, &[], &other).as_slice(), Some(7)).unwrap_err();
        assert_eq!(error.to_string(), "the capture of the receiver has no UDP datagrams to port 7 in 1 frame: expected those of the link");
    }
}

#[test]
fn what_is_no_capture_is_refused() {
    let good = capture(&[(0, 0, b"a"), (1, 1, b"b")]);
    let refused = |file: &[u8]| between(file, good.as_slice(), None).unwrap_err();
    let problem = |file: &[u8]| {
        let CaptureError::Unreadable { problem, .. } = refused(file) else { panic!("read, but without datagrams") };
        problem
    };
    assert_eq!(problem(b"sequence,copy"), CaptureProblem::Format);
    assert_eq!(problem(b""), CaptureProblem::CutOff);
    assert_eq!(problem(&good[..good.len() - 3]), CaptureProblem::CutOff);
    assert_eq!(refused(&good[..good.len() - 3]).to_string(), "the capture of the sender: the file ends within a block after 1 frame");
    assert!(matches!(refused(&capture(&[])), CaptureError::NoDatagrams { end: End::Sender, frames: 0, port: None }));
}

/// A block of a process (0x80000001, as macOS writes it) with lengths that no block has, in both byte orders.
#[test]
fn a_block_that_is_shorter_than_its_lengths_is_refused() {
    let section = |word: fn(u32) -> [u8; 4], length: u32| {
        let words = [0x0A0D_0D0A, 28, 0x1A2B_3C4D, 0, u32::MAX, u32::MAX, 28, 0x8000_0001, length, 0, length];
        // The version is two halves, of which the parser takes any.
        words.map(word).concat()
    };
    for length in 0..12 {
        for file in [section(u32::to_le_bytes, length), section(u32::to_be_bytes, length)] {
            let error = datagrams(End::Sender, file.as_slice(), None).unwrap_err();
            assert_eq!(error, CaptureError::Unreadable { end: End::Sender, frames: 0, problem: CaptureProblem::Malformed }, "{length}");
        }
    }
    // The shortest block, and one that has a process and nothing else.
    assert!(
        datagrams(End::Sender, section(u32::to_le_bytes, 16).as_slice(), None).is_err_and(|error| matches!(error, CaptureError::NoDatagrams { .. }))
    );
}

#[test]
fn a_frame_larger_than_the_buffer_is_read() {
    let large = vec![7; 65_507];
    let file = capture(&[(0, 0, &large), (1, 1, &large), (2, 2, &large)]);
    assert_eq!(between(file.as_slice(), file.as_slice(), None).unwrap().measurements.packets().len(), 3);
}

proptest! {
    #[test]
    fn damaged_captures_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), cut in any::<prop::sample::Index>()) {
        let good = capture(&[(0, 0, b"abc"), (1, 10, b"defgh"), (2, 20, b"")]);
        let mut file = good.clone();
        for (place, byte) in edits {
            let place = place.index(file.len());
            file[place] = byte;
        }
        let _ = between(file.as_slice(), good.as_slice(), None);
        let _ = between(good.as_slice(), &file[..cut.index(file.len())], None);
    }
}
