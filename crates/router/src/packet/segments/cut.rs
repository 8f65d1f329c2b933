//! Cuts a segment into its packets.

use cohaptic_linkfile::router::Protocol;

use super::{
    CWR, FIN, NEEDS_CHECKSUM, NO_SEGMENT, Offload, PUSH, REDUCED, TCP_FLAGS, TCP_SEQUENCE, TCP_V4, TCP_V6, UDP, UDP_LENGTH, VALID, transport_length,
};
use crate::packet::checksum::{self, fold, pseudo_header, sum};
use crate::packet::headers::V4_CHECKSUM;
use crate::packet::{Content, Headers, Malformed, Packet};

/// Appends the packets in the bytes of a device: a virtio header, and a packet or a segment. Bytes that contradict themselves become one malformed packet.
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

/// Returns `packet` as it is, for bytes that hold a single packet and no segment to cut. Computes the checksum if the sender left the checksum to the device.
fn alone(offload: Offload, packet: &[u8], headers: Headers) -> Result<Packet, Malformed> {
    let mut bytes = packet.to_vec();
    let (begin, field) = offload.field();
    let mut is_checked = offload.flags & VALID != 0;
    if offload.flags & NEEDS_CHECKSUM != 0 {
        let pseudo: [u8; 2] = *bytes.get(field..).and_then(|rest| rest.first_chunk()).ok_or(Malformed::Offload)?;
        // The packet is known to be right only if the checksum is the transport protocol's own, over the right pseudo-header. Another checksum is computed all
        // the same.
        is_checked = headers.transport == Some(begin)
            && headers.transport.zip(checksum::offset(headers.protocol)).is_some_and(|(at, offset)| at + offset == field)
            && u16::from_be_bytes(pseudo) == pseudo_header(&headers, begin);
        let value = checksum::of_sum(headers.protocol, sum(&bytes[begin..]));
        bytes[field..field + 2].copy_from_slice(&value.to_be_bytes());
    }
    Ok(Packet { bytes, content: Content::Ip { at: 0, headers }, is_checked })
}

impl Offload {
    /// Returns the index of the first byte covered by the checksum, and the index of the checksum.
    fn field(self) -> (usize, usize) {
        (self.begin.into(), usize::from(self.begin) + usize::from(self.field))
    }
}

/// Segment whose virtio header agrees with its packet.
struct Segment<'a> {
    packet: &'a [u8],
    headers: Headers,
    /// Index of the TCP or UDP header.
    transport: usize,
    /// Index of the data.
    data: usize,
    /// Index of the checksum.
    field: usize,
    /// Bytes of data in each packet but the last.
    size: usize,
    /// `true` if the checksum field held the right sum of the pseudo-header.
    is_checked: bool,
}

impl<'a> Segment<'a> {
    /// Returns the segment, or `None` if the virtio header contradicts the packet.
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
        // Cutting relies on every condition: a whole packet, a size above zero, and a checksum at the place of its protocol.
        let agrees = is_kind
            && headers.is_whole
            && headers.length == packet.len()
            && size > 0
            && offload.flags & NEEDS_CHECKSUM != 0
            && offload.field() == (transport, field);
        let is_checked = u16::from_be_bytes([packet[field], packet[field + 1]]) == pseudo_header(&headers, transport);
        agrees.then_some(Self { packet, headers, transport, data, field, size, is_checked })
    }

    /// Returns the packets of the segment, in order.
    fn packets(&self) -> impl Iterator<Item = Packet> + '_ {
        // `read` has checked `data` against the length of the packet.
        let head = &self.packet[..self.data];
        let chunks = self.packet[self.data..].chunks(self.size);
        // `transport_length` allows no header without data, so there is at least one chunk.
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

    /// Turns a copy of the segment's headers in `bytes` into the headers of packet `number`, counted from zero.
    fn number(&self, bytes: &mut [u8], number: usize, is_last: bool) {
        let length = bytes.len();
        if self.headers.source.is_ipv4() {
            // Linux counts the identification up from packet to packet of a segment.
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
            // The sequence number of the first byte of this packet's data, modulo 2³².
            let begin = number * self.size;
            if let Some(sequence) = segment[TCP_SEQUENCE..].first_chunk_mut::<4>() {
                *sequence = u32::from_be_bytes(*sequence).wrapping_add(u32::try_from(begin).unwrap_or(0)).to_be_bytes();
            }
            // CWR belongs to the first packet only, and FIN and PSH belong to the last.
            if number > 0 {
                segment[TCP_FLAGS] &= !CWR;
            }
            if !is_last {
                segment[TCP_FLAGS] &= !(FIN | PUSH);
            }
        } else {
            segment[UDP_LENGTH..UDP_LENGTH + 2].copy_from_slice(&low(new).to_be_bytes());
        }
        // The field holds the sum of a pseudo-header with the length of the whole segment. The sum over the packet thus includes that pseudo-header, and only
        // its length must be replaced.
        let total = u64::from(sum(segment)) + u64::from(!low(old)) + u64::from(low(new));
        let checksum = checksum::of_sum(self.headers.protocol, fold(total));
        bytes[self.field..self.field + 2].copy_from_slice(&checksum.to_be_bytes());
    }
}

/// Returns the lower 16 bits.
fn low(number: usize) -> u16 {
    u16::try_from(number & 0xffff).unwrap_or(0)
}
