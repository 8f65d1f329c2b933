//! The fates of packets as a capture file that packet analysers open (pcapng, draft-ietf-opsawg-pcapng).
//!
//! You need it if you want to look at the packets of an emulated link in Wireshark or tshark.
//!
//! A [`CaptureWriter`] writes every record as one frame at the instant at which it happened, with the fate as its comment:
//!
//! ```text
//! packet 17 delivered after 24.1ms, copy 1, marked
//! packet 18 dropped: queue-full
//! packet 19 duplicated
//! ```
//!
//! so that in an analyser `frame.comment contains "dropped"` shows what was lost. The frames are raw IPv4 (`LINKTYPE_RAW`) with UDP, both checksums
//! right, from 192.0.2.1:49152 to 192.0.2.2:49153 (RFC 5737: addresses of documentation), and the number of the packet, modulo 2¹⁶, as IP
//! identification. A mark of congestion is the CE codepoint. Packets whose headers are known are written as they are
//! ([`CaptureWriter::write_packet`]). Time zero is 1970-01-01 00:00 UTC, timestamps count nanoseconds.
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

use cohaptic_units::print::Span;
use cohaptic_wan::{Fate, PacketRecord};

/// Writes records as frames, in the order of the calls.
///
/// Give it a [`std::io::BufWriter`]. Call [`CaptureWriter::finish`] to hear of errors of the last frames.
#[derive(Debug)]
pub struct CaptureWriter<W> {
    to: W,
    block: Vec<u8>,
}

impl<W: Write> CaptureWriter<W> {
    /// Begins a capture whose one interface has that name: that of the link, say. A name is cut at 65 535 bytes.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn new(mut to: W, interface: &str) -> io::Result<Self> {
        to.write_all(&block::section_header())?;
        to.write_all(&block::interface_description(interface))?;
        Ok(Self { to, block: Vec::new() })
    }

    /// Writes one frame whose packet is known: IPv4 or IPv6 from its first octet on, as it was sent.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn write_packet(&mut self, record: &PacketRecord, packet: &[u8]) -> io::Result<()> {
        self.write_frame(record, &block::Frame { captured: packet.into(), length: packet.len() })
    }

    /// Writes one frame. `payload` is what the packet carried, as far as it is known: if it is shorter than [`PacketRecord::size`], the frame
    /// is marked as cut off after it and has no UDP checksum. A UDP payload has at most 65 507 bytes; the rest of a larger packet is not written.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn write(&mut self, record: &PacketRecord, payload: &[u8]) -> io::Result<()> {
        let size = usize::try_from(record.size.get()).unwrap_or(usize::MAX);
        let datagram = block::build(record.sequence, record.marked, payload, size);
        self.write_frame(record, &datagram)
    }

    fn write_frame(&mut self, record: &PacketRecord, frame: &block::Frame<'_>) -> io::Result<()> {
        self.block.clear();
        block::enhanced_packet(&mut self.block, record.at.as_nanos(), frame, &Comment(record).to_string());
        self.to.write_all(&self.block)
    }

    /// Ends the capture: flushes the writer and gives it back.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        self.to.flush()?;
        Ok(self.to)
    }
}

/// What became of a packet, in words.
struct Comment<'a>(&'a PacketRecord);

impl fmt::Display for Comment<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let record = self.0;
        write!(f, "packet {} ", record.sequence)?;
        match record.fate {
            Fate::Delivered(at) => write!(f, "delivered after {}", Span(at.saturating_duration_since(record.offered)))?,
            Fate::Dropped(cause) => write!(f, "dropped: {}", cause.name())?,
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
