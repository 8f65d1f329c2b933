//! From a segment to its packets.

use cohaptic_linkfile::router::Protocol;

use super::{
    CWR, FIN, NEEDS_CHECKSUM, NO_SEGMENT, Offload, PUSH, REDUCED, TCP_FLAGS, TCP_SEQUENCE, TCP_V4, TCP_V6, UDP, UDP_LENGTH, VALID, transport_length,
};
use crate::packet::checksum::{self, fold, pseudo_header, sum};
use crate::packet::headers::V4_CHECKSUM;
use crate::packet::{Content, Headers, Malformed, Packet};

/// Appends the packets of what a device gave, a header of virtio and a packet or a segment. What contradicts itself is one malformed packet.
pub(crate) fn cut(bytes: &[u8], packets: &mut Vec<Packet>) {
    let malformed = |malformed, bytes: &[u8]| Packet { bytes: bytes.to_vec(), content: Content::Malformed(malformed), is_checked: false };
    let Some((offload, packet)) = Offload::read(bytes) else { return packets.push(malformed(Malformed::Offload, bytes)) };
    let headers = match Headers::read(packet) {
        Ok(headers) => headers,
        Err(error) => return packets.push(malformed(error, packet)),
    };
    if offload.kind == NO_SEGMENT {
        let whole = alone(offload, packet, headers).unwrap_or_else(|error| malformed(error, packet));
        return packets.push(whole);
    }
    match Segment::read(offload, packet, headers) {
        Some(segment) => packets.extend(segment.packets()),
        None => packets.push(malformed(Malformed::Offload, packet)),
    }
}

/// A packet that is no segment.
fn alone(offload: Offload, packet: &[u8], headers: Headers) -> Result<Packet, Malformed> {
    let mut bytes = packet.to_vec();
    let (begin, field) = offload.field();
    let mut is_checked = offload.flags & VALID != 0;
    if offload.flags & NEEDS_CHECKSUM != 0 {
        let pseudo: [u8; 2] = *bytes.get(field..).and_then(|rest| rest.first_chunk()).ok_or(Malformed::Offload)?;
        is_checked = headers.transport == Some(begin)
            && headers.transport.zip(checksum::offset(headers.protocol)).is_some_and(|(at, offset)| at + offset == field)
            && u16::from_be_bytes(pseudo) == pseudo_header(&headers, begin);
        let value = checksum::of_sum(headers.protocol, sum(&bytes[begin..]));
        bytes[field..field + 2].copy_from_slice(&value.to_be_bytes());
    }
    Ok(Packet { bytes, content: Content::Ip { at: 0, headers }, is_checked })
}

impl Offload {
    /// Where the checksum begins to count, and where its field is.
    fn field(self) -> (usize, usize) {
        (self.begin.into(), usize::from(self.begin) + usize::from(self.field))
    }
}

/// A segment whose header and packet agree.
struct Segment<'a> {
    packet: &'a [u8],
    headers: Headers,
    /// Where the header of TCP or UDP begins, and where its data.
    transport: usize,
    data: usize,
    /// Where its checksum is.
    field: usize,
    /// The bytes of data in each packet but the last.
    size: usize,
    is_checked: bool,
}

impl<'a> Segment<'a> {
    fn read(offload: Offload, packet: &'a [u8], headers: Headers) -> Option<Self> {
        let is_v4 = headers.source.is_ipv4();
        let is_kind = match offload.kind & !REDUCED {
            TCP_V4 => is_v4 && headers.protocol == Protocol::TCP,
            TCP_V6 => !is_v4 && headers.protocol == Protocol::TCP,
            UDP => headers.protocol == Protocol::UDP,
            _ => false,
        };
        let (transport, size) = (headers.transport?, usize::from(offload.size));
        let data = transport + transport_length(headers.protocol, &packet[transport..])?;
        let field = transport + checksum::offset(headers.protocol)?;
        let agrees = is_kind
            && headers.is_whole
            && headers.length == packet.len()
            && size > 0
            && offload.flags & NEEDS_CHECKSUM != 0
            && offload.field() == (transport, field);
        let is_checked = u16::from_be_bytes([packet[field], packet[field + 1]]) == pseudo_header(&headers, transport);
        agrees.then_some(Self { packet, headers, transport, data, field, size, is_checked })
    }

    fn packets(&self) -> impl Iterator<Item = Packet> + '_ {
        let head = &self.packet[..self.data];
        let chunks = self.packet[self.data..].chunks(self.size);
        let last = chunks.len() - 1;
        chunks.enumerate().map(move |(number, data)| {
            let mut bytes = Vec::with_capacity(self.data + data.len());
            bytes.extend_from_slice(head);
            bytes.extend_from_slice(data);
            self.number(&mut bytes, number, number == last);
            let headers = Headers { length: bytes.len(), ..self.headers };
            Packet { bytes, content: Content::Ip { at: 0, headers }, is_checked: self.is_checked }
        })
    }

    /// Makes the headers of the segment those of one of its packets.
    fn number(&self, bytes: &mut [u8], number: usize, is_last: bool) {
        let length = bytes.len();
        if self.headers.source.is_ipv4() {
            let identification = u16::from_be_bytes([bytes[4], bytes[5]]).wrapping_add(low(number));
            bytes[2..4].copy_from_slice(&low(length).to_be_bytes());
            bytes[4..6].copy_from_slice(&identification.to_be_bytes());
            bytes[V4_CHECKSUM..V4_CHECKSUM + 2].fill(0);
            let checksum = !sum(&bytes[..self.headers.covered]);
            bytes[V4_CHECKSUM..V4_CHECKSUM + 2].copy_from_slice(&checksum.to_be_bytes());
        } else {
            bytes[4..6].copy_from_slice(&low(length - self.headers.covered).to_be_bytes());
        }
        let segment = &mut bytes[self.transport..];
        let (old, new) = (self.packet.len() - self.transport, segment.len());
        if self.headers.protocol == Protocol::TCP {
            // Sequence numbers go round.
            let begin = number * self.size;
            if let Some(sequence) = segment[TCP_SEQUENCE..].first_chunk_mut::<4>() {
                *sequence = u32::from_be_bytes(*sequence).wrapping_add(u32::try_from(begin).unwrap_or(0)).to_be_bytes();
            }
            if number > 0 {
                segment[TCP_FLAGS] &= !CWR;
            }
            if !is_last {
                segment[TCP_FLAGS] &= !(FIN | PUSH);
            }
        } else {
            segment[UDP_LENGTH..UDP_LENGTH + 2].copy_from_slice(&low(new).to_be_bytes());
        }
        // The field holds the sum of a pseudo-header with the length of the segment: with it the sum is that of both, but for that length.
        let total = u64::from(sum(segment)) + u64::from(!low(old)) + u64::from(low(new));
        let checksum = checksum::of_sum(self.headers.protocol, fold(total));
        bytes[self.field..self.field + 2].copy_from_slice(&checksum.to_be_bytes());
    }
}

/// The low 16 bits.
fn low(number: usize) -> u16 {
    u16::try_from(number & 0xffff).unwrap_or(0)
}
