//! Large segments: packets of one flow that a device gives, or takes, with one system call.
//!
//! ```text
//!   device ── header of virtio │ IP │ TCP │ 64 kB of data ──▶ cut ──▶ packets ──▶ link ──▶ packets ──▶ join ──▶ device
//! ```
//!
//! A link meets packets as they would be on a wire. A segment is cut into packets of the size that its header asks for, each with its checksums, and packets
//! that leave at the same time are joined again where cutting gives the very same packets.

mod cut;
mod join;
#[cfg(test)]
mod tests;

use cohaptic_linkfile::router::Protocol;

pub(crate) use cut::cut;
pub(crate) use join::{Join, join, slices};

/// What a device says of the bytes behind it, and is told: `struct virtio_net_hdr` (Virtual I/O Device 1.2, section 5.1.6), in the byte order of the machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Offload {
    flags: u8,
    kind: u8,
    /// The bytes of all headers. Linux says something else when it forwards, so nothing believes it.
    headers: u16,
    /// The bytes of data in each packet but the last.
    size: u16,
    /// Where the checksum begins to count.
    begin: u16,
    /// Where its field is, counted from there.
    field: u16,
}

/// The checksum is left to the device: its field holds the sum of the pseudo-header.
const NEEDS_CHECKSUM: u8 = 1;
/// The checksum was found to be right.
const VALID: u8 = 2;
const NO_SEGMENT: u8 = 0;
const TCP_V4: u8 = 1;
const TCP_V6: u8 = 4;
const UDP: u8 = 5;
/// Beside the kind: the first packet of the segment says that the sender has reduced its window (RFC 3168).
const REDUCED: u8 = 0x80;

impl Offload {
    const LENGTH: usize = 10;

    fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (header, packet) = bytes.split_first_chunk::<{ Self::LENGTH }>()?;
        let word = |at: usize| u16::from_ne_bytes([header[at], header[at + 1]]);
        Some((Self { flags: header[0], kind: header[1], headers: word(2), size: word(4), begin: word(6), field: word(8) }, packet))
    }

    fn write(self, into: &mut Vec<u8>) {
        into.extend([self.flags, self.kind]);
        into.extend([self.headers, self.size, self.begin, self.field].map(u16::to_ne_bytes).as_flattened());
    }
}

/// The bits of TCP's byte of flags.
const FIN: u8 = 0x01;
const PUSH: u8 = 0x08;
const ACKNOWLEDGES: u8 = 0x10;
const ECHO: u8 = 0x40;
const CWR: u8 = 0x80;
const TCP_SEQUENCE: usize = 4;
const TCP_OFFSET: usize = 12;
const TCP_FLAGS: usize = 13;
const UDP_LENGTH: usize = 4;

/// The bytes of the header of TCP or UDP, which is whole and shorter than its packet.
fn transport_length(protocol: Protocol, segment: &[u8]) -> Option<usize> {
    let length = match protocol {
        Protocol::TCP => Some(usize::from(*segment.get(TCP_OFFSET)? >> 4) * 4).filter(|length| *length >= 20)?,
        Protocol::UDP => 8,
        _ => return None,
    };
    (length < segment.len()).then_some(length)
}
