//! Finds packets shown several times by a capture.
//!
//! A capture of all interfaces of a computer shows a packet at each interface on its way, and a mirrored port of a switch shows incoming and outgoing
//! frames. Uncorrected, every second view would be a packet that never arrived.

use std::collections::{BTreeMap, VecDeque};

use super::contents::{Capture, agree};

/// Longest time between two views of a packet \[ns\].
pub(super) const WINDOW: i128 = 100_000_000;
/// Largest number of open packets of equal content compared per frame.
const MOST_OPEN: usize = 64;
/// Number of octets of the payload in the grouping key. A view may have fewer octets than another, but rarely fewer than this number.
const PREFIX: usize = 16;

/// Grouping key: length, identification and beginning of a payload.
type Content<'a> = (usize, Option<u16>, &'a [u8]);
/// Packets of which further views may follow, oldest first. Each is the number of its first view among the datagrams, and the hashes of the capture places at
/// which the packet was seen.
type Open = VecDeque<(usize, Vec<u64>)>;

/// Keeps the first view of each packet seen at several places. Returns the number of views dropped.
///
/// Two frames show the same packet if payload and IP identification are equal, the places differ, and the time between the frames is below a tenth of a second.
pub(super) fn merge(capture: &mut Capture) -> usize {
    let mut open: BTreeMap<Content<'_>, Open> = BTreeMap::new();
    let mut keep = vec![true; capture.datagrams.len()];
    for (number, datagram) in capture.datagrams.iter().enumerate() {
        let payload = capture.payload(datagram);
        let packets = open.entry((datagram.length, datagram.identification, &payload[..payload.len().min(PREFIX)])).or_default();
        while packets.len() >= MOST_OPEN || packets.front().is_some_and(|first| datagram.nanos - capture.datagrams[first.0].nanos > WINDOW) {
            packets.pop_front();
        }
        // The oldest packet not yet seen at this place, because equal packets pass the places in the same order.
        let same = packets.iter_mut().find(|(first, places)| !places.contains(&datagram.place) && agree(capture, *first, capture, number));
        match same {
            Some((_, places)) => {
                places.push(datagram.place);
                keep[number] = false;
            }
            None => packets.push_back((number, vec![datagram.place])),
        }
    }
    retain(capture, &keep)
}

/// Keeps the marked datagrams, and returns the number of the dropped ones.
pub(super) fn retain(capture: &mut Capture, keep: &[bool]) -> usize {
    let mut marks = keep.iter();
    capture.datagrams.retain(|_| marks.next().copied().unwrap_or(true));
    keep.len() - capture.datagrams.len()
}

/// Marks datagrams that show a packet again: a datagram with the same payload and own identification was captured within a tenth of a second, and is
/// matched or earlier. `is_matched` tells whether a datagram is matched.
pub(super) fn again(capture: &Capture, is_matched: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut groups: BTreeMap<(u16, usize, u64), Vec<usize>> = BTreeMap::new();
    for (number, datagram) in capture.datagrams.iter().enumerate() {
        if let Some(identification) = datagram.own_identification() {
            groups.entry((identification, datagram.length, datagram.hash)).or_default().push(number);
        }
    }
    let mut marks = vec![false; capture.datagrams.len()];
    for group in groups.values().filter(|group| group.len() > 1) {
        let instant = |number: usize| capture.datagrams[number].nanos;
        for near in group.chunk_by(|one, other| instant(*other) - instant(*one) <= WINDOW) {
            let first = near.iter().copied().find(|number| is_matched(*number)).unwrap_or(near[0]);
            near.iter().filter(|number| **number != first && !is_matched(**number)).for_each(|number| marks[*number] = true);
        }
    }
    marks
}
