//! Reads frames of capture files: pcap and pcapng, in all forms read by libpcap.

mod pcap;
mod pcapng;

use std::io::Read;

use super::CaptureProblem;

/// A captured frame.
pub(super) struct Frame<'a> {
    /// Time of capture \[ns since 1970\]; `None` for a block without a timestamp (simple packet of pcapng).
    pub(super) nanos: Option<i128>,
    /// `LINKTYPE_` number of the first header.
    pub(super) link_type: u16,
    /// Index of the interface in its section of the file; 0 in pcap.
    pub(super) interface: u32,
    /// Captured octets, without a frame check sequence.
    pub(super) data: &'a [u8],
    /// Length of the frame on the wire \[byte\], without a frame check sequence.
    pub(super) length: usize,
}

/// Place of the end of a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Ending {
    /// After a complete block.
    Whole,
    /// Within a block, which is ignored.
    CutOff,
}

/// Length of the longest accepted block \[byte\]. A file with a longer block is damaged.
const LONGEST_BLOCK: u32 = 1 << 26;

/// Reads a file to its end and calls `each` for every frame.
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

/// Returns whether a file with this beginning is a capture.
pub(super) fn is_capture(beginning: &[u8]) -> bool {
    beginning.first_chunk().is_some_and(|magic| *magic == pcapng::SECTION_HEADER || pcap::Format::of(*magic).is_some())
}

/// A file read piece by piece.
struct Source<R> {
    from: R,
}

impl<R: Read> Source<R> {
    /// Replaces the content of `buffer` by the next `octets` octets. Returns `false` if the file ends earlier.
    fn fill(&mut self, buffer: &mut Vec<u8>, octets: usize) -> Result<bool, CaptureProblem> {
        buffer.clear();
        // The number comes from the file. `take` and `read_to_end` keep a damaged number from reserving more memory than the file fills.
        self.from.by_ref().take(octets as u64).read_to_end(buffer).map_err(|_| CaptureProblem::Io)?;
        Ok(buffer.len() == octets)
    }

    /// Reads `N` octets; `None` if the file ends earlier.
    fn array<const N: usize>(&mut self) -> Result<Option<[u8; N]>, CaptureProblem> {
        Ok(self.array_or_end()?.ok())
    }

    /// Reads `N` octets, or returns the number of octets left as an inner error: 0 if the file ends exactly here.
    fn array_or_end<const N: usize>(&mut self) -> Result<Result<[u8; N], usize>, CaptureProblem> {
        let mut buffer = Vec::new();
        self.fill(&mut buffer, N)?;
        Ok(<[u8; N]>::try_from(buffer.as_slice()).map_err(|_| buffer.len()))
    }
}

/// Byte order of numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Order {
    Big,
    Little,
}

impl Order {
    /// Returns the 32-bit number at an offset; `None` beyond the end.
    fn word(self, bytes: &[u8], at: usize) -> Option<u32> {
        let octets = *bytes.get(at..)?.first_chunk()?;
        Some(if self == Self::Big { u32::from_be_bytes(octets) } else { u32::from_le_bytes(octets) })
    }

    /// Returns the 16-bit number at an offset; `None` beyond the end.
    fn half(self, bytes: &[u8], at: usize) -> Option<u16> {
        let octets = *bytes.get(at..)?.first_chunk()?;
        Some(if self == Self::Big { u16::from_be_bytes(octets) } else { u16::from_le_bytes(octets) })
    }
}

/// Returns the octets of a frame and its length on the wire, both without the frame check sequence of `check` octets. A cut frame may have a part of the
/// sequence, or nothing.
fn without_check(data: &[u8], length: u32, check: usize) -> (&[u8], usize) {
    let length = usize::try_from(length).unwrap_or(usize::MAX).max(data.len()).saturating_sub(check);
    (&data[..data.len().min(length)], length)
}
