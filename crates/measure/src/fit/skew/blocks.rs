//! Blocks of arrivals, and the slope in time of a location of their delays.

use super::Location;
use crate::series::{count, mean};

/// Arrivals (sending, delay) \[s\] in the order of sending, divided into blocks of equal size up to one arrival.
pub(super) struct Blocks<'a> {
    /// Arrivals of each block.
    blocks: Vec<&'a [(f64, f64)]>,
    /// Mean instant of sending of each block, relative to `middle` \[s\].
    times: Vec<f64>,
    /// Mean over all blocks of the mean instant of sending \[s\].
    middle: f64,
}

/// A slope with its standard error, for Student's law with two degrees of freedom fewer than blocks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Slope {
    pub(super) value: f64,
    pub(super) error: f64,
}

/// Statistics of the blocks after the removal of a trial drift.
struct Left {
    /// Σ c·T with the times c and the locations T of the blocks. Zero at the slope.
    moment: f64,
    /// Decrease of `moment` per unit of drift.
    fall: f64,
    /// Σ (T − mean)².
    squares: f64,
}

/// Limit of the steps. Each step narrows the interval of the root or halves it, so the last digit is reached earlier.
const MOST_STEPS: usize = 200;

impl<'a> Blocks<'a> {
    /// Divides arrivals into `number` blocks.
    pub(super) fn cut(points: &'a [(f64, f64)], number: usize) -> Self {
        let blocks: Vec<&[(f64, f64)]> =
            (0..number).map(|block| &points[block * points.len() / number..(block + 1) * points.len() / number]).collect();
        let means: Vec<f64> = blocks.iter().map(|block| mean_of(block, |point| point.0)).collect();
        let middle = mean(&means).unwrap_or(0.0);
        Self { times: means.iter().map(|time| time - middle).collect(), middle, blocks }
    }

    /// Returns the drift whose removal leaves the locations of the blocks without a slope, to the tolerance. Returns `None` if all deciding arrivals were
    /// sent at the same instant.
    ///
    /// With growing drift s, a location of d − s·t falls at the rate of its own time. Blocks follow each other in time, so the moment of the locations
    /// falls monotonically and has exactly one root. The moment is piecewise linear, so Newton's method is used; a step that would leave the interval
    /// enclosing the root is replaced by halving.
    pub(super) fn slope(&self, location: Location, tolerance: f64) -> Option<Slope> {
        let spread: f64 = self.times.iter().map(|time| time * time).sum();
        let mut room = Vec::new();
        let mut drift = self.left(Location::Mean, 0.0, &mut room).moment / spread;
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for _ in 0..MOST_STEPS {
            let left = self.left(location, drift, &mut room);
            let step = left.moment / left.fall;
            if !step.is_finite() {
                return None;
            }
            if step.abs() <= tolerance {
                let error = (left.squares / (count(self.blocks.len()) - 2.0) * spread).sqrt() / left.fall;
                return Some(Slope { value: drift, error });
            }
            if step > 0.0 {
                low = drift;
            } else {
                high = drift;
            }
            let next = drift + step;
            // Both bounds are infinite at first, so a step is halved only after the root is enclosed.
            drift = if (low..=high).contains(&next) { next } else { f64::midpoint(low, high) };
        }
        None
    }

    /// Computes the statistics after the removal of a drift. `room` is a buffer.
    fn left(&self, location: Location, drift: f64, room: &mut Vec<(f64, f64)>) -> Left {
        let found: Vec<(f64, f64)> = self.blocks.iter().map(|block| self.locate(location, block, drift, room)).collect();
        let middle = mean_of(&found, |found| found.1);
        let terms = || self.times.iter().zip(&found);
        Left {
            moment: terms().map(|(time, found)| time * (found.1 - middle)).sum(),
            fall: terms().map(|(time, found)| time * found.0).sum(),
            squares: found.iter().map(|found| (found.1 - middle).powi(2)).sum(),
        }
    }

    /// Returns the time and the value of a block's location after the removal of a drift \[s\]. Times are relative to the middle of all blocks.
    fn locate(&self, location: Location, block: &[(f64, f64)], drift: f64, room: &mut Vec<(f64, f64)>) -> (f64, f64) {
        let without = block.iter().map(|&(time, delay)| (time - self.middle, delay - drift * (time - self.middle)));
        let place = match location {
            Location::Mean => {
                room.clear();
                room.extend(without);
                return (mean_of(room, |point| point.0), mean_of(room, |point| point.1));
            }
            Location::Least => return without.reduce(|least, next| if next.1 < least.1 { next } else { least }).unwrap_or_default(),
            Location::Median => (block.len() - 1) / 2,
            Location::LowerEighth => (block.len() - 1) / 8,
        };
        room.clear();
        room.extend(without);
        *room.select_nth_unstable_by(place, |one, other| one.1.total_cmp(&other.1).then(one.0.total_cmp(&other.0))).1
    }
}

/// Returns the residuals of the delays from a straight line by least squares \[s\].
pub(super) fn residuals(points: &[(f64, f64)]) -> Vec<f64> {
    let (time, delay) = (mean_of(points, |point| point.0), mean_of(points, |point| point.1));
    let (product, square) = points.iter().fold((0.0, 0.0), |(product, square), point| {
        let since = point.0 - time;
        (product + since * (point.1 - delay), square + since * since)
    });
    points.iter().map(|point| point.1 - delay - product / square * (point.0 - time)).collect()
}

/// Returns the mean of `of` over the points, and zero for no points.
fn mean_of(points: &[(f64, f64)], of: impl Fn(&(f64, f64)) -> f64) -> f64 {
    // Sums differences from the first value, so that a large common part costs no digits.
    let Some(first) = points.first().map(&of) else { return 0.0 };
    first + points.iter().map(|point| of(point) - first).sum::<f64>() / count(points.len())
}
