//! Frames of IEEE 802.11, with or without the radiotap header.

use super::{CUT, Kind, layers};

/// Returns whether frames of a link type begin with a header that differs from frame to frame.
pub(super) const fn is_wireless(link_type: u16) -> bool {
    link_type == 105 || link_type == 127
}

/// Returns the IP packet after a radiotap header (<https://www.radiotap.org>), whose numbers are little-endian.
pub(super) fn with_radiotap(data: &[u8]) -> Result<&[u8], Kind> {
    const PAD: u8 = 0x20;
    let [_, _, low, high, ..] = *data else { return Err(CUT) };
    let frame = data.get(usize::from(u16::from_le_bytes([low, high]))..).ok_or(CUT)?;
    // Words of flags for the fields present. The top bit announces another word.
    let mut at = 4;
    let mut first = None;
    loop {
        let word = u32::from_le_bytes(*data.get(at..).and_then(|rest| rest.first_chunk()).ok_or(CUT)?);
        at += 4;
        first = first.or(Some(word));
        if word >> 31 == 0 {
            break;
        }
    }
    let present = first.unwrap_or(0);
    // Field 0 is a time of 8 octets, aligned to 8 octets. Field 1 has the flags.
    let at = if present & 1 == 0 { at } else { at.next_multiple_of(8) + 8 };
    let flags = if present & 2 == 0 { 0 } else { *data.get(at).ok_or(CUT)? };
    packet(frame, flags & PAD != 0)
}

/// Returns the IP packet of a data frame. `padded` tells whether the header is padded to a multiple of four octets.
pub(super) fn packet(frame: &[u8], padded: bool) -> Result<&[u8], Kind> {
    let [control, flags, ..] = *frame else { return Err(CUT) };
    let (is_quality, has_no_data) = (control & 0x80 != 0, control & 0x40 != 0);
    match control & 0x0F {
        0x08 => {}
        0x00 => return Err("802.11 management".into()),
        0x04 => return Err("802.11 control".into()),
        _ => return Err("802.11 of another version".into()),
    }
    if has_no_data {
        return Err("802.11 without data".into());
    }
    if flags & 0x40 != 0 {
        return Err("802.11 encrypted".into());
    }
    // Frames between two access points have four addresses, other frames three.
    let addresses = if flags & 3 == 3 { 30 } else { 24 };
    if is_quality && frame.get(addresses).ok_or(CUT)? & 0x80 != 0 {
        return Err("802.11 aggregates (A-MSDU)".into());
    }
    let header = match (is_quality, flags & 0x80 != 0) {
        (false, _) => addresses,
        (true, false) => addresses + 2,
        (true, true) => addresses + 6,
    };
    layers::llc(frame.get(if padded { header.next_multiple_of(4) } else { header }..).ok_or(CUT)?)
}
