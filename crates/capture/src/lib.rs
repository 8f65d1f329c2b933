//! Writes fates of packets as a capture file (pcapng, draft-ietf-opsawg-pcapng), for packet analysers.
//!
//! Use this crate if you want to look at the packets of an emulated link in Wireshark or tshark.
//!
//! A [`CaptureWriter`] writes each record as a frame at the instant of the fate, with the fate as the frame's comment:
//!
//! ```text
//! packet 17 delivered after 24.1ms, copy 1, marked
//! packet 18 dropped: queue-full
//! packet 19 duplicated
//! packet 20 dropped on the uplink: loss
//! ```
//!
//! In an analyser, the filter `frame.comment contains "dropped"` then shows the lost packets. The frames are raw IPv4 (`LINKTYPE_RAW`) with UDP, with both
//! checksums, from 192.0.2.1:49152 to 192.0.2.2:49153 (RFC 5737: addresses of documentation). The IP identification is the number of the packet modulo 2¹⁶.
//! A congestion mark is the CE codepoint. A packet with known headers is written unchanged ([`CaptureWriter::write_packet`]),
//! and a datagram with known addresses has these addresses ([`CaptureWriter::write_datagram`]). Time zero is 1970-01-01 00:00
//! UTC, and timestamps count nanoseconds.
//!
//! ```
//! use cohaptic_capture::CaptureWriter;
//! use cohaptic_wan::FateLog;
//!
//! let log = FateLog::parse(
//!     "sequence,copy,offered_ns,size,at_ns,fate,marked,damaged\n\
//!      0,0,0,5,24000000,delivered,0,0\n",
//! )?;
//! let mut capture = CaptureWriter::new(Vec::new(), "left -> right")?;
//! for record in log.records() {
//!     capture.write(record, b"hello")?;
//! }
//! let file = capture.finish()?;
//! // Every pcapng file begins with the type of its section header.
//! assert_eq!(file[..4], [0x0a, 0x0d, 0x0d, 0x0a]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod block;

use std::fmt;
use std::io::{self, Write};
use std::net::SocketAddr;

use cohaptic_units::Instant;
use cohaptic_units::print::Span;
use cohaptic_wan::{Fate, PacketRecord, PathPart};

/// Writes records as frames, in the order of the calls.
///
/// Pass a [`std::io::BufWriter`], since each frame is a write of its own. Call [`CaptureWriter::finish`] to learn of errors of the last frames.
#[derive(Debug)]
pub struct CaptureWriter<W> {
    /// Destination of the file.
    to: W,
    /// Buffer of a single block, kept to avoid an allocation per frame.
    block: Vec<u8>,
}

impl<W: Write> CaptureWriter<W> {
    /// Begins a capture with a single interface named `interface`, for instance with the name of the link. The name is cut at 65 535 bytes.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn new(mut to: W, interface: &str) -> io::Result<Self> {
        to.write_all(&block::section_header())?;
        to.write_all(&block::interface_description(interface))?;
        Ok(Self { to, block: Vec::new() })
    }

    /// Writes a frame for a packet with known bytes: IPv4 or IPv6 from the first octet on, unchanged. The path of the record is the part of the path in which
    /// the fate occurred, or nothing for the link.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn write_packet(&mut self, record: &PacketRecord<impl Copy + Into<PathPart>>, packet: &[u8]) -> io::Result<()> {
        self.write_frame(record, &block::Frame { captured: packet.into(), length: packet.len() })
    }

    /// Writes a frame for a packet with known bytes that is sent at `at`, and whose fate is not known yet.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn write_sent(&mut self, at: Instant, packet: &[u8]) -> io::Result<()> {
        self.block.clear();
        block::enhanced_packet(&mut self.block, at.as_nanos(), &block::Frame { captured: packet.into(), length: packet.len() }, "sent");
        self.to.write_all(&self.block)
    }

    /// Writes a frame for a packet without known headers. `payload` has the known bytes of the packet. If `payload` is shorter than [`PacketRecord::size`],
    /// the frame is marked as cut off and has no UDP checksum. A UDP payload has at most 65 507 bytes; the rest of a larger packet is not written.
    /// The path of the record is as for [`CaptureWriter::write_packet`].
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn write(&mut self, record: &PacketRecord<impl Copy + Into<PathPart>>, payload: &[u8]) -> io::Result<()> {
        self.write_datagram(record, block::UNKNOWN, payload)
    }

    /// Writes a frame as [`CaptureWriter::write`], for a datagram with known source and destination, both of one version of IP.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn write_datagram(&mut self, record: &PacketRecord<impl Copy + Into<PathPart>>, ends: [SocketAddr; 2], payload: &[u8]) -> io::Result<()> {
        let size = usize::try_from(record.size.get()).unwrap_or(usize::MAX);
        let datagram = block::build(record.sequence, record.marked, ends, payload, size);
        self.write_frame(record, &datagram)
    }

    fn write_frame(&mut self, record: &PacketRecord<impl Copy + Into<PathPart>>, frame: &block::Frame<'_>) -> io::Result<()> {
        self.block.clear();
        block::enhanced_packet(&mut self.block, record.at.as_nanos(), frame, &Comment(record.with_path(record.path.into())).to_string());
        self.to.write_all(&self.block)
    }

    /// Ends the capture: flushes the writer and returns the writer.
    ///
    /// # Errors
    ///
    /// The errors of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        self.to.flush()?;
        Ok(self.to)
    }
}

/// Comment of a frame: the fate of the packet in words.
struct Comment(PacketRecord<PathPart>);

impl fmt::Display for Comment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let record = &self.0;
        write!(f, "packet {} ", record.sequence)?;
        match record.fate {
            Fate::Delivered(at) => write!(f, "delivered after {}", Span(at.saturating_duration_since(record.offered)))?,
            Fate::Dropped(cause) => {
                f.write_str(match record.path {
                    PathPart::Uplink => "dropped on the uplink",
                    PathPart::Link => "dropped",
                    PathPart::Downlink => "dropped on the downlink",
                })?;
                write!(f, ": {}", cause.name())?;
            }
            Fate::Duplicated => f.write_str("duplicated")?,
        }
        if record.copy > 0 {
            write!(f, ", copy {}", record.copy)?;
        }
        f.write_str(if record.marked { ", marked" } else { "" })?;
        f.write_str(if record.damaged { ", damaged" } else { "" })
    }
}

#[cfg(test)]
mod tests;
