//! The part of the sender's datagrams that is judged: both captures ran.

use std::ops::Range;

use super::contents::Capture;
use super::matching::Pairs;

/// Numbers of the sender's datagrams that the receiver's capture would have shown if they had arrived. `None` if nothing arrived.
///
/// A datagram without a counterpart that was sent before the first one that arrived was lost only if, with the least delay of all, it would have
/// arrived after the first frame of the receiver's capture. One that was sent after the last that arrived was lost only if, with the greatest delay of
/// all, it would have arrived before the last frame. Whatever was sent earlier or later may have arrived while the receiver did not capture.
pub(super) fn judged(sent: &Capture, arrived: &Capture, pairs: &Pairs) -> Option<Range<usize>> {
    let delays =
        || pairs.arrival_of.iter().zip(&sent.datagrams).filter_map(|(arrival, sent)| Some(arrived.datagrams[(*arrival)?].nanos - sent.nanos));
    let (least, greatest) = (delays().min()?, delays().max()?);
    let first = pairs.arrival_of.iter().position(Option::is_some)?;
    let last = pairs.arrival_of.iter().rposition(Option::is_some)?;
    let begin = sent.datagrams[..first].partition_point(|datagram| datagram.nanos + least < arrived.ran.0);
    let end = last + 1 + sent.datagrams[last + 1..].partition_point(|datagram| datagram.nanos + greatest <= arrived.ran.1);
    Some(begin..end)
}
