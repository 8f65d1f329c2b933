//! The three blocks of a capture, little-endian (draft-ietf-opsawg-pcapng, sections 4.1 to 4.3), and the UDP datagram in IPv4 around a payload (RFC 791, RFC 768).

use std::borrow::Cow;

const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;

const OPTION_COMMENT: u16 = 1;
const OPTION_SECTION_APPLICATION: u16 = 4;
const OPTION_INTERFACE_NAME: u16 = 2;
const OPTION_INTERFACE_RESOLUTION: u16 = 9;

/// Raw IP, IPv4 or IPv6 by its first four bits.
const LINKTYPE_RAW: u16 = 101;

pub(super) fn section_header() -> Vec<u8> {
    let mut to = Vec::new();
    block(&mut to, SECTION_HEADER, |to| {
        word(to, 0x1A2B_3C4D);
        half(to, 1);
        half(to, 0);
        // The length of the section is not known.
        to.extend(u64::MAX.to_le_bytes());
        option(to, OPTION_SECTION_APPLICATION, b"cohaptic");
        end_of_options(to);
    });
    to
}

pub(super) fn interface_description(name: &str) -> Vec<u8> {
    let mut to = Vec::new();
    block(&mut to, INTERFACE_DESCRIPTION, |to| {
        half(to, LINKTYPE_RAW);
        half(to, 0);
        // No limit to the captured length of a packet.
        word(to, 0);
        option(to, OPTION_INTERFACE_NAME, up_to(name, usize::from(u16::MAX)).as_bytes());
        // 10⁻⁹ s.
        option(to, OPTION_INTERFACE_RESOLUTION, &[9]);
        end_of_options(to);
    });
    to
}

#[expect(clippy::cast_possible_truncation, reason = "the two halves of a 64-bit count")]
pub(super) fn enhanced_packet(to: &mut Vec<u8>, nanos: u64, frame: &Frame<'_>, comment: &str) {
    block(to, ENHANCED_PACKET, |to| {
        word(to, 0);
        word(to, (nanos >> 32) as u32);
        word(to, nanos as u32);
        word(to, length(frame.captured.len()));
        word(to, length(frame.length));
        padded(to, &frame.captured);
        option(to, OPTION_COMMENT, comment.as_bytes());
        end_of_options(to);
    });
}

/// A block of that type: its length stands before and after what `body` writes.
fn block(to: &mut Vec<u8>, kind: u32, body: impl FnOnce(&mut Vec<u8>)) {
    let start = to.len();
    word(to, kind);
    word(to, 0);
    body(to);
    let whole = length(to.len() - start + 4);
    word(to, whole);
    to[start + 4..start + 8].copy_from_slice(&whole.to_le_bytes());
}

fn option(to: &mut Vec<u8>, code: u16, value: &[u8]) {
    let length = u16::try_from(value.len()).expect("names are cut at 65 535 bytes, and comments are a line");
    half(to, code);
    half(to, length);
    padded(to, value);
}

fn end_of_options(to: &mut Vec<u8>) {
    word(to, 0);
}

/// Bytes, and zeros up to the next multiple of four.
fn padded(to: &mut Vec<u8>, bytes: &[u8]) {
    to.extend_from_slice(bytes);
    to.extend_from_slice(&[0; 3][..bytes.len().next_multiple_of(4) - bytes.len()]);
}

fn word(to: &mut Vec<u8>, value: u32) {
    to.extend(value.to_le_bytes());
}

fn half(to: &mut Vec<u8>, value: u16) {
    to.extend(value.to_le_bytes());
}

fn length(bytes: usize) -> u32 {
    u32::try_from(bytes).expect("a block holds one datagram and a line of text")
}

/// The beginning of a text, of at most a number of bytes.
fn up_to(text: &str, most: usize) -> &str {
    let cut = (0..=most.min(text.len())).rev().find(|&cut| text.is_char_boundary(cut)).unwrap_or(0);
    &text[..cut]
}

const IP_HEADER: usize = 20;
const UDP_HEADER: usize = 8;
/// What the 16 bits of the IP length leave.
const LONGEST_PAYLOAD: usize = 65_535 - IP_HEADER - UDP_HEADER;

const SOURCE: [u8; 4] = [192, 0, 2, 1];
const DESTINATION: [u8; 4] = [192, 0, 2, 2];
const SOURCE_PORT: u16 = 49_152;
const DESTINATION_PORT: u16 = 49_153;
const UDP: u8 = 17;
/// RFC 3168: congestion experienced.
const CONGESTION_EXPERIENCED: u8 = 0b11;

/// A packet, or its beginning.
pub(super) struct Frame<'a> {
    pub(super) captured: Cow<'a, [u8]>,
    /// Its length when it was sent \[byte\].
    pub(super) length: usize,
}

pub(super) fn build(sequence: u64, marked: bool, payload: &[u8], size: usize) -> Frame<'static> {
    let payload_length = size.max(payload.len()).min(LONGEST_PAYLOAD);
    let payload = &payload[..payload.len().min(LONGEST_PAYLOAD)];
    let [ip_length, udp_length] = [IP_HEADER + UDP_HEADER + payload_length, UDP_HEADER + payload_length].map(sixteen_bits);

    let mut ip = [0; IP_HEADER];
    ip[0] = 0x45; // version 4, five words of header
    ip[1] = if marked { CONGESTION_EXPERIENCED } else { 0 };
    ip[2..4].copy_from_slice(&ip_length);
    ip[4..6].copy_from_slice(&sequence.to_be_bytes()[6..]);
    ip[8] = 64; // hops left
    ip[9] = UDP;
    ip[12..16].copy_from_slice(&SOURCE);
    ip[16..20].copy_from_slice(&DESTINATION);
    let checksum = !sum(0, &ip);
    ip[10..12].copy_from_slice(&checksum.to_be_bytes());

    let mut udp = [0; UDP_HEADER];
    udp[0..2].copy_from_slice(&SOURCE_PORT.to_be_bytes());
    udp[2..4].copy_from_slice(&DESTINATION_PORT.to_be_bytes());
    udp[4..6].copy_from_slice(&udp_length);
    if payload.len() == payload_length {
        let pseudo_header = [&SOURCE[..], &DESTINATION, &[0, UDP], &udp_length].concat();
        let checksum = !sum(sum(sum(0, &pseudo_header), &udp), payload);
        // Zero means "none"; the other zero of ones' complement stands for it.
        udp[6..8].copy_from_slice(&if checksum == 0 { u16::MAX } else { checksum }.to_be_bytes());
    }
    Frame { captured: [&ip[..], &udp, payload].concat().into(), length: IP_HEADER + UDP_HEADER + payload_length }
}

fn sixteen_bits(length: usize) -> [u8; 2] {
    u16::try_from(length).expect("the payload is cut").to_be_bytes()
}

/// The ones' complement sum of 16-bit words (RFC 1071); an odd byte is padded with zero.
fn sum(start: u16, bytes: &[u8]) -> u16 {
    bytes.chunks(2).fold(start, |sum, pair| {
        let word = u16::from_be_bytes([pair[0], pair.get(1).copied().unwrap_or(0)]);
        let (sum, carry) = sum.overflowing_add(word);
        sum + u16::from(carry)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_payload_has_the_checksum_that_means_none() {
        let mut other_zero = 0;
        for payload in 0..=u16::MAX {
            let Frame { captured, .. } = build(1, false, &payload.to_be_bytes(), 2);
            assert_ne!(captured[26..28], [0, 0]);
            other_zero += u32::from(captured[26..28] == [0xff, 0xff]);
        }
        // Of the 65 536 payloads, 65 535 different sums: one checksum comes twice, and one of all would be zero.
        assert!((1..=2).contains(&other_zero), "{other_zero}");
    }
}
