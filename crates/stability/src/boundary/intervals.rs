//! Which intervals between samples need another look.

use std::collections::BTreeMap;

use crate::{Cell, Verdict};

/// The radius within an interval is taken to leave the chord by at most this many times what the second differences around it say.
const SAFETY: f64 = 4.0;

/// The values looked at so far, in order.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Samples(BTreeMap<Ordered, Cell>);

/// A number that is ordered as [`f64::total_cmp`] says.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl Samples {
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn extend(&mut self, found: impl Iterator<Item = (f64, Cell)>) {
        self.0.extend(found.map(|(value, cell)| (Ordered(value), cell)));
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (f64, Cell)> {
        self.0.iter().map(|(value, cell)| (value.0, *cell))
    }
}

/// A sample as it is judged.
#[derive(Clone, Copy, Debug)]
struct Sample {
    at: f64,
    /// The logarithm of the radius.
    level: f64,
    /// How far it may be off.
    error: f64,
    verdict: Verdict,
}

impl Sample {
    fn of((at, Cell { radius, .. }): (f64, Cell)) -> Self {
        // Beyond e^±50 nothing is gained by going on, and infinities have no second difference.
        const LARGEST: f64 = 50.0;
        let log = |value: f64| if value.is_nan() { 0.0 } else { libm::log(value.max(0.0)).clamp(-LARGEST, LARGEST) };
        let level = log(radius.value);
        let error = if radius.value > 0.0 { (radius.error / radius.value).min(LARGEST) } else { 0.0 };
        Self { at, level, error: if error.is_nan() { LARGEST } else { error }, verdict: radius.verdict() }
    }
}

/// The middles of all intervals that need another look, ascending. `spacing`: that of the first samples.
pub(super) fn wanted(samples: &Samples, tolerance: f64, spacing: f64) -> Vec<f64> {
    let samples: Vec<Sample> = samples.iter().map(Sample::of).collect();
    let middle = |place: usize| {
        let (low, high) = (samples[place], samples[place + 1]);
        let middle = low.at + 0.5 * (high.at - low.at);
        // Between two neighbouring doubles there is nothing.
        (middle > low.at && middle < high.at && needs_a_look(&samples, place, tolerance, spacing)).then_some(middle)
    };
    (0..samples.len().saturating_sub(1)).filter_map(middle).collect()
}

/// Whether something may be hidden between a sample and the next.
fn needs_a_look(samples: &[Sample], place: usize, tolerance: f64, spacing: f64) -> bool {
    let (low, high) = (samples[place], samples[place + 1]);
    let width = high.at - low.at;
    if width <= tolerance {
        return false;
    }
    match (low.verdict, high.verdict) {
        (one, other) if one != other => true,
        // A marginal stretch, or one in which nothing is known of the radius, is looked at twice as closely as the rest, and then believed: what the radius does
        // within its error, or without a number, has no bend.
        (Verdict::Marginal | Verdict::Overflow, _) => width > 0.75 * spacing,
        _ => {
            let before = place.checked_sub(1).map(|place| bend(samples, place));
            let after = (place + 2 < samples.len()).then(|| bend(samples, place));
            let bend = before.into_iter().chain(after).fold(0.0, f64::max);
            let distance = (low.level.abs() - low.error).min(high.level.abs() - high.error);
            // The parabola with the second difference D leaves its chord by D·(width/2)².
            distance <= SAFETY * bend * 0.25 * width * width
        }
    }
}

/// The size of the second divided difference of a sample and the next two.
fn bend(samples: &[Sample], place: usize) -> f64 {
    let [a, b, c] = [samples[place], samples[place + 1], samples[place + 2]];
    let slope = |a: Sample, b: Sample| (b.level - a.level) / (b.at - a.at);
    ((slope(b, c) - slope(a, b)) / (c.at - a.at)).abs()
}
