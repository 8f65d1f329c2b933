//! Large segments: packets of one flow that a device gives or takes in one system call.
//!
//! ```text
//!   device ── header of virtio │ IP │ TCP │ 64 kB of data ──▶ cut ──▶ packets ──▶ link ──▶ packets ──▶ join ──▶ device
//! ```
//!
//! A link must see packets as on a wire. A segment is therefore cut into packets of the size given in the virtio header, each with its own checksums. Packets
//! that leave together are joined again if cutting the result gives exactly the same packets.

mod cut;
mod join;
#[cfg(test)]
mod tests;

use cohaptic_linkfile::router::Protocol;

pub(crate) use cut::cut;
pub use join::Join;
pub(crate) use join::{join, slices};

/// Header before each packet or segment of a device: `struct virtio_net_hdr` (Virtual I/O Device 1.2, section 5.1.6), in the byte order of the machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Offload {
    /// Bits [`NEEDS_CHECKSUM`] and [`VALID`].
    flags: u8,
    /// Kind of segment, such as [`TCP_V4`], with [`REDUCED`] as an additional bit.
    kind: u8,
    /// Length of all headers \[bytes\]. Never read, because Linux gives another number when it forwards.
    headers: u16,
    /// Bytes of data in each packet but the last.
    size: u16,
    /// Index of the first byte covered by the checksum.
    begin: u16,
    /// Index of the checksum, counted from `begin`.
    field: u16,
}

/// Flag: the checksum is left to the device, and its field holds the sum of the pseudo-header.
const NEEDS_CHECKSUM: u8 = 1;
/// Flag: the checksum was verified.
const VALID: u8 = 2;
const NO_SEGMENT: u8 = 0;
const TCP_V4: u8 = 1;
const TCP_V6: u8 = 4;
const UDP: u8 = 5;
/// Additional bit of the kind: the first packet of the segment carries CWR, "congestion window reduced" (RFC 3168).
const REDUCED: u8 = 0x80;

impl Offload {
    /// Length of the header \[bytes\].
    const LENGTH: usize = 10;

    /// Splits bytes into the header and the rest, or returns `None` if the header is incomplete.
    fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (header, packet) = bytes.split_first_chunk::<{ Self::LENGTH }>()?;
        let word = |at: usize| u16::from_ne_bytes([header[at], header[at + 1]]);
        Some((Self { flags: header[0], kind: header[1], headers: word(2), size: word(4), begin: word(6), field: word(8) }, packet))
    }

    /// Appends the header to `into`.
    fn write(self, into: &mut Vec<u8>) {
        into.extend([self.flags, self.kind]);
        into.extend([self.headers, self.size, self.begin, self.field].map(u16::to_ne_bytes).as_flattened());
    }
}

/// Bits in the flags of a TCP header.
const FIN: u8 = 0x01;
const PUSH: u8 = 0x08;
const ACKNOWLEDGES: u8 = 0x10;
const ECHO: u8 = 0x40;
const CWR: u8 = 0x80;
const TCP_SEQUENCE: usize = 4;
const TCP_OFFSET: usize = 12;
const TCP_FLAGS: usize = 13;
const UDP_LENGTH: usize = 4;

/// Returns the length of a TCP or UDP header \[bytes\], or `None` unless the header is complete and data follows.
fn transport_length(protocol: Protocol, segment: &[u8]) -> Option<usize> {
    let length = match protocol {
        Protocol::TCP => Some(usize::from(*segment.get(TCP_OFFSET)? >> 4) * 4).filter(|length| *length >= 20)?,
        Protocol::UDP => 8,
        _ => return None,
    };
    (length < segment.len()).then_some(length)
}
