//! Segments of TCP in packets of IP: a packet that is read is written and read back as the same segment.

use cohaptic_tcp::Segment;

use crate::internet;

/// The first byte says whether lengths and checksums are made right. The rest is a packet.
pub fn run(data: &[u8]) {
    let Some((mode, packet)) = data.split_first() else { return };
    let mut packet = packet.to_vec();
    if mode & 1 == 1 {
        internet::repair(&mut packet, false);
    }
    let Ok(segment) = Segment::parse(&packet) else { return };
    assert!(segment.payload.len() <= packet.len() && segment.sequence_length() <= segment.payload.len() + 2);
    // Options that nobody knows are not written again, and selective acknowledgements where there is room.
    let mut segment = segment.into_owned();
    let too_long = segment.packet_length().saturating_sub(usize::from(u16::MAX));
    if too_long > 0 {
        segment.payload = segment.payload[..segment.payload.len() - too_long].to_vec().into();
    }
    let written = segment.to_packet();
    assert_eq!(written.len(), segment.packet_length());
    assert!(internet::is_right(&written));
    let read = Segment::parse(&written).unwrap();
    segment.options.sack.truncate(read.options.sack.as_slice().len());
    assert_eq!(read, segment);
}
