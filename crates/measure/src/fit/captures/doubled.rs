//! Finds out from the other capture that a capture doubles packets.

use std::collections::BTreeMap;

use super::contents::Capture;
use super::matching::Pairs;
use super::views::{WINDOW, retain};

/// Keeps the first of each group of equal datagrams without an identification, if the other capture proves that this capture doubles packets: for nearly
/// all arrived packets, an equal datagram within a tenth of a second did not arrive. Returns the number of datagrams dropped.
pub(super) fn merge_doubled(capture: &mut Capture, pairs: &Pairs) -> usize {
    const FEWEST: usize = 20;
    const SHARE: f64 = 0.9;
    // A payload in more datagrams than this is repeated by the sender.
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
