//! How old the samples are that peers hold: at each tick of a peer, for each other peer of which anything has arrived, tick less sampling. Both are instants of the
//! scene, so clocks that drift do not count.

use std::time::Duration;

use cohaptic_scene::Measure;
use cohaptic_units::Instant;

use super::quantiles::QuantileSketch;
use super::{Accumulator, Asked, Rows, ratio};
use crate::{HoldRow, TickRow};

/// Ages so far.
#[derive(Clone, Debug)]
pub(super) struct Ages {
    receivers: Vec<Receiver>,
    /// Σ of all ages \[ns\], which is exact.
    nanos: u128,
    count: u64,
    /// `None` if no quantile is asked for.
    sketch: Option<QuantileSketch>,
}

/// The samples that a peer holds.
#[derive(Clone, Debug)]
struct Receiver {
    /// The senders of which it holds one, in ascending order, and when each was sampled: on a topology these are few of all peers.
    sampled: Vec<(usize, Instant)>,
    /// Σ of these instants \[ns\].
    nanos: u128,
    /// These instants in ascending order, and how many samples are of each, if a quantile is asked for. Where peers sample together these are a few.
    instants: Vec<(Instant, u64)>,
}

impl Receiver {
    /// The place of a sender, or where it is to be put. Where all others send, each soon has the place that it has among them. Searches for senders and instants took a
    /// fifth of the time of all measures of ten peers.
    #[inline]
    fn place_of(&self, from: usize, to: usize) -> Result<usize, usize> {
        let likely = from - usize::from(from > to);
        match self.sampled.get(likely) {
            Some((sender, _)) if *sender == from => Ok(likely),
            _ => self.sampled.binary_search_by_key(&from, |(sender, _)| *sender),
        }
    }

    /// A sample of one instant takes the place of one of another, if there was one.
    fn replace(&mut self, before: Option<Instant>, now: Instant) {
        // Mostly the oldest instant gives way to the newest.
        if let Some(before) = before {
            let place = match self.instants.first() {
                Some((first, _)) if *first == before => Some(0),
                _ => self.instants.binary_search_by_key(&before, |(instant, _)| *instant).ok(),
            };
            let place = place.expect("each sample held is counted");
            self.instants[place].1 -= 1;
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
        receiver.nanos = receiver.nanos + u128::from(row.sampled.as_nanos()) - before.map_or(0, |before| u128::from(before.as_nanos()));
        if self.sketch.is_some() {
            receiver.replace(before, row.sampled);
        }
    }

    #[inline]
    fn on_tick(&mut self, row: &TickRow<'_>) {
        let Receiver { sampled, nanos, instants } = &self.receivers[row.peer];
        let held = sampled.len() as u64;
        self.nanos += u128::from(held) * u128::from(row.at.as_nanos()) - nanos;
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

/// A division would take longer than all the rest of a held sample.
#[inline]
#[expect(clippy::cast_precision_loss, reason = "an age above 104 days is rounded to its nearest double")]
fn seconds(nanos: u64) -> f64 {
    nanos as f64 * 1e-9
}
