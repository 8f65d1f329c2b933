//! Ages of the samples that peers hold: at each tick of a peer and for each sender with an arrived sample, the instant of the tick less the instant of
//! sampling. Both are instants of the scene, so drifting clocks do not change an age.

use std::time::Duration;

use cohaptic_scene::Measure;
use cohaptic_units::Instant;

use super::quantiles::QuantileSketch;
use super::{Accumulator, Asked, Rows, ratio};
use crate::{HoldRow, TickRow};

/// Ages so far.
#[derive(Clone, Debug)]
pub(super) struct Ages {
    /// Samples held, indexed by receiver.
    receivers: Vec<Receiver>,
    /// Σ of all ages \[ns\]. An integer, so the sum is exact.
    nanos: u128,
    /// Number of ages in `nanos`.
    count: u64,
    /// Sketch of the ages \[s\]; `None` if no quantile is wanted.
    sketch: Option<QuantileSketch>,
}

/// Instants of the samples that a peer holds.
#[derive(Clone, Debug)]
struct Receiver {
    /// Senders with an arrived sample, in ascending order, and the instant of their newest sample. A sorted list, because a topology has few senders for each
    /// receiver.
    sampled: Vec<(usize, Instant)>,
    /// Σ of the instants in `sampled` \[ns\].
    nanos: u128,
    /// Distinct instants in `sampled` in ascending order, with the number of samples of each. Kept only if a quantile is wanted. Short if peers sample
    /// together.
    instants: Vec<(Instant, u64)>,
}

impl Receiver {
    /// Returns the index of a sender in `sampled`, or the index for its insertion. First tries the index that the sender has if all other peers send, and
    /// searches only if a different sender is found there.
    fn place_of(&self, from: usize, to: usize) -> Result<usize, usize> {
        // In a mesh the senders of a receiver are all peers but itself, so a sender after the receiver stands one place earlier.
        let likely = from - usize::from(from > to);
        match self.sampled.get(likely) {
            Some((sender, _)) if *sender == from => Ok(likely),
            _ => self.sampled.binary_search_by_key(&from, |(sender, _)| *sender),
        }
    }

    /// Replaces one sample of the instant `before`, if any, by one of the instant `now`.
    fn replace(&mut self, before: Option<Instant>, now: Instant) {
        // The replaced sample is most often one of the oldest, and the new sample one of the newest, so both ends are tried first.
        if let Some(before) = before {
            let place = match self.instants.first() {
                Some((first, _)) if *first == before => Some(0),
                _ => self.instants.binary_search_by_key(&before, |(instant, _)| *instant).ok(),
            };
            let place = place.expect("each sample held is counted");
            self.instants[place].1 -= 1;
            // An instant without samples is removed, so the list stays as short as the number of distinct instants.
            if self.instants[place].1 == 0 {
                self.instants.remove(place);
            }
        }
        match self.instants.last_mut() {
            Some((last, count)) if *last == now => *count += 1,
            Some((last, _)) if *last > now => match self.instants.binary_search_by_key(&now, |(instant, _)| *instant) {
                Ok(place) => self.instants[place].1 += 1,
                Err(place) => self.instants.insert(place, (now, 1)),
            },
            _ => self.instants.push((now, 1)),
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Mean,
    P99,
}

impl Accumulator for Ages {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] = &[(Measure::AgeMean, Figure::Mean), (Measure::AgeP99, Figure::P99)];
    const ROWS: Rows = Rows { ticks: true, holds: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        let receiver = Receiver { sampled: Vec::new(), nanos: 0, instants: Vec::new() };
        Self {
            receivers: vec![receiver; asked.scene.peers.len()],
            nanos: 0,
            count: 0,
            sketch: asked.has(Measure::AgeP99).then(QuantileSketch::default),
        }
    }

    fn on_hold(&mut self, row: &HoldRow) {
        let receiver = &mut self.receivers[row.to];
        let before = match receiver.place_of(row.from, row.to) {
            Ok(place) => Some(std::mem::replace(&mut receiver.sampled[place].1, row.sampled)),
            Err(place) => {
                receiver.sampled.insert(place, (row.from, row.sampled));
                None
            }
        };
        // Add before subtracting: the sum is unsigned.
        receiver.nanos = receiver.nanos + u128::from(row.sampled.as_nanos()) - before.map_or(0, |before| u128::from(before.as_nanos()));
        if self.sketch.is_some() {
            receiver.replace(before, row.sampled);
        }
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        // One sum for each receiver makes the tick of a peer independent of its number of senders.
        let Receiver { sampled, nanos, instants } = &self.receivers[row.peer];
        let held = sampled.len() as u64;
        // Σ (tick − sampled) over all held samples, in one multiplication.
        self.nanos += u128::from(held) * u128::from(row.at.as_nanos()) - nanos;
        // Every held sample has an age at this tick.
        self.count += held;
        if let Some(sketch) = &mut self.sketch {
            for (sampled, count) in instants {
                sketch.insert_many(seconds(row.at.as_nanos() - sampled.as_nanos()), *count);
            }
        }
    }

    fn value(&self, figure: Figure, _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        match figure {
            Figure::P99 => self.sketch.as_ref()?.quantile(99),
            Figure::Mean => ratio(self.nanos, self.count).map(|nanos| 1e-9 * nanos),
        }
    }
}

/// Converts nanoseconds to seconds by a product with 10⁻⁹, which is faster than a division.
#[expect(clippy::cast_precision_loss, reason = "an age above 104 days is rounded to its nearest double")]
fn seconds(nanos: u64) -> f64 {
    nanos as f64 * 1e-9
}
