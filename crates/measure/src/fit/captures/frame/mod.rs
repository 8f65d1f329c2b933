//! From a frame to the UDP datagram in it, or to the name of what it is otherwise.

mod internet;
mod link;
mod wireless;

use std::borrow::Cow;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::reader::Frame;

/// Name of what a frame is that holds no datagram, for counts.
pub(super) type Kind = Cow<'static, str>;

/// Name of frames that end before the payload of a datagram.
pub(super) const CUT: Kind = Cow::Borrowed("cut within the headers");

/// A datagram in a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Found<'a> {
    pub(super) destination_port: u16,
    /// The IPv4 identification.
    pub(super) identification: Option<u16>,
    /// Length of the payload as sent \[byte\].
    pub(super) length: usize,
    /// The payload, as far as it was captured.
    pub(super) payload: &'a [u8],
    /// Hash of where the frame was seen: the interface and all headers before IP.
    pub(super) place: u64,
}

/// The datagram of a frame.
///
/// # Errors
///
/// The name of what the frame is if it holds no datagram that can be matched.
pub(super) fn datagram<'a>(frame: &Frame<'a>) -> Result<Found<'a>, Kind> {
    let packet = link::packet(frame.link_type, frame.data)?;
    let carried = internet::carried(packet)?;
    let header = carried.udp.first_chunk::<8>().ok_or(CUT)?;
    let [port, length] = [2, 4].map(|at| half(header, at).unwrap_or(0));
    let length = match usize::from(length) {
        // A jumbogram (RFC 2675), or a packet that the network card is to cut: the length stands in IP, or nowhere but in the capture.
        0 => carried.length.unwrap_or_else(|| frame.length.saturating_sub(frame.data.len() - carried.udp.len())),
        length => length,
    };
    let length = length.checked_sub(8).ok_or("malformed UDP")?;
    let payload = &carried.udp[8..];
    let payload = &payload[..payload.len().min(length)];
    if payload.is_empty() && length > 0 && carried.identification.is_none_or(|number| number == 0) {
        // Such a datagram cannot be told from another one of its length.
        return Err("UDP cut before its payload".into());
    }
    let mut place = DefaultHasher::new();
    // The header before a wireless frame tells of signals and instants, which differ from frame to frame.
    let before = if wireless::is_wireless(frame.link_type) { &[][..] } else { &frame.data[..offset(frame.data, packet)] };
    (frame.interface, before).hash(&mut place);
    Ok(Found { destination_port: port, identification: carried.identification, length, payload, place: place.finish() })
}

/// Number of octets before a part that reaches to the end of the whole.
fn offset(whole: &[u8], part: &[u8]) -> usize {
    whole.len() - part.len()
}

/// The number of two octets at a place, the first octet the greater; `None` beyond the end.
fn half(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}
