//! Captures of both ends of a link, which are read together, and captures that are written and read back.

use std::time::Duration;

use cohaptic_capture::CaptureWriter;
use cohaptic_measure::fit::captures::{between, is_capture};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, PacketRecord};

use crate::Input;

/// The first byte says whether two captures follow, the length of the first before them, or frames that are to be written.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    if input.byte() & 1 == 0 { read(&mut input) } else { write_and_read(&mut input) }
}

fn read(input: &mut Input<'_>) {
    let split = usize::from(input.word());
    let rest = input.rest();
    // A length that is beyond the end: both captures are the same.
    let (sender, receiver) = rest.split_at_checked(split).unwrap_or((rest, rest));
    for port in [None, Some(49_153)] {
        let Ok(matched) = between(sender, receiver, port) else { continue };
        assert!(is_capture(sender) && is_capture(receiver));
        let packets = matched.measurements.packets();
        // The smallest frame with a datagram takes more bytes of the file than these, and so does each packet of a long datagram.
        assert!(!packets.is_empty() && packets.len() * 16 < sender.len());
        assert_eq!(packets.iter().filter(|packet| packet.delay_s.is_none()).count(), matched.unmatched_sent);
        assert!(matched.ambiguous <= packets.len() && matched.unmatched_arrived * 16 < receiver.len());
        for (contents, file) in [(&matched.sender, sender), (&matched.receiver, receiver)] {
            assert!(contents.frames * 16 < file.len() && contents.kinds.values().sum::<usize>() == contents.frames);
            assert!(contents.seen_again < contents.frames && contents.super_packets <= contents.frames);
        }
        assert!(matched.measurements.steps().iter().all(|step| step.packet < packets.len() && step.by_s != 0.0));
    }
}

fn write_and_read(input: &mut Input<'_>) {
    let mut writer = CaptureWriter::new(Vec::new(), "link").unwrap();
    let (mut at, mut count) = (Instant::ZERO, 0);
    while !input.is_empty() {
        let flags = input.byte();
        at = at.saturating_add(Duration::from_nanos(u64::from(input.word()) << (flags & 31)));
        let (sequence, size) = (u64::from(input.word()), u64::from(input.byte()));
        let payload = input.take(usize::try_from(size).unwrap());
        let (marked, damaged) = (flags & 32 != 0, flags & 64 != 0);
        let fate = if flags & 128 == 0 { Fate::Delivered(at) } else { Fate::Duplicated };
        let record = PacketRecord { path: (), sequence, copy: 0, offered: at, at, size: Bytes::new(size), fate, marked, damaged };
        writer.write(&record, payload).unwrap();
        // Of a datagram that holds nothing of its payload, the identification alone tells it from others.
        count += usize::from(size == 0 || !payload.is_empty() || sequence != 0);
    }
    let capture = writer.finish().unwrap();
    assert!(is_capture(&capture));
    match between(capture.as_slice(), capture.as_slice(), None) {
        Ok(matched) => {
            assert_eq!((matched.measurements.packets().len(), matched.unmatched_sent, matched.unmatched_arrived), (count, 0, 0));
            assert!(matched.measurements.packets().iter().all(|packet| packet.delay_s == Some(0.0)));
        }
        Err(error) => assert!(count == 0, "{error}"),
    }
}
