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
    /// A sample of one instant takes the place of one of another, if there was one.
    fn replace(&mut self, before: Option<Instant>, now: Instant) {
        let place = |instants: &[(Instant, u64)], at: Instant| instants.binary_search_by_key(&at, |(instant, _)| *instant);
        if let Some(Ok(place)) = before.map(|before| place(&self.instants, before)) {
            self.instants[place].1 -= 1;
            if self.instants[place].1 == 0 {
                self.instants.remove(place);
            }
        }
        match place(&self.instants, now) {
            Ok(place) => self.instants[place].1 += 1,
            Err(place) => self.instants.insert(place, (now, 1)),
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
        let before = match receiver.sampled.binary_search_by_key(&row.from, |(from, _)| *from) {
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
