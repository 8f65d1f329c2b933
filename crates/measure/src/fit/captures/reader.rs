//! The frames of a capture file, through the `pcap-parser` crate.

use std::io::Read;

use pcap_parser::traits::PcapNGPacketBlock;
use pcap_parser::{Block, Linktype, PcapBlockOwned, PcapError, PcapHeader, create_reader};

use super::CaptureProblem;

/// A frame as captured.
pub(super) struct Frame<'a> {
    /// When, in nanoseconds since 1970.
    pub(super) nanos: i128,
    pub(super) link_type: Linktype,
    pub(super) data: &'a [u8],
}

const BUFFER: usize = 1 << 16;
/// No frame is longer than this; a file that says so is damaged.
const LARGEST_BUFFER: usize = 1 << 26;

/// An interface of a pcapng section.
#[derive(Clone, Copy)]
struct Interface {
    link_type: Linktype,
    units_per_second: u128,
    offset_seconds: i64,
}

/// Reads to the end.
pub(super) fn for_each_frame(from: impl Read + Send, mut each: impl FnMut(Frame<'_>)) -> Result<(), CaptureProblem> {
    let mut reader = create_reader(BUFFER, from).map_err(|error| problem(&error).unwrap_or(CaptureProblem::Format))?;
    let mut interfaces: Vec<Interface> = Vec::new();
    let mut header: Option<PcapHeader> = None;
    let mut capacity = BUFFER;
    let mut stalled = None;
    // The byte order of the section of a pcapng file.
    let mut is_big_endian = None;
    loop {
        if is_big_endian.is_some_and(|is_big_endian| is_too_short(reader.data(), is_big_endian)) {
            return Err(CaptureProblem::Malformed);
        }
        match reader.next() {
            Ok((length, block)) => {
                stalled = None;
                match block {
                    PcapBlockOwned::LegacyHeader(found) => header = Some(found),
                    PcapBlockOwned::Legacy(frame) => {
                        let header = header.as_ref().ok_or(CaptureProblem::Malformed)?;
                        let to_nanos = if header.is_nanosecond_precision() { 1 } else { 1_000 };
                        let nanos = i128::from(frame.ts_sec) * 1_000_000_000 + i128::from(frame.ts_usec) * to_nanos;
                        each(Frame { nanos, link_type: header.network, data: frame.data });
                    }
                    PcapBlockOwned::NG(block) => {
                        if let Block::SectionHeader(header) = &block {
                            is_big_endian = Some(header.big_endian());
                        }
                        ng_block(&block, &mut interfaces, &mut each)?;
                    }
                }
                reader.consume(length);
            }
            Err(PcapError::Eof) => return Ok(()),
            Err(PcapError::Incomplete(_)) => {
                // The buffer holds the beginning of a block. If more does not come, the file ends there.
                let before = (reader.position(), reader.data().len());
                if stalled.replace(before) == Some(before) && reader.reader_exhausted() {
                    return Err(CaptureProblem::CutOff);
                }
                reader.refill().map_err(|error| problem(&error).unwrap_or(CaptureProblem::Io))?;
            }
            Err(PcapError::BufferTooSmall) => {
                capacity *= 2;
                if capacity > LARGEST_BUFFER || !reader.grow(capacity) {
                    return Err(CaptureProblem::Malformed);
                }
                reader.refill().map_err(|error| problem(&error).unwrap_or(CaptureProblem::Io))?;
            }
            Err(error) => return Err(problem(&error).unwrap_or(CaptureProblem::Malformed)),
        }
    }
}

/// Whether the block at the beginning of the data says that it is shorter than its type and its two lengths.
///
/// The parser subtracts these 12 bytes without looking where a block tells of a process: with checks of overflow that ends the program.
fn is_too_short(data: &[u8], is_big_endian: bool) -> bool {
    const SECTION_HEADER: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
    let Some((kind, rest)) = data.split_first_chunk::<4>() else { return false };
    let Some(length) = rest.first_chunk().copied() else { return false };
    // The next section may have the other byte order, and its header is looked at by the parser.
    *kind != SECTION_HEADER && (if is_big_endian { u32::from_be_bytes(length) } else { u32::from_le_bytes(length) }) < 12
}

fn ng_block(block: &Block<'_>, interfaces: &mut Vec<Interface>, each: &mut impl FnMut(Frame<'_>)) -> Result<(), CaptureProblem> {
    if let Block::SectionHeader(_) = block {
        interfaces.clear();
    } else if let Block::InterfaceDescription(description) = block {
        let units_per_second = units_per_second(description.if_tsresol).ok_or(CaptureProblem::Timestamp)?;
        interfaces.push(Interface { link_type: description.linktype, units_per_second, offset_seconds: description.if_tsoffset });
    } else if let Block::EnhancedPacket(packet) = block {
        let interface = usize::try_from(packet.if_id).ok().and_then(|place| interfaces.get(place)).ok_or(CaptureProblem::Timestamp)?;
        let units = u128::from(packet.ts_high) << 32 | u128::from(packet.ts_low);
        let nanos = units * 1_000_000_000 / interface.units_per_second;
        let nanos = i128::try_from(nanos).map_err(|_| CaptureProblem::Timestamp)? + i128::from(interface.offset_seconds) * 1_000_000_000;
        each(Frame { nanos, link_type: interface.link_type, data: packet.packet_data() });
    }
    // Simple packets have no timestamp; the other blocks are no frames.
    Ok(())
}

/// `if_tsresol`: a negative power of ten, or of two if the top bit is set.
fn units_per_second(resolution: u8) -> Option<u128> {
    let exponent = u32::from(resolution & 0x7f);
    if resolution & 0x80 == 0 { 10_u128.checked_pow(exponent) } else { 1_u128.checked_shl(exponent) }
}

/// What the library says, where it is not only "malformed".
const fn problem<I>(error: &PcapError<I>) -> Option<CaptureProblem> {
    match error {
        PcapError::Eof | PcapError::UnexpectedEof | PcapError::Incomplete(_) => Some(CaptureProblem::CutOff),
        PcapError::ReadError => Some(CaptureProblem::Io),
        PcapError::HeaderNotRecognized => Some(CaptureProblem::Format),
        PcapError::BufferTooSmall | PcapError::NomError(..) | PcapError::OwnedNomError(..) => None,
    }
}
