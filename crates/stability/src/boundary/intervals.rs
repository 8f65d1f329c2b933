//! The choice of intervals between samples that need to be halved.

use std::collections::BTreeMap;

use crate::{Cell, Verdict};

/// The factor of the estimated distance between the radius and its chord within an interval. The estimate comes from the second differences around the
/// interval.
const SAFETY: f64 = 4.0;

/// The cells computed so far, ordered by value.
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

/// The numbers of a sample by which intervals are judged.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Value of the key.
    at: f64,
    /// Logarithm of the radius, clamped to ±50.
    level: f64,
    /// Bound of the error of `level`, to first order.
    error: f64,
    verdict: Verdict,
}

impl Sample {
    fn of((at, Cell { radius, .. }): (f64, Cell)) -> Self {
        // The exact size of radii beyond e^±50 does not matter, and infinite levels would have no second difference.
        const LARGEST: f64 = 50.0;
        let log = |value: f64| if value.is_nan() { 0.0 } else { libm::log(value.max(0.0)).clamp(-LARGEST, LARGEST) };
        let level = log(radius.value);
        let error = if radius.value > 0.0 { (radius.error / radius.value).min(LARGEST) } else { 0.0 };
        Self { at, level, error: if error.is_nan() { LARGEST } else { error }, verdict: radius.verdict() }
    }
}

/// Returns the middles of all intervals that need to be halved, ascending. `spacing` is the distance between values of the first pass.
pub(super) fn wanted(samples: &Samples, tolerance: f64, spacing: f64) -> Vec<f64> {
    let samples: Vec<Sample> = samples.iter().map(Sample::of).collect();
    let middle = |place: usize| {
        let (low, high) = (samples[place], samples[place + 1]);
        let middle = low.at + 0.5 * (high.at - low.at);
        // Two neighbouring doubles have no double between them.
        (middle > low.at && middle < high.at && needs_a_look(&samples, place, tolerance, spacing)).then_some(middle)
    };
    (0..samples.len().saturating_sub(1)).filter_map(middle).collect()
}

/// Returns whether the verdict may change between the sample `place` and the next.
fn needs_a_look(samples: &[Sample], place: usize, tolerance: f64, spacing: f64) -> bool {
    let (low, high) = (samples[place], samples[place + 1]);
    let width = high.at - low.at;
    if width <= tolerance {
        return false;
    }
    match (low.verdict, high.verdict) {
        (one, other) if one != other => true,
        // Marginal intervals, and intervals where the radius is not known, are halved once. Further halving tells nothing: second differences of a radius
        // within its error, or without a number, mean nothing.
        (Verdict::Marginal | Verdict::Overflow, _) => width > 0.75 * spacing,
        _ => {
            // The second differences over this interval and its neighbours below and above; the first and the last interval have one only.
            let before = place.checked_sub(1).map(|place| bend(samples, place));
            let after = (place + 2 < samples.len()).then(|| bend(samples, place));
            let bend = before.into_iter().chain(after).fold(0.0, f64::max);
            let distance = (low.level.abs() - low.error).min(high.level.abs() - high.error);
            // A parabola with the second divided difference D is D·(width/2)² away from its chord in the middle.
            distance <= SAFETY * bend * 0.25 * width * width
        }
    }
}

/// Returns the absolute value of the second divided difference of the level at sample `place` and the next two.
fn bend(samples: &[Sample], place: usize) -> f64 {
    let [a, b, c] = [samples[place], samples[place + 1], samples[place + 2]];
    let slope = |a: Sample, b: Sample| (b.level - a.level) / (b.at - a.at);
    ((slope(b, c) - slope(a, b)) / (c.at - a.at)).abs()
}
