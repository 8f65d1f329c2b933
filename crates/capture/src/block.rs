//! Bytes of a capture: the three kinds of pcapng blocks, little-endian (draft-ietf-opsawg-pcapng, sections 4.1 to 4.3), and a UDP datagram in IPv4 or
//! IPv6 around a payload (RFC 791, RFC 8200, RFC 768).
//!
//! The functions append to a `Vec` and know nothing of packets of an emulator: [`CaptureWriter`](super::CaptureWriter) passes numbers, bytes and comments.

use std::borrow::Cow;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;

const OPTION_COMMENT: u16 = 1;
const OPTION_SECTION_APPLICATION: u16 = 4;
const OPTION_INTERFACE_NAME: u16 = 2;
const OPTION_INTERFACE_RESOLUTION: u16 = 9;

/// Link type of frames without a link-layer header. The first four bits of a frame distinguish IPv4 from IPv6.
const LINKTYPE_RAW: u16 = 101;

/// Returns the first block of a file: byte order, version 1.0 and the name of this program.
pub(super) fn section_header() -> Vec<u8> {
    let mut to = Vec::new();
    block(&mut to, SECTION_HEADER, |to| {
        word(to, 0x1A2B_3C4D);
        half(to, 1);
        half(to, 0);
        // All ones: length of the section unknown, because the writer does not seek back.
        to.extend(u64::MAX.to_le_bytes());
        option(to, OPTION_SECTION_APPLICATION, b"cohaptic");
        end_of_options(to);
    });
    to
}

/// Returns the block of the only interface, named `name`, with timestamps in nanoseconds.
pub(super) fn interface_description(name: &str) -> Vec<u8> {
    let mut to = Vec::new();
    block(&mut to, INTERFACE_DESCRIPTION, |to| {
        half(to, LINKTYPE_RAW);
        half(to, 0);
        // Zero: no limit of the captured length.
        word(to, 0);
        option(to, OPTION_INTERFACE_NAME, up_to(name, usize::from(u16::MAX)).as_bytes());
        // Timestamps count units of 10⁻⁹ s.
        option(to, OPTION_INTERFACE_RESOLUTION, &[9]);
        end_of_options(to);
    });
    to
}

/// Appends a packet, captured `nanos` nanoseconds after 1970-01-01 00:00 UTC, with a comment.
#[expect(clippy::cast_possible_truncation, reason = "the two halves of a 64-bit count")]
pub(super) fn enhanced_packet(to: &mut Vec<u8>, nanos: u64, frame: &Frame<'_>, comment: &str) {
    block(to, ENHANCED_PACKET, |to| {
        // Index of the interface; the file describes a single interface.
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

/// Appends a block of type `kind`. The body is written by `body`. The length of the whole block stands before and after the body.
fn block(to: &mut Vec<u8>, kind: u32, body: impl FnOnce(&mut Vec<u8>)) {
    let start = to.len();
    word(to, kind);
    // Placeholder for the length, overwritten below.
    word(to, 0);
    body(to);
    // The four bytes added are the second copy of the length, not yet written.
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

/// Appends bytes, and zeros up to the next multiple of four.
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

/// Returns the longest prefix of a text of at most `most` bytes. The cut lies between two characters.
fn up_to(text: &str, most: usize) -> &str {
    let cut = (0..=most.min(text.len())).rev().find(|&cut| text.is_char_boundary(cut)).unwrap_or(0);
    &text[..cut]
}

const IP_HEADER: usize = 20;
const UDP_HEADER: usize = 8;
/// Length of the longest UDP payload \[byte\], limited by the 16 bits of the length in the IP header.
const LONGEST_PAYLOAD: usize = 65_535 - IP_HEADER - UDP_HEADER;

const UDP: u8 = 17;
const HOPS_LEFT: u8 = 64;
/// Codepoint "congestion experienced" of the ECN field (RFC 3168).
const CONGESTION_EXPERIENCED: u8 = 0b11;

/// A frame of a capture: the whole packet, or the captured beginning of the packet.
pub(super) struct Frame<'a> {
    /// Captured bytes, at most `length`.
    pub(super) captured: Cow<'a, [u8]>,
    /// Length of the packet on the link \[byte\].
    pub(super) length: usize,
}

/// Addresses in the frames of packets without known addresses (RFC 5737).
pub(super) const UNKNOWN: [SocketAddr; 2] =
    [SocketAddr::new(IpAddr::V4(Ipv4Addr::new(192, 0, 2, 1)), 49_152), SocketAddr::new(IpAddr::V4(Ipv4Addr::new(192, 0, 2, 2)), 49_153)];

/// Builds the frame of UDP datagram number `sequence` with a payload of `size` bytes, of which the first `payload.len()` bytes are known. Both ends have
/// addresses of one version of IP.
pub(super) fn build(sequence: u64, marked: bool, [source, destination]: [SocketAddr; 2], payload: &[u8], size: usize) -> Frame<'static> {
    let payload_length = size.max(payload.len()).min(LONGEST_PAYLOAD);
    // A payload shorter than `size` stays short: the frame is then marked as cut off.
    let payload = &payload[..payload.len().min(LONGEST_PAYLOAD)];
    let udp_length = sixteen_bits(UDP_HEADER + payload_length);
    let congestion = if marked { CONGESTION_EXPERIENCED } else { 0 };
    let addresses = [source, destination].map(|end| match end.ip() {
        IpAddr::V4(v4) => v4.octets().to_vec(),
        IpAddr::V6(v6) => v6.octets().to_vec(),
    });

    let ip = if source.is_ipv4() {
        let mut ip = vec![0; IP_HEADER];
        ip[0] = 0x45; // version 4, five words of header
        ip[1] = congestion;
        ip[2..4].copy_from_slice(&sixteen_bits(IP_HEADER + UDP_HEADER + payload_length));
        // The last two bytes, so the identification is the sequence number modulo 2^16.
        ip[4..6].copy_from_slice(&sequence.to_be_bytes()[6..]);
        ip[8] = HOPS_LEFT;
        ip[9] = UDP;
        ip[12..].copy_from_slice(&addresses.concat());
        let checksum = !sum(0, &ip);
        ip[10..12].copy_from_slice(&checksum.to_be_bytes());
        ip
    } else {
        // RFC 8200: version 6, the traffic class across two bytes, no flow label.
        [&[0x60, congestion << 4, 0, 0, udp_length[0], udp_length[1], UDP, HOPS_LEFT][..], &addresses.concat()].concat()
    };

    let mut udp = [0; UDP_HEADER];
    udp[0..2].copy_from_slice(&source.port().to_be_bytes());
    udp[2..4].copy_from_slice(&destination.port().to_be_bytes());
    udp[4..6].copy_from_slice(&udp_length);
    // The checksum covers the whole payload. With a cut payload the field stays zero, which means "no checksum" in IPv4.
    if payload.len() == payload_length {
        // The pseudo headers of both versions have the same sum: addresses, protocol and length.
        let pseudo_header = [&addresses.concat()[..], &[0, UDP], &udp_length].concat();
        let checksum = !sum(sum(sum(0, &pseudo_header), &udp), payload);
        // A computed zero is sent as all ones, the other zero of ones' complement, because a zero field means "no checksum".
        udp[6..8].copy_from_slice(&if checksum == 0 { u16::MAX } else { checksum }.to_be_bytes());
    }
    let length = ip.len() + UDP_HEADER + payload_length;
    Frame { captured: [&ip[..], &udp, payload].concat().into(), length }
}

fn sixteen_bits(length: usize) -> [u8; 2] {
    u16::try_from(length).expect("the payload is cut").to_be_bytes()
}

/// Adds 16-bit words in ones' complement (RFC 1071) to `start`; an odd last byte is padded with zero.
fn sum(start: u16, bytes: &[u8]) -> u16 {
    bytes.chunks(2).fold(start, |sum, pair| {
        let word = u16::from_be_bytes([pair[0], pair.get(1).copied().unwrap_or(0)]);
        let (sum, carry) = sum.overflowing_add(word);
        // The end-around carry cannot overflow: a sum with a carry is at most 0xfffe.
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
            let Frame { captured, .. } = build(1, false, UNKNOWN, &payload.to_be_bytes(), 2);
            assert_ne!(captured[26..28], [0, 0]);
            other_zero += u32::from(captured[26..28] == [0xff, 0xff]);
        }
        // The 65 536 payloads have 65 535 different sums in ones' complement, so a single checksum occurs twice. A computed zero occurs at least once.
        assert!((1..=2).contains(&other_zero), "{other_zero}");
    }
}
