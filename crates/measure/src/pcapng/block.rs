//! The three blocks of a capture, little-endian (draft-ietf-opsawg-pcapng, sections 4.1 to 4.3).

use super::datagram::Datagram;

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
pub(super) fn enhanced_packet(to: &mut Vec<u8>, nanos: u64, datagram: &Datagram, comment: &str) {
    block(to, ENHANCED_PACKET, |to| {
        word(to, 0);
        word(to, (nanos >> 32) as u32);
        word(to, nanos as u32);
        word(to, length(datagram.captured.len()));
        word(to, length(datagram.length));
        padded(to, &datagram.captured);
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
