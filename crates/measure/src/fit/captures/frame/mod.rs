//! Finds the UDP datagram in a frame, or names the frame's content.

mod internet;
mod layers;
mod link;
mod wireless;

use std::borrow::Cow;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::reader::Frame;

/// Name of the content of a frame without a usable datagram, for counts.
pub(super) type Kind = Cow<'static, str>;

/// Name of frames that end before the payload of a datagram.
pub(super) const CUT: Kind = Cow::Borrowed("cut within the headers");

/// A datagram in a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Found<'a> {
    pub(super) destination_port: u16,
    /// Identification of the IPv4 header; `None` for IPv6.
    pub(super) identification: Option<u16>,
    /// Length of the payload as sent \[byte\].
    pub(super) length: usize,
    /// Captured part of the payload.
    pub(super) payload: &'a [u8],
    /// Hash of the place of capture: the interface and all headers before IP.
    pub(super) place: u64,
}

/// Finds the datagram of a frame.
///
/// # Errors
///
/// The name of the frame's content if the frame has no datagram suitable for matching.
pub(super) fn datagram<'a>(frame: &Frame<'a>) -> Result<Found<'a>, Kind> {
    let packet = link::packet(frame.link_type, frame.data)?;
    let carried = internet::carried(packet)?;
    let header = carried.udp.first_chunk::<8>().ok_or(CUT)?;
    let [port, length] = [2, 4].map(|at| half(header, at).unwrap_or(0));
    let length = match usize::from(length) {
        // A jumbogram (RFC 2675), or a packet to be cut by the network card. The length is in the IP header, or only in the capture.
        0 => carried.length.unwrap_or_else(|| frame.length.saturating_sub(frame.data.len() - carried.udp.len())),
        length => length,
    };
    let length = length.checked_sub(8).ok_or("malformed UDP")?;
    let payload = &carried.udp[8..];
    let payload = &payload[..payload.len().min(length)];
    if payload.is_empty() && length > 0 && carried.identification.is_none_or(|number| number == 0) {
        // Such a datagram cannot be distinguished from others of the same length.
        return Err("UDP cut before its payload".into());
    }
    let mut place = DefaultHasher::new();
    // The header before a wireless frame has signal strengths and times, which differ from frame to frame.
    let before = if wireless::is_wireless(frame.link_type) { &[][..] } else { &frame.data[..offset(frame.data, packet)] };
    (frame.interface, before).hash(&mut place);
    Ok(Found { destination_port: port, identification: carried.identification, length, payload, place: place.finish() })
}

/// Returns the number of octets before `part`, which is the end of `whole`.
fn offset(whole: &[u8], part: &[u8]) -> usize {
    whole.len() - part.len()
}

/// Returns the 16-bit number at an offset, most significant octet first; `None` beyond the end.
fn half(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}
