//! Files of pcap and pcapng in all forms.

use super::super::contents::Capture;
use super::super::{CaptureError, CaptureProblem, End, is_capture};
use super::build::{Octets, block, cut, enhanced, file, interface, obsolete, packet, pcap, section, simple};

const SECOND: u64 = 1_000_000_000;

fn read(file: &[u8]) -> Capture {
    Capture::read(End::Sender, file, None).unwrap_or_else(|error| panic!("{error}"))
}

fn instants(capture: &Capture) -> Vec<i128> {
    capture.datagrams.iter().map(|datagram| datagram.nanos).collect()
}

#[test]
fn pcap_of_either_order_and_of_each_magic_is_read() {
    let shots = [packet(5 * SECOND + 250_000, 1, b"hi"), packet(6 * SECOND + 1_250, 2, b"ho")];
    for order in [Octets::Big, Octets::Little] {
        for (magic, nanos) in [(0xA1B2_C3D4, 1_000), (0xA1B2_3C4D, 1_250), (0xA1B2_CD34, 1_000)] {
            let file = pcap(order, magic, 1, &shots);
            assert!(is_capture(&file));
            let capture = read(&file);
            assert_eq!(instants(&capture), [5_000_250_000, 6_000_000_000 + nanos]);
            assert_eq!(capture.payload(&capture.datagrams[1]), b"ho");
        }
    }
}

/// Files of version 2.2 and before have the two lengths of a frame in the other order.
#[test]
fn old_versions_have_their_lengths_the_other_way_round() {
    let mut old = pcap(Octets::Little, 0xA1B2_C3D4, 1, &[cut(&packet(0, 1, b"hello"), 45), packet(SECOND, 2, b"you")]);
    old[6] = 2;
    for frame in [24, 24 + 16 + 45] {
        let (captured, length) = (old[frame + 8], old[frame + 12]);
        (old[frame + 8], old[frame + 12]) = (length, captured);
    }
    let capture = read(&old);
    assert_eq!(capture.payload(&capture.datagrams[0]), b"hel");
    assert_eq!(instants(&capture), [0, 1_000_000_000]);
}

/// The upper half of the link type announces a frame check sequence of two 16-bit words, which is not part of the frame.
#[test]
fn bits_of_the_frame_check_sequence_are_no_link_type() {
    let mut with_check = packet(7, 1, b"hi");
    // With lengths of zero in UDP and IP, the length comes from the capture.
    (with_check.octets[16], with_check.octets[17]) = (0, 0);
    (with_check.octets[38], with_check.octets[39]) = (0, 0);
    with_check.octets.extend([1, 2, 3, 4]);
    with_check.length += 4;
    let capture = read(&pcap(Octets::Big, 0xA1B2_3C4D, 0x2400_0001, &[with_check.clone()]));
    assert_eq!((capture.datagrams[0].length, capture.payload(&capture.datagrams[0])), (2, &b"hi"[..]));
    // In pcapng an option of the interface gives the length, or bits 5 to 8 of a packet's flags.
    let order = Octets::Little;
    for (list, flags) in [(&[(13_u16, &[4_u8][..])][..], &[][..]), (&[], &[(2_u16, &[0x80_u8, 0, 0, 0][..])])] {
        let file = [section(order), interface(order, 1, 0, list), enhanced(order, 0, 7, &with_check, flags)].concat();
        let capture = read(&file);
        assert_eq!((capture.datagrams[0].length, instants(&capture)), (2, vec![7_000]));
    }
}

#[test]
fn each_block_of_pcapng_is_read() {
    for order in [Octets::Big, Octets::Little] {
        // Units of 2^-10 s, 100 s later, and nanoseconds. Blocks without frames come between: statistics, a custom block, an unknown block.
        let offset = match order {
            Octets::Big => 100_i64.to_be_bytes(),
            Octets::Little => 100_i64.to_le_bytes(),
        };
        let first = [
            section(order),
            interface(order, 101, 0, &[(2, b"eth0"), (9, &[0x8A]), (14, &offset)]),
            interface(order, 1, 0, &[(9, &[9])]),
            block(order, 5, &[0; 12]),
            enhanced(order, 1, 3, &packet(0, 1, b"one"), &[(1, b"a comment")]),
            block(order, 0x0BAD, b"maker and more"),
            enhanced(order, 0, 1_024, &super::build::shot(0, super::build::ipv4(2, 17, &super::build::udp(5000, b"two"))), &[]),
            obsolete(order, 1, 5_000_000_000, &packet(0, 3, b"three")),
            simple(order, &super::build::shot(0, super::build::ipv4(4, 17, &super::build::udp(5000, b"four")))),
            block(order, 0x7777, b"unknown"),
        ]
        .concat();
        let capture = read(&first);
        // A simple packet has no time.
        assert_eq!(instants(&capture), [3, 5_000_000_000, 101_000_000_000]);
        assert_eq!(capture.contents.kinds, [("UDP".into(), 3), ("UDP without a time".into(), 1)].into());
        // A later section may have another byte order, and numbers its interfaces anew. Without an option, timestamps count microseconds.
        let other = if order == Octets::Big { Octets::Little } else { Octets::Big };
        let second = [section(other), interface(other, 1, 0, &[]), enhanced(other, 0, 9, &packet(0, 5, b"five"), &[])].concat();
        assert_eq!(instants(&read(&[first, second].concat())), [3, 9_000, 5_000_000_000, 101_000_000_000]);
    }
}

/// The last frame was being written when the program stopped.
#[test]
fn a_file_that_ends_within_a_block_is_read_up_to_there() {
    let order = Octets::Big;
    let shots = [packet(0, 1, b"one"), packet(SECOND, 2, b"two")];
    let ng =
        [section(order), interface(order, 1, 0, &[]), enhanced(order, 0, 0, &shots[0], &[]), enhanced(order, 0, 1_000_000, &shots[1], &[])].concat();
    for whole in [file(&shots), ng] {
        assert!(!read(&whole).contents.cut_off);
        for missing in [1, 10, 40, 50] {
            let capture = read(&whole[..whole.len() - missing]);
            assert!(capture.contents.cut_off && capture.contents.frames == 1 && capture.datagrams.len() == 1, "{missing}");
        }
    }
    for (file, problem) in
        [(&file(&shots)[..20], CaptureProblem::CutOff), (&section(order)[..9], CaptureProblem::CutOff), (b"seq,", CaptureProblem::Format)]
    {
        assert_eq!(Capture::read(End::Sender, file, None).unwrap_err(), CaptureError::Unreadable { end: End::Sender, frames: 0, problem });
    }
}

#[test]
fn a_block_that_contradicts_the_format_is_refused() {
    let order = Octets::Little;
    let begin = || [section(order), interface(order, 1, 0, &[])].concat();
    let two_lengths = {
        let mut block = block(order, 0x7777, b"four");
        block[12] += 4;
        block
    };
    let too_long = {
        let mut block = enhanced(order, 0, 0, &packet(0, 1, b"one"), &[]);
        block[20] = 200;
        block
    };
    let huge = pcap(order, 0xA1B2_C3D4, 1, &[super::build::Shot { nanos: 0, octets: vec![], length: 0 }]);
    let huge = [&huge[..32], &[0xFF, 0xFF, 0xFF, 0x7F], &huge[36..]].concat();
    for (file, problem) in [
        ([begin(), two_lengths].concat(), CaptureProblem::Malformed),
        ([begin(), too_long].concat(), CaptureProblem::Malformed),
        (huge, CaptureProblem::Malformed),
        ([begin(), enhanced(order, 1, 0, &packet(0, 1, b"one"), &[])].concat(), CaptureProblem::Timestamp),
        ([section(order), interface(order, 1, 0, &[(9, &[0x7F])])].concat(), CaptureProblem::Timestamp),
    ] {
        let error = Capture::read(End::Sender, file.as_slice(), None).unwrap_err();
        assert_eq!(error, CaptureError::Unreadable { end: End::Sender, frames: 0, problem });
    }
}
