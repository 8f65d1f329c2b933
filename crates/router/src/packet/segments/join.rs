//! From packets to a segment.

use std::io::IoSlice;
use std::sync::Arc;

use cohaptic_linkfile::router::Protocol;

use super::{
    ACKNOWLEDGES, CWR, ECHO, FIN, NEEDS_CHECKSUM, Offload, PUSH, REDUCED, TCP_FLAGS, TCP_SEQUENCE, TCP_V4, TCP_V6, UDP, UDP_LENGTH, transport_length,
};
use crate::packet::checksum::{self, pseudo_header, sum};
use crate::packet::headers::V4_CHECKSUM;
use crate::packet::{Content, Headers, Packet};

/// The longest segment, with its headers: what the length of IPv4 can say.
const LONGEST: usize = 65_535;

/// The most packets in a segment. Linux joins as many of UDP; of TCP, packets of a usual size fill the length before.
const MOST: usize = 64;

/// Which packets may be joined.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Join {
    /// Those of TCP. Linux takes no segments of UDP before 6.2.
    Tcp,
    /// Those of TCP and of UDP.
    TcpAndUdp,
}

/// Says how many of the first packets go to a device together, at least one, and writes what stands before their data: a header of virtio and, if there is
/// more than one packet, the headers of the segment.
///
/// Cutting the segment gives the same packets, but for the identification of packets of IPv4 that must not be cut further, which has no meaning (RFC 6864).
pub(crate) fn join(packets: &[Arc<Packet>], which: Join, head: &mut Vec<u8>) -> usize {
    head.clear();
    let first = packets.first().and_then(|packet| Part::of(packet, which));
    let (count, last) = first.as_ref().map_or((1, None), |first| first.joined(&packets[1..], which));
    match (first, last) {
        (Some(first), Some(last)) => first.write(&packets[..count], &last, head),
        _ => Offload::default().write(head),
    }
    count
}

/// What goes to the device behind the headers.
pub(crate) fn slices<'a>(packets: &'a [Arc<Packet>], head: &'a [u8]) -> Vec<IoSlice<'a>> {
    let headers = head.len() - Offload::LENGTH;
    let data = packets.iter().map(|packet| IoSlice::new(&packet.bytes[headers..]));
    std::iter::once(IoSlice::new(head)).chain(data).collect()
}

/// A packet that may be one of a segment.
struct Part<'a> {
    bytes: &'a [u8],
    headers: &'a Headers,
    transport: usize,
    /// Where the data begins.
    data: usize,
}

impl<'a> Part<'a> {
    /// A packet whose checksums are known to be right, without options of IP, whose header says nothing out of the ordinary.
    fn of(packet: &'a Packet, which: Join) -> Option<Self> {
        let Content::Ip { at: 0, headers } = &packet.content else { return None };
        let bytes = packet.bytes.as_slice();
        let transport = headers.transport.filter(|at| *at == if headers.source.is_ipv4() { 20 } else { 40 })?;
        let segment = &bytes[transport..];
        let data = transport + transport_length(headers.protocol, segment)?;
        let is_plain = match headers.protocol {
            Protocol::TCP => segment[TCP_FLAGS] & !(FIN | PUSH | ECHO | CWR) == ACKNOWLEDGES,
            _ => which == Join::TcpAndUdp && usize::from(u16::from_be_bytes([segment[UDP_LENGTH], segment[UDP_LENGTH + 1]])) == segment.len(),
        };
        let is_header_right = !headers.source.is_ipv4() || sum(&bytes[..transport]) == 0xffff;
        let is_joinable = packet.is_checked && headers.is_whole && headers.length == bytes.len() && is_plain && is_header_right;
        is_joinable.then_some(Self { bytes, headers, transport, data })
    }

    fn flags(&self) -> u8 {
        if self.headers.protocol == Protocol::TCP { self.bytes[self.transport + TCP_FLAGS] } else { 0 }
    }

    fn sequence(&self) -> u32 {
        if self.headers.protocol != Protocol::TCP {
            return 0;
        }
        self.bytes[self.transport + TCP_SEQUENCE..].first_chunk().map_or(0, |bytes| u32::from_be_bytes(*bytes))
    }

    /// The identification, and whether it has no meaning: IPv6 has none, and that of a packet that must not be cut is not looked at.
    fn identification(&self) -> (u16, bool) {
        const DO_NOT_FRAGMENT: u8 = 0x40;
        if self.headers.source.is_ipv6() {
            (0, true)
        } else {
            (u16::from_be_bytes([self.bytes[4], self.bytes[5]]), self.bytes[6] & DO_NOT_FRAGMENT != 0)
        }
    }

    fn payload(&self) -> usize {
        self.bytes.len() - self.data
    }

    /// How many packets the segment has that begins with this one, and the last of them, if that is another.
    fn joined<'b>(&self, rest: &'b [Arc<Packet>], which: Join) -> (usize, Option<Part<'b>>) {
        let (mut count, mut last, mut length, mut sequence) = (1, None, self.bytes.len(), self.sequence());
        let (identification, has_none) = self.identification();
        let (mut is_end, mut step) = (self.flags() & (FIN | PUSH) != 0, None);
        for packet in rest.iter().take(MOST - 1) {
            let Some(next) = Part::of(packet, which).filter(|_| !is_end) else { break };
            if self.headers.protocol == Protocol::TCP {
                sequence = sequence.wrapping_add(u32::try_from(self.payload()).unwrap_or(0));
            }
            let found = next.identification().0.wrapping_sub(identification);
            let step = *step.get_or_insert(if found == 0 && has_none { 0 } else { 1 });
            let is_next = self.is_alike(&next)
                && next.sequence() == sequence
                && usize::from(found) == count * step
                && next.payload() <= self.payload()
                && length + next.payload() <= LONGEST;
            if !is_next {
                break;
            }
            is_end = next.flags() & (FIN | PUSH) != 0 || next.payload() < self.payload();
            length += next.payload();
            count += 1;
            last = Some(next);
        }
        (count, last)
    }

    /// Whether the headers are the same but for what differs from one packet of a segment to the next.
    fn is_alike(&self, next: &Part<'_>) -> bool {
        let same = |begin: usize, end: usize| self.bytes[begin..end] == next.bytes[begin..end];
        let of_network = if self.headers.source.is_ipv4() {
            // Not the length, the identification and the checksum.
            same(0, 2) && same(6, V4_CHECKSUM) && same(V4_CHECKSUM + 2, 20)
        } else {
            same(0, 4) && same(6, 40)
        };
        let at = self.transport;
        let of_transport = || {
            if self.headers.protocol == Protocol::TCP {
                // Not the sequence number and the checksum; of the flags, not those that begin or end a segment.
                let flags = self.flags() ^ (next.flags() & !(FIN | PUSH));
                same(at, at + 4)
                    && same(at + 8, at + 13)
                    && flags & !CWR == 0
                    && next.flags() & CWR == 0
                    && same(at + 14, at + 16)
                    && same(at + 18, self.data)
            } else {
                same(at, at + 4)
            }
        };
        self.transport == next.transport && self.data == next.data && self.headers.protocol == next.headers.protocol && of_network && of_transport()
    }

    /// Writes the headers of the segment that begins with this packet.
    fn write(&self, packets: &[Arc<Packet>], last: &Part<'_>, head: &mut Vec<u8>) {
        let length = self.bytes.len() + packets[1..].iter().map(|packet| packet.bytes.len() - self.data).sum::<usize>();
        let word = |number: usize| u16::try_from(number).unwrap_or(u16::MAX);
        let (is_v4, is_tcp) = (self.headers.source.is_ipv4(), self.headers.protocol == Protocol::TCP);
        let field = checksum::offset(self.headers.protocol).unwrap_or(0);
        let kind = match (is_tcp, is_v4) {
            (true, true) => TCP_V4,
            (true, false) => TCP_V6,
            (false, _) => UDP,
        };
        let reduced = if self.flags() & CWR != 0 { REDUCED } else { 0 };
        let (headers, size, begin) = (word(self.data), word(self.payload()), word(self.transport));
        Offload { flags: NEEDS_CHECKSUM, kind: kind | reduced, headers, size, begin, field: word(field) }.write(head);
        head.extend_from_slice(&self.bytes[..self.data]);
        let bytes = &mut head[Offload::LENGTH..];
        if is_v4 {
            let old = u16::from_be_bytes([bytes[2], bytes[3]]);
            bytes[2..4].copy_from_slice(&word(length).to_be_bytes());
            checksum::change(bytes, V4_CHECKSUM, old, word(length));
        } else {
            bytes[4..6].copy_from_slice(&word(length - self.transport).to_be_bytes());
        }
        let at = self.transport;
        if is_tcp {
            bytes[at + TCP_FLAGS] |= last.flags() & (FIN | PUSH);
        } else {
            bytes[at + UDP_LENGTH..at + UDP_LENGTH + 2].copy_from_slice(&word(length - at).to_be_bytes());
        }
        let pseudo = pseudo_header(&Headers { length, ..*self.headers }, at);
        bytes[at + field..at + field + 2].copy_from_slice(&pseudo.to_be_bytes());
    }
}
