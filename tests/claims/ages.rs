//! How old what a peer holds is, from what became of every packet.

use cohaptic_tests::Log;
use cohaptic_wan::Fate;

/// For a receiver and a sender, when the sample that the receiver holds was sent, at each tick of the receiver \[ns\]. What is held at first counts as sent
/// at 0: nothing has moved before.
pub(crate) fn held_since(log: &Log, from: usize, to: usize) -> Vec<u64> {
    let mut arrivals: Vec<(u64, u64, u64)> = Vec::new();
    for packet in log.packets.iter().filter(|packet| (packet.path.from.index(), packet.path.to.index()) == (from, to)) {
        if let Fate::Delivered(at) = packet.fate {
            arrivals.push((at.as_nanos(), packet.sequence, packet.offered.as_nanos()));
        }
    }
    arrivals.sort_unstable();
    let (mut next, mut newest) = (0, None);
    let ticks = log.ticks.iter().filter(|tick| tick.peer == to);
    ticks
        .map(|tick| {
            while let Some((_, sequence, sent)) = arrivals.get(next).filter(|(at, ..)| *at <= tick.at.as_nanos()) {
                newest = newest.max(Some((*sequence, *sent)));
                next += 1;
            }
            newest.map_or(0, |(_, sent)| sent)
        })
        .collect()
}

/// The largest age of anything held at a tick, of all pairs \[s\].
pub(crate) fn oldest(log: &Log, peers: usize) -> f64 {
    let mut oldest = 0;
    for (from, to) in (0..peers).flat_map(|from| (0..peers).filter(move |to| *to != from).map(move |to| (from, to))) {
        let ticks = log.ticks.iter().filter(|tick| tick.peer == to);
        oldest = ticks.zip(held_since(log, from, to)).map(|(tick, sent)| tick.at.as_nanos() - sent).fold(oldest, u64::max);
    }
    oldest as f64 * 1e-9
}
