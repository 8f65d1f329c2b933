//! Joins packets into a segment.

use std::io::IoSlice;
use std::sync::Arc;

use cohaptic_linkfile::router::Protocol;

use super::{
    ACKNOWLEDGES, CWR, ECHO, FIN, NEEDS_CHECKSUM, Offload, PUSH, REDUCED, TCP_FLAGS, TCP_SEQUENCE, TCP_V4, TCP_V6, UDP, UDP_LENGTH, transport_length,
};
use crate::packet::checksum::{self, pseudo_header, sum};
use crate::packet::headers::V4_CHECKSUM;
use crate::packet::{Content, Headers, Packet};

/// Length of a segment with its headers, at most \[bytes\]: the limit of the length field of IPv4.
const LONGEST: usize = 65_535;

/// Packets in a segment, at most. Linux joins as many UDP datagrams; TCP packets of a usual size reach the longest length first.
const MOST: usize = 64;

/// Kinds of packets that a device takes joined to segments.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Join {
    /// TCP only: before version 6.2, Linux takes no UDP segments.
    Tcp,
    /// TCP and UDP.
    TcpAndUdp,
}

/// Returns how many of the first packets go to a device together, at least one. Writes the bytes before their data to `head`: a virtio header and, for more
/// than one packet, the headers of the segment.
///
/// Cutting the segment gives the same packets, except for the identification of unfragmentable IPv4 packets, which has no meaning (RFC 6864).
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

/// Returns the bytes for the device: `head`, then the data of each packet.
pub(crate) fn slices<'a>(packets: &'a [Arc<Packet>], head: &'a [u8]) -> Vec<IoSlice<'a>> {
    // A single packet has no headers in `head`, so that its slice is the whole packet.
    let headers = head.len() - Offload::LENGTH;
    let data = packets.iter().map(|packet| IoSlice::new(&packet.bytes[headers..]));
    std::iter::once(IoSlice::new(head)).chain(data).collect()
}

/// Candidate for a segment.
struct Part<'a> {
    bytes: &'a [u8],
    headers: &'a Headers,
    /// Index of the TCP or UDP header.
    transport: usize,
    /// Index of the data.
    data: usize,
}

impl<'a> Part<'a> {
    /// Returns the packet as a candidate, or `None`. A candidate has right checksums and no IP options, and ordinary TCP flags.
    fn of(packet: &'a Packet, which: Join) -> Option<Self> {
        // Packets in Ethernet frames do not begin with IP, and interfaces take no segments.
        let Content::Ip { at: 0, headers } = &packet.content else { return None };
        let bytes = packet.bytes.as_slice();
        let transport = headers.transport.filter(|at| *at == if headers.source.is_ipv4() { 20 } else { 40 })?;
        let segment = &bytes[transport..];
        let data = transport + transport_length(headers.protocol, segment)?;
        let is_plain = match headers.protocol {
            // Only flags that cutting restores, beside the acknowledgement.
            Protocol::TCP => segment[TCP_FLAGS] & !(FIN | PUSH | ECHO | CWR) == ACKNOWLEDGES,
            _ => which == Join::TcpAndUdp && usize::from(u16::from_be_bytes([segment[UDP_LENGTH], segment[UDP_LENGTH + 1]])) == segment.len(),
        };
        // A damaged IPv4 header must stay damaged, but a segment's header gets a new checksum.
        let is_header_right = !headers.source.is_ipv4() || sum(&bytes[..transport]) == 0xffff;
        let is_joinable = packet.is_checked && headers.is_whole && headers.length == bytes.len() && is_plain && is_header_right;
        is_joinable.then_some(Self { bytes, headers, transport, data })
    }

    /// Returns the TCP flags, or zero for UDP.
    fn flags(&self) -> u8 {
        if self.headers.protocol == Protocol::TCP { self.bytes[self.transport + TCP_FLAGS] } else { 0 }
    }

    /// Returns the TCP sequence number, or zero for UDP.
    fn sequence(&self) -> u32 {
        if self.headers.protocol != Protocol::TCP {
            return 0;
        }
        self.bytes[self.transport + TCP_SEQUENCE..].first_chunk().map_or(0, |bytes| u32::from_be_bytes(*bytes))
    }

    /// Returns the identification, and whether it has no meaning. IPv6 has no identification, and the identification of an unfragmentable IPv4 packet is not
    /// used.
    fn identification(&self) -> (u16, bool) {
        const DO_NOT_FRAGMENT: u8 = 0x40;
        if self.headers.source.is_ipv6() {
            (0, true)
        } else {
            (u16::from_be_bytes([self.bytes[4], self.bytes[5]]), self.bytes[6] & DO_NOT_FRAGMENT != 0)
        }
    }

    /// Returns the length of the data \[bytes\].
    fn payload(&self) -> usize {
        self.bytes.len() - self.data
    }

    /// Returns the number of packets in the segment that begins with this packet, and the last of them if there are several.
    fn joined<'b>(&self, rest: &'b [Arc<Packet>], which: Join) -> (usize, Option<Part<'b>>) {
        let (mut count, mut last, mut length, mut sequence) = (1, None, self.bytes.len(), self.sequence());
        let (identification, has_none) = self.identification();
        let (mut is_end, mut step) = (self.flags() & (FIN | PUSH) != 0, None);
        for packet in rest.iter().take(MOST - 1) {
            // FIN, PSH or a shorter packet ends a segment, because cutting gives them to the last packet only.
            let Some(next) = Part::of(packet, which).filter(|_| !is_end) else { break };
            if self.headers.protocol == Protocol::TCP {
                sequence = sequence.wrapping_add(u32::try_from(self.payload()).unwrap_or(0));
            }
            // Identifications must count up as cutting makes them. Identifications without a meaning may also be constant; the first pair decides.
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
            // Here `next` continues the segment; a break above leaves it for the next segment.
            length += next.payload();
            count += 1;
            last = Some(next);
        }
        (count, last)
    }

    /// Returns whether the headers are equal in all fields that packets of one segment share.
    fn is_alike(&self, next: &Part<'_>) -> bool {
        let same = |begin: usize, end: usize| self.bytes[begin..end] == next.bytes[begin..end];
        let of_network = if self.headers.source.is_ipv4() {
            // Compared is everything but length, identification and checksum.
            same(0, 2) && same(6, V4_CHECKSUM) && same(V4_CHECKSUM + 2, 20)
        } else {
            same(0, 4) && same(6, 40)
        };
        let at = self.transport;
        let of_transport = || {
            if self.headers.protocol == Protocol::TCP {
                // Compared is everything but sequence number and checksum. FIN and PSH may differ at the end of a segment, and CWR at its beginning.
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

    /// Writes the virtio header and the headers of the segment that begins with this packet.
    fn write(&self, packets: &[Arc<Packet>], last: &Part<'_>, head: &mut Vec<u8>) {
        // The segment has the first packet's headers once, and the data of every packet.
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
            // The checksum of the header follows the change of the length.
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
        // The field gets the sum of the pseudo-header alone: the device or its driver computes the rest.
        let pseudo = pseudo_header(&Headers { length, ..*self.headers }, at);
        bytes[at + field..at + field + 2].copy_from_slice(&pseudo.to_be_bytes());
    }
}
