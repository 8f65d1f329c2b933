//! The frames of a capture file: pcap and pcapng, in every form that libpcap reads.

mod pcap;
mod pcapng;

use std::io::Read;

use super::CaptureProblem;

/// A frame as captured.
pub(super) struct Frame<'a> {
    /// Instant of the capture, in nanoseconds since 1970. `None` in a block without a timestamp (a simple packet of pcapng).
    pub(super) nanos: Option<i128>,
    /// `LINKTYPE_` number of the first header.
    pub(super) link_type: u16,
    /// Index of the interface within its section of the file; 0 in pcap.
    pub(super) interface: u32,
    /// The octets that were captured, without a frame check sequence.
    pub(super) data: &'a [u8],
    /// Length of the frame on the wire \[byte\], without a frame check sequence.
    pub(super) length: usize,
}

/// The end of a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Ending {
    /// After a block.
    Whole,
    /// Within a block, of which nothing was read.
    CutOff,
}

/// No block is longer than this \[byte\]; a file that says so is damaged.
const LONGEST_BLOCK: u32 = 1 << 26;

/// Reads to the end.
pub(super) fn for_each_frame(from: impl Read, each: impl FnMut(Frame<'_>)) -> Result<Ending, CaptureProblem> {
    let mut source = Source { from };
    let Some(magic) = source.array()? else { return Err(CaptureProblem::CutOff) };
    if magic == pcapng::SECTION_HEADER {
        pcapng::read(source, each)
    } else if let Some(format) = pcap::Format::of(magic) {
        pcap::read(source, format, each)
    } else {
        Err(CaptureProblem::Format)
    }
}

/// Returns whether a file that begins like this is a capture.
pub(super) fn is_capture(beginning: &[u8]) -> bool {
    beginning.first_chunk().is_some_and(|magic| *magic == pcapng::SECTION_HEADER || pcap::Format::of(*magic).is_some())
}

/// A file that is read piece by piece.
struct Source<R> {
    from: R,
}

impl<R: Read> Source<R> {
    /// Reads that number of octets into the buffer, whose former content goes. `false` if the file ends before.
    fn fill(&mut self, buffer: &mut Vec<u8>, octets: usize) -> Result<bool, CaptureProblem> {
        buffer.clear();
        // The number comes from the file. `take` keeps a damaged one from reserving memory that the file does not fill.
        self.from.by_ref().take(octets as u64).read_to_end(buffer).map_err(|_| CaptureProblem::Io)?;
        Ok(buffer.len() == octets)
    }

    /// Reads `N` octets. `None` if the file ends before.
    fn array<const N: usize>(&mut self) -> Result<Option<[u8; N]>, CaptureProblem> {
        Ok(self.array_or_end()?.ok())
    }

    /// Reads `N` octets, or gives the number of octets that were left: none if the file ends exactly here.
    fn array_or_end<const N: usize>(&mut self) -> Result<Result<[u8; N], usize>, CaptureProblem> {
        let mut buffer = Vec::new();
        self.fill(&mut buffer, N)?;
        Ok(<[u8; N]>::try_from(buffer.as_slice()).map_err(|_| buffer.len()))
    }
}

/// The order of the octets of numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Order {
    Big,
    Little,
}

impl Order {
    /// The 32-bit number at a place; `None` beyond the end.
    fn word(self, bytes: &[u8], at: usize) -> Option<u32> {
        let octets = *bytes.get(at..)?.first_chunk()?;
        Some(if self == Self::Big { u32::from_be_bytes(octets) } else { u32::from_le_bytes(octets) })
    }

    /// The 16-bit number at a place; `None` beyond the end.
    fn half(self, bytes: &[u8], at: usize) -> Option<u16> {
        let octets = *bytes.get(at..)?.first_chunk()?;
        Some(if self == Self::Big { u16::from_be_bytes(octets) } else { u16::from_le_bytes(octets) })
    }
}

/// Returns the octets of a frame and its length on the wire without the frame check sequence, which has `check` octets. A capture that was cut may hold a part
/// of the sequence, or none of it.
fn without_check(data: &[u8], length: u32, check: usize) -> (&[u8], usize) {
    let length = usize::try_from(length).unwrap_or(usize::MAX).max(data.len()).saturating_sub(check);
    (&data[..data.len().min(length)], length)
}
