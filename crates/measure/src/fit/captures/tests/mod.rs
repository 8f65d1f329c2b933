mod build;
mod formats;
mod frames;
mod people;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, PacketRecord};
use proptest::prelude::*;

use super::*;
use crate::pcapng::CaptureWriter;

/// Makes a capture of (sequence, time \[µs\], payload) with this project's writer. The writer's own tests compare it with an independent reader.
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
    // draft-ietf-opsawg-pcap, section 4: 0xA1B2C3D4 with microseconds, 0xA1B23C4D with nanoseconds, in the byte order of the writer. 0xA1B2CD34 is the
    // "modified" format.
    for magic in [[0xA1, 0xB2, 0xC3, 0xD4], [0xA1, 0xB2, 0x3C, 0x4D], [0xA1, 0xB2, 0xCD, 0x34]] {
        let [a, b, c, d] = magic;
        assert!(is_capture(&magic) && is_capture(&[d, c, b, a]));
    }
    assert!(is_capture(&capture(&[])));
    for other in [b"t,delay".as_slice(), b"\n\r", b"", &[0xA1, 0xB2, 0xC3, 0x4D]] {
        assert!(!is_capture(other));
    }
}

#[test]
fn datagrams_are_matched_by_what_they_carry() {
    let sent = capture(&[(0, 1_000, b"a"), (1, 2_000, b"b"), (2, 3_000, b"c")]);
    // Packet b is lost, c overtakes a and arrives twice, and x is foreign.
    let arrived = capture(&[(2, 4_000, b"c"), (9, 4_500, b"x"), (0, 6_000, b"a"), (2, 7_000, b"c")]);
    let matched = between(sent.as_slice(), arrived.as_slice(), Some(49_153)).unwrap();
    assert_eq!(delays(&matched), [(0.0, Some(0.005)), (0.001, None), (0.002, Some(0.001))]);
    assert_eq!((matched.unmatched_sent, matched.unmatched_arrived, matched.ambiguous), (1, 2, 0));
}

#[test]
fn equal_payloads_are_told_apart_by_identification_or_by_order() {
    let sent = capture(&[(0, 0, b"s"), (1, 10, b"s"), (2, 20, b"s")]);
    // By identification the second packet is lost.
    let arrived = capture(&[(0, 5, b"s"), (2, 25, b"s")]);
    let matched_by_number = between(sent.as_slice(), arrived.as_slice(), None).unwrap();
    assert_eq!(delays(&matched_by_number), [(0.0, Some(5e-6)), (1e-5, None), (2e-5, Some(5e-6))]);
    assert_eq!(matched_by_number.ambiguous, 0);
    // On a path that rewrites identifications the order decides.
    let rewritten = capture(&[(70, 5, b"s"), (71, 15, b"s"), (72, 25, b"s")]);
    let by_order = between(sent.as_slice(), rewritten.as_slice(), None).unwrap();
    assert_eq!(delays(&by_order), [(0.0, Some(5e-6)), (1e-5, Some(5e-6)), (2e-5, Some(5e-6))]);
    // The identification repeats after 65 536 packets.
    let ambiguous = between(capture(&[(0, 0, b"s"), (65_536, 10, b"s")]).as_slice(), rewritten.as_slice(), None).unwrap();
    assert_eq!(ambiguous.ambiguous, 2);
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
    assert_eq!(refused(&good[..20]).to_string(), "the capture of the sender: the file ends within its header after 0 frames");
    assert!(matches!(refused(&capture(&[])), CaptureError::NoDatagrams { end: End::Sender, port: None, .. }));
}

/// A block of a process (0x80000001, as written by macOS) with impossible lengths, in both byte orders.
#[test]
fn a_block_that_is_shorter_than_its_lengths_is_refused() {
    let section = |word: fn(u32) -> [u8; 4], length: u32| {
        let words = [0x0A0D_0D0A, 28, 0x1A2B_3C4D, 0, u32::MAX, u32::MAX, 28, 0x8000_0001, length, 0, length];
        // The version has two 16-bit parts; any value is accepted.
        words.map(word).concat()
    };
    for length in 0..12 {
        for file in [section(u32::to_le_bytes, length), section(u32::to_be_bytes, length)] {
            let error = Capture::read(End::Sender, file.as_slice(), None).unwrap_err();
            assert_eq!(error, CaptureError::Unreadable { end: End::Sender, frames: 0, problem: CaptureProblem::Malformed }, "{length}");
        }
    }
    // The shortest block, and a block with a process and nothing else.
    assert!(
        Capture::read(End::Sender, section(u32::to_le_bytes, 16).as_slice(), None)
            .is_err_and(|error| matches!(error, CaptureError::NoDatagrams { .. }))
    );
}

#[test]
fn a_frame_larger_than_the_buffer_is_read() {
    let large = vec![7; 65_507];
    let file = capture(&[(0, 0, &large), (1, 1, &large), (2, 2, &large)]);
    assert_eq!(between(file.as_slice(), file.as_slice(), None).unwrap().measurements.packets().len(), 3);
}

properties! {
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
