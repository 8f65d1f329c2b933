//! Memory of the packets of a path, for recognising retransmissions.

#[cfg(feature = "tcp")]
use std::collections::BTreeMap;
use std::collections::BTreeSet;
#[cfg(feature = "tcp")]
use std::net::SocketAddr;

#[cfg(feature = "tcp")]
use cohaptic_tcp::{Flags, Segment};

use crate::seed::hash;

/// Packets of a path so far.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// First sequence number not sent so far, by source and destination.
    #[cfg(feature = "tcp")]
    next: BTreeMap<(SocketAddr, SocketAddr), u32>,
    /// Digests of the packets of other protocols than TCP.
    digests: BTreeSet<u64>,
}

impl Seen {
    /// Notes a packet of another protocol than TCP. Returns whether a packet with the same bytes was sent before.
    pub(crate) fn note(&mut self, bytes: &[u8]) -> bool {
        !self.digests.insert(hash(bytes))
    }

    /// Notes a segment of TCP. Returns whether one of its sequence numbers was sent before.
    #[cfg(feature = "tcp")]
    pub(crate) fn note_segment(&mut self, segment: &Segment<'_>) -> bool {
        let length = segment.sequence_length();
        // A mere acknowledgement uses no sequence number, and many in a row may be equal without being retransmissions.
        if length == 0 {
            return false;
        }
        let first = segment.sequence;
        let end = first.wrapping_add(u32::try_from(length).unwrap_or(u32::MAX));
        let Some(next) = self.next.get_mut(&(segment.source, segment.destination)) else {
            self.next.insert((segment.source, segment.destination), end);
            return false;
        };
        // Half of all sequence numbers count as before a number, half as after it (RFC 9293, section 3.4). A SYN with another number begins a new connection.
        let is_before = |one: u32, other: u32| other.wrapping_sub(one).cast_signed() > 0;
        let is_new = segment.flags.has(Flags::SYN) && end != *next && !is_before(end, *next);
        let is_again = is_before(first, *next) && !is_new;
        if is_new || is_before(*next, end) {
            *next = end;
        }
        is_again
    }
}

#[cfg(test)]
mod tests {
    #[cfg(feature = "tcp")]
    use cohaptic_tcp::{Ecn, Options};

    use super::*;

    #[cfg(feature = "tcp")]
    fn segment(sequence: u32, flags: Flags, len: usize) -> Segment<'static> {
        Segment {
            source: "10.0.0.1:1".parse().unwrap(),
            destination: "10.0.0.2:2".parse().unwrap(),
            sequence,
            acknowledgement: 0,
            flags,
            window: 0,
            options: Options::default(),
            ecn: Ecn::NotCapable,
            ttl: 64,
            payload: vec![0; len].into(),
        }
    }

    #[cfg(feature = "tcp")]
    #[test]
    fn what_begins_before_the_end_of_what_was_sent_is_sent_again() {
        let mut seen = Seen::default();
        let start = u32::MAX - 50;
        let sent = [
            (segment(start, Flags::SYN, 0), false),
            (segment(start, Flags::SYN, 0), true),
            (segment(start.wrapping_add(1), Flags::ACK, 0), false),
            (segment(start.wrapping_add(1), Flags::ACK, 100), false),
            (segment(start.wrapping_add(101), Flags::ACK, 100), false),
            (segment(start.wrapping_add(1), Flags::ACK, 100), true),
            // The second half is new.
            (segment(start.wrapping_add(101), Flags::ACK, 200), true),
            (segment(start.wrapping_add(301), Flags::FIN, 0), false),
            (segment(start.wrapping_add(301), Flags::FIN, 0), true),
            // A new connection between the same ports.
            (segment(start.wrapping_add(90_000), Flags::SYN, 0), false),
            (segment(start.wrapping_add(90_001), Flags::ACK, 5), false),
        ];
        for (place, (segment, expected)) in sent.iter().enumerate() {
            assert_eq!(seen.note_segment(segment), *expected, "{place}");
        }
    }

    #[test]
    fn a_datagram_is_sent_again_if_its_bytes_are() {
        let mut seen = Seen::default();
        let sent = [&b"a"[..], b"b", b"a", b"", b"", b"ab"];
        assert_eq!(sent.map(|bytes| seen.note(bytes)), [false, false, true, false, true, false]);
    }
}
