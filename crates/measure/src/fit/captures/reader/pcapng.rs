//! Reads pcapng files (draft-ietf-opsawg-pcapng).

use std::io::Read;

use super::{CaptureProblem, Ending, Frame, LONGEST_BLOCK, Order, Source, without_check};

/// Type of a section header, a palindrome and so the same in both byte orders.
pub(super) const SECTION_HEADER: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
const ORDER_MAGIC: u32 = 0x1A2B_3C4D;
const INTERFACE_DESCRIPTION: u32 = 1;
/// The obsolete packet block, written by Wireshark before 2010.
const PACKET: u32 = 2;
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;

/// An interface of a section.
#[derive(Clone, Copy)]
struct Interface {
    link_type: u16,
    /// Largest number of octets captured per frame; 0 for no limit.
    snap_length: u32,
    units_per_second: u128,
    offset_seconds: i64,
    /// Length of the frame check sequence \[byte\].
    check: usize,
}

/// Reads the file after the type of its first section header.
pub(super) fn read(mut source: Source<impl Read>, mut each: impl FnMut(Frame<'_>)) -> Result<Ending, CaptureProblem> {
    let (mut kind, mut order) = (SECTION_HEADER, Order::Little);
    let mut interfaces = Vec::new();
    let (mut body, mut is_first) = (Vec::new(), true);
    // A file without a complete section header is refused.
    let cut_off = |is_first| if is_first { Err(CaptureProblem::CutOff) } else { Ok(Ending::CutOff) };
    loop {
        let Some(length) = source.array::<4>()? else { return cut_off(is_first) };
        let mut taken = 8;
        if kind == SECTION_HEADER {
            let Some(magic) = source.array::<4>()? else { return cut_off(is_first) };
            order =
                [Order::Big, Order::Little].into_iter().find(|order| order.word(&magic, 0) == Some(ORDER_MAGIC)).ok_or(CaptureProblem::Malformed)?;
            taken = 12;
            // Interfaces are numbered anew in each section.
            interfaces.clear();
        }
        let length = order.word(&length, 0).unwrap_or(0);
        let rest = usize::try_from(length).ok().and_then(|octets| octets.checked_sub(taken + 4)).ok_or(CaptureProblem::Malformed)?;
        if length > LONGEST_BLOCK || length % 4 != 0 {
            return Err(CaptureProblem::Malformed);
        }
        if !source.fill(&mut body, rest + 4)? {
            return cut_off(is_first);
        }
        // The length is stored at both ends of a block.
        if order.word(&body, rest) != Some(length) {
            return Err(CaptureProblem::Malformed);
        }
        body.truncate(rest);
        if kind != SECTION_HEADER {
            block(order, order.word(&kind, 0).unwrap_or(0), &body, &mut interfaces, &mut each)?;
        }
        is_first = false;
        kind = match source.array_or_end()? {
            Ok(kind) => kind,
            Err(0) => return Ok(Ending::Whole),
            Err(_) => return Ok(Ending::CutOff),
        };
    }
}

/// Handles the body of a block: remembers an interface, or passes a frame to `each`.
fn block(order: Order, kind: u32, body: &[u8], interfaces: &mut Vec<Interface>, each: &mut impl FnMut(Frame<'_>)) -> Result<(), CaptureProblem> {
    let word = |at| order.word(body, at).ok_or(CaptureProblem::Malformed);
    let half = |at| order.half(body, at).ok_or(CaptureProblem::Malformed);
    match kind {
        INTERFACE_DESCRIPTION => interfaces.push(interface(order, half(0)?, word(4)?, body.get(8..).unwrap_or_default())?),
        ENHANCED_PACKET | PACKET => {
            let number = if kind == PACKET { u32::from(half(0)?) } else { word(0)? };
            let interface = usize::try_from(number).ok().and_then(|place| interfaces.get(place)).ok_or(CaptureProblem::Timestamp)?;
            let captured = usize::try_from(word(12)?).unwrap_or(usize::MAX);
            let data = captured.checked_add(20).and_then(|end| body.get(20..end)).ok_or(CaptureProblem::Malformed)?;
            let units = u128::from(word(4)?) << 32 | u128::from(word(8)?);
            let nanos = units.checked_mul(1_000_000_000).ok_or(CaptureProblem::Timestamp)? / interface.units_per_second;
            let nanos = i128::try_from(nanos).map_err(|_| CaptureProblem::Timestamp)? + i128::from(interface.offset_seconds) * 1_000_000_000;
            // Bits 5 to 8 of a packet's flags can give the length of its own frame check sequence.
            let flags = options(order, body.get(20 + captured.next_multiple_of(4)..).unwrap_or_default()).find(|(code, _)| *code == 2);
            let own = flags.and_then(|(_, value)| order.word(value, 0)).map_or(0, |flags| flags >> 5 & 0xF);
            let check = if own == 0 { interface.check } else { usize::try_from(own).unwrap_or(0) };
            let (data, length) = without_check(data, word(16)?, check);
            each(Frame { nanos: Some(nanos), link_type: interface.link_type, interface: number, data, length });
        }
        SIMPLE_PACKET => {
            let interface = interfaces.first().ok_or(CaptureProblem::Timestamp)?;
            let length = word(0)?;
            let limit = if interface.snap_length == 0 { length } else { length.min(interface.snap_length) };
            let data = &body[4..];
            let data = &data[..data.len().min(usize::try_from(limit).unwrap_or(usize::MAX))];
            let (data, length) = without_check(data, length, interface.check);
            each(Frame { nanos: None, link_type: interface.link_type, interface: 0, data, length });
        }
        // Blocks with statistics, names, secrets, journals, and private blocks have no frames.
        _ => {}
    }
    Ok(())
}

/// Reads the description of an interface.
fn interface(order: Order, link_type: u16, snap_length: u32, rest: &[u8]) -> Result<Interface, CaptureProblem> {
    // Timestamps count microseconds, unless an option says otherwise.
    let mut found = Interface { link_type, snap_length, units_per_second: 1_000_000, offset_seconds: 0, check: 0 };
    for (code, value) in options(order, rest) {
        match (code, value) {
            (9, &[resolution, ..]) => found.units_per_second = units_per_second(resolution).ok_or(CaptureProblem::Timestamp)?,
            (13, &[check, ..]) => found.check = check.into(),
            (14, value) => {
                if let Some(&octets) = value.first_chunk() {
                    found.offset_seconds = if order == Order::Big { i64::from_be_bytes(octets) } else { i64::from_le_bytes(octets) };
                }
            }
            _ => {}
        }
    }
    Ok(found)
}

/// Iterates over the options of a block, as (code, value), up to the end of options or to an option longer than the block.
fn options(order: Order, mut bytes: &[u8]) -> impl Iterator<Item = (u16, &[u8])> {
    std::iter::from_fn(move || {
        let (code, length) = (order.half(bytes, 0).filter(|code| *code != 0)?, usize::from(order.half(bytes, 2)?));
        let value = bytes.get(4..4 + length)?;
        bytes = bytes.get(4 + length.next_multiple_of(4)..).unwrap_or_default();
        Some((code, value))
    })
}

/// Decodes `if_tsresol`: a negative power of ten, or of two if the top bit is set. Returns `None` for a power too large.
fn units_per_second(resolution: u8) -> Option<u128> {
    let exponent = u32::from(resolution & 0x7f);
    if resolution & 0x80 == 0 { 10_u128.checked_pow(exponent) } else { 1_u128.checked_shl(exponent) }
}
