//! The row of a finished run.

use std::collections::BTreeMap;
use std::sync::Arc;

use cohaptic_harness::measures::MeasuredRun;
use cohaptic_harness::{Ending, Summary};
use cohaptic_scene::MeasureName;
use cohaptic_units::Instant;
use cohaptic_wan::{CrossCounts, DropCause, LinkStats};

use super::{Roster, Row, Value};
use crate::judgement::Judgement;
use crate::vary::Varied;

/// Identity of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunId {
    pub(crate) run: u64,
    pub(crate) combination: u64,
    pub(crate) seed: u64,
}

/// Returns the row of a run, indexed like [`columns`](super::columns()). `judgement` is `None` for a plan without verdicts.
pub(crate) fn row<'a>(
    place: RunId,
    varied: impl Iterator<Item = &'a Varied>,
    judgement: Option<&Judgement>,
    MeasuredRun { summary, values, task }: &MeasuredRun,
    roster: &Roster,
) -> Row {
    let mut row = vec![integer(place.run), integer(place.combination), integer(place.seed)];
    row.extend(varied.map(|varied| varied.value.clone()));
    // Four columns for a plan with verdicts, also for a refused judgement; none otherwise.
    row.extend(judgement.into_iter().flat_map(|judgement| match judgement.verdict() {
        Some(verdict) => {
            [Value::Text(verdict.word.clone()), Value::Text(verdict.judged.clone()), Value::Number(verdict.radius), Value::Number(verdict.error)]
        }
        None => [const { Value::Absent }; 4],
    }));
    // `ended_at_s`: the planned duration, or the instant of the early end.
    let ended = match summary.ending {
        Ending::Complete => summary.duration.as_secs_f64(),
        Ending::Diverged(at) | Ending::Interrupted(at) => seconds(at),
    };
    row.push(Value::Text(Arc::from(summary.ending_name())));
    row.push(Value::Number(ended));
    row.push(integer(summary.ticks));
    if roster.tasks {
        row.extend(match task {
            None => [const { Value::Absent }; 3],
            Some(task) => [Value::Text(Arc::from(task.outcome.name())), Value::Number(task.time.as_secs_f64()), integer(task.reached.len() as u64)],
        });
    }
    row.push(Value::Number(summary.max_discrepancy));
    if roster.turns {
        row.push(summary.max_rotation_discrepancy.map_or(Value::Absent, Value::Number));
    }
    for (place, name) in roster.peers.iter().enumerate() {
        let peer = place_of(summary, place, name).map(|place| &summary.peers[place]);
        for quantity in [peer.map(|peer| &peer.position), peer.map(|peer| &peer.velocity)] {
            let component = |axis| quantity.and_then(|components| components.get(axis)).map_or(Value::Absent, |value| Value::Number(*value));
            row.extend((0..roster.axes).map(component));
        }
    }
    row.push(integer(summary.peers.iter().map(|peer| peer.stale_samples).sum()));
    row.push(integer(summary.peers.iter().map(|peer| peer.refused_samples).sum()));
    counters(&mut row, roster, summary.links.counted());
    if roster.access_lines {
        counters(&mut row, roster, summary.access_lines.iter().map(|line| (&line.stats, 1)));
    }
    let measured: BTreeMap<MeasureName, Option<f64>> = values.iter().map(|measured| (measured.name, measured.value)).collect();
    row.extend(roster.measures().map(|(measure, peer, _)| {
        let peer = peer.map(|place| place_of(summary, place, &roster.peers[place]));
        let value = match peer {
            // The peer is absent from this run.
            Some(None) => None,
            peer => measured.get(&MeasureName { measure, peer: peer.flatten() }).copied().flatten(),
        };
        value.map_or(Value::Absent, Value::Number)
    }));
    row
}

/// Returns the index of the peer `name` in the summary. Nearly always the index is `place`, its index in the roster, so `place` is tried first.
fn place_of(summary: &Summary, place: usize, name: &str) -> Option<usize> {
    let here = summary.peers.get(place).is_some_and(|peer| peer.name == name);
    if here { Some(place) } else { summary.peers.iter().position(|peer| peer.name == name) }
}

/// Adds the counters of the links. Each entry of `stats` comes with its number of links.
fn counters<'a>(row: &mut Row, roster: &Roster, stats: impl Iterator<Item = (&'a LinkStats, u64)> + Clone) {
    // The counters are sums over all links; the mean delay is weighted by the delivered packets.
    let mut total = LinkStats::default();
    stats.clone().for_each(|(stats, links)| total.add(stats, links));
    row.extend([total.offered(), total.duplicated(), total.delivered()].map(integer));
    row.extend(DropCause::ALL.into_iter().map(|cause| integer(total.dropped(cause))));
    row.extend([total.in_flight(), total.marked(), total.damaged()].map(integer));
    if roster.cross_traffic {
        let CrossCounts { offered, dropped, .. } = total.cross_traffic();
        row.extend([offered, dropped].map(integer));
    }
    row.push(mean_delay(stats));
}

/// Returns the mean delay \[s\] over all packets delivered by the links. The mean of each link is rounded down to a nanosecond, so the result is less than two
/// nanoseconds too low.
fn mean_delay<'a>(stats: impl Iterator<Item = (&'a LinkStats, u64)>) -> Value {
    let (mut nanos, mut delivered) = (0_u128, 0_u128);
    for (stats, links) in stats {
        if let Some(mean) = stats.mean_delay() {
            // `u128`: nanoseconds times packets of all links may exceed 64 bits.
            let packets = u128::from(stats.delivered()) * u128::from(links);
            nanos += mean.as_nanos() * packets;
            delivered += packets;
        }
    }
    let mean = nanos.checked_div(delivered).map(|mean| u64::try_from(mean).unwrap_or(u64::MAX));
    mean.map_or(Value::Absent, |mean| Value::Number(seconds(Instant::from_nanos(mean))))
}

fn seconds(instant: Instant) -> f64 {
    std::time::Duration::from_nanos(instant.as_nanos()).as_secs_f64()
}

fn integer(count: u64) -> Value {
    Value::Integer(i64::try_from(count).unwrap_or(i64::MAX))
}
