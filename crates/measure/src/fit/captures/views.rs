//! Packets that one capture shows several times.
//!
//! A capture of all interfaces of a computer shows a packet at each interface that it passes, and a mirrored port of a switch shows it as it comes and as it
//! goes. Without care every second view is a packet that never arrived.

use std::collections::{BTreeMap, VecDeque};

use super::contents::Capture;
use super::matching::{Pairs, agree};

/// A packet is not seen again after a longer time than this \[ns\].
const WINDOW: i128 = 100_000_000;
/// Open packets of one content that are looked at for each frame.
const MOST_OPEN: usize = 64;
/// Octets of the payload that group packets. A view may hold fewer octets than another one, but hardly fewer than these.
const PREFIX: usize = 16;

/// Length, identification and beginning of a payload.
type Content<'a> = (usize, Option<u16>, &'a [u8]);
/// Packets that further frames may show: the number of the first view, and the places at which the packet was seen.
type Open = VecDeque<(usize, Vec<u64>)>;

/// Keeps the first view of each packet that was seen at several places, and gives the number of views that were dropped.
///
/// Two frames show one packet if payload and IP identification are the same, the places differ, and the time between them is below a tenth of a second.
pub(super) fn merge(capture: &mut Capture) -> usize {
    let mut open: BTreeMap<Content<'_>, Open> = BTreeMap::new();
    let mut keep = vec![true; capture.datagrams.len()];
    for (number, datagram) in capture.datagrams.iter().enumerate() {
        let payload = capture.payload(datagram);
        let packets = open.entry((datagram.length, datagram.identification, &payload[..payload.len().min(PREFIX)])).or_default();
        while packets.len() >= MOST_OPEN || packets.front().is_some_and(|first| datagram.nanos - capture.datagrams[first.0].nanos > WINDOW) {
            packets.pop_front();
        }
        // The oldest packet that this place has not shown: equal packets pass the places in the same order.
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

/// Keeps one of each group of equal datagrams without an identification of their own, if the other capture shows that the capture doubles packets: nearly
/// all packets that arrived have an equal one within a tenth of a second that did not. Gives the number of datagrams that were dropped.
pub(super) fn merge_doubled(capture: &mut Capture, pairs: &Pairs) -> usize {
    const FEWEST: usize = 20;
    const SHARE: f64 = 0.9;
    // A payload that comes more often is one that the sender repeats.
    const MOST_VIEWS: usize = 4;
    let mut groups: BTreeMap<(usize, u64), Vec<usize>> = BTreeMap::new();
    for (number, datagram) in capture.datagrams.iter().enumerate().filter(|(_, datagram)| datagram.own_identification().is_none()) {
        groups.entry((datagram.length, datagram.hash)).or_default().push(number);
    }
    let mut keep = vec![true; capture.datagrams.len()];
    let (mut matched, mut doubled) = (0, 0);
    for group in groups.values() {
        let arrived = group.iter().filter(|number| pairs.arrival_of[**number].is_some()).count();
        matched += arrived;
        let lasts = capture.datagrams[group[group.len() - 1]].nanos - capture.datagrams[group[0]].nanos;
        if (2..=MOST_VIEWS).contains(&group.len()) && lasts <= WINDOW {
            doubled += usize::from(arrived == 1);
            group[1..].iter().for_each(|number| keep[*number] = false);
        }
    }
    let is_rule = doubled >= FEWEST && crate::series::count(doubled) >= SHARE * crate::series::count(matched);
    if is_rule { retain(capture, &keep) } else { 0 }
}

/// Keeps the marked datagrams, and gives the number of the others.
fn retain(capture: &mut Capture, keep: &[bool]) -> usize {
    let mut marks = keep.iter();
    capture.datagrams.retain(|_| marks.next().copied().unwrap_or(true));
    keep.len() - capture.datagrams.len()
}

/// Marks datagrams which show a packet that has been seen: an equal one with the same identification of its own was captured within a tenth of a second,
/// and was matched or stands before it. `is_matched` says which were.
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
