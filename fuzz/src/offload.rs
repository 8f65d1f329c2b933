//! Large segments of a device: cut into packets, and joined again.

use std::sync::Arc;

use cohaptic_router::fuzzing::{cut, join};
use cohaptic_router::{Content, Packet};

use crate::internet;

/// The header that a device puts before a packet \[byte\].
const VIRTIO: usize = 10;

/// The first byte says whether lengths and checksums are made right. The rest is a header of virtio, and a packet or a segment.
pub fn run(data: &[u8]) {
    let Some((mode, bytes)) = data.split_first() else { return };
    let mut bytes = bytes.to_vec();
    let is_repaired = mode & 1 == 1;
    if is_repaired && bytes.len() > VIRTIO {
        internet::repair(&mut bytes[VIRTIO..], true);
    }
    let packets = cut(&bytes);
    assert!(!packets.is_empty() && packets.len() <= bytes.len().max(1));
    let are_packets = packets.iter().all(|packet| matches!(packet.content(), Content::Ip { .. }));
    assert!(are_packets || packets.len() == 1);
    if is_repaired && packets.len() > 1 {
        assert!(packets.iter().all(|packet| internet::is_right(packet.bytes())), "a packet of a segment has a wrong checksum");
    }
    let packets: Vec<Arc<Packet>> = packets.into_iter().map(Arc::new).collect();
    let mut rest = packets.as_slice();
    while !rest.is_empty() {
        let (count, joined) = join(rest);
        assert!((1..=rest.len()).contains(&count) && joined.len() <= VIRTIO + (1 << 16));
        let again = cut(&joined);
        assert_eq!(again.len(), count);
        for (found, expected) in again.iter().zip(rest) {
            assert!(is_same(found.bytes(), expected.bytes()), "{found:?} in place of {expected:?}");
        }
        rest = &rest[count..];
    }
}

/// Returns whether two packets are equal but for the identification of IPv4, with its checksum, where the packet must not be cut further (RFC 6864).
fn is_same(found: &[u8], expected: &[u8]) -> bool {
    let is_ignored = |place: usize| expected[0] >> 4 == 4 && expected.len() > 6 && expected[6] & 0x40 != 0 && [4, 5, 10, 11].contains(&place);
    found.len() == expected.len() && found.iter().zip(expected).enumerate().all(|(place, (found, expected))| found == expected || is_ignored(place))
}
