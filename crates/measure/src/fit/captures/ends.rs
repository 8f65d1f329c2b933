//! Finds the sender's datagrams that can be judged, because both captures ran.

use std::ops::Range;

use super::contents::Capture;
use super::matching::Pairs;

/// Returns the numbers of the sender's datagrams that the receiver's capture would have shown on arrival. Returns `None` if no datagram arrived.
///
/// A datagram without a counterpart, sent before the first arrived datagram, counts as lost only if it would have arrived after the first frame of the
/// receiver's capture even with the least delay. A datagram sent after the last arrived datagram counts as lost only if it would have arrived before the
/// last frame even with the greatest delay. All other datagrams at the ends may have arrived while the receiver's capture did not run.
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
