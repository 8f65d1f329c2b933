//! Delays as their clock shows them: each is an interval.
//!
//! A clock of resolution r shows the delay x for all true delays between x − r/2 and x + r/2. The probability of that interval is what a law can be asked for;
//! a density at x has no bound, and the most probable law would be one that is infinite at the least delay.

use super::Measurements;
use crate::series::{self, count, count_u64};

/// An interval, and the delays in it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Cell {
    /// The lower end \[s\].
    pub(super) low: f64,
    /// The upper end \[s\].
    pub(super) high: f64,
    /// The number of delays.
    pub(super) count: f64,
}

/// A sorted sample as cells in increasing order that do not overlap.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Cells {
    pub(super) cells: Vec<Cell>,
    /// The number of all delays.
    pub(super) n: f64,
}

/// A nanosecond \[s\], the finest step of a link.
const NANO: f64 = 1e-9;
/// Numbers that differ by less than this part of them may be equal but for rounding.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// A cell is no narrower than this part of the mean deviation from the median: the difference of two probabilities then keeps six digits, and a law cannot
/// gain from a single delay.
const NARROWEST: f64 = 1e-6;
/// Samples of at most this number of cells need no coarser ones.
const FEW: usize = 200;
/// The share of the delays beyond a cell, on its shorter side, that are put into one cell while a law is looked for.
const COARSE: f64 = 1.0 / 12.0;
/// The most cells in which a law is judged.
const JUDGED: f64 = 50_000.0;

/// The resolution of the clock \[s\]: the greatest step of which all differences of delays are whole multiples, in nanoseconds. A drift that was taken off
/// is put on again first. `None` if all delays are equal.
pub(super) fn resolution(measurements: &Measurements) -> Option<f64> {
    let first_s = measurements.packets().first()?.sent_s;
    let drift = measurements.removed().map_or(0.0, |skew| skew.seconds_per_second);
    let mut shown: Vec<f64> = measurements.arrivals().map(|(sent_s, delay_s)| delay_s + drift * (sent_s - first_s)).collect();
    shown.sort_by(f64::total_cmp);
    let least = *shown.first()?;
    // Nanoseconds, or what floating point leaves of them: a delay of some months is known to several.
    let unit = NANO.max(ROUNDING * shown.last()?.abs().max(least.abs()));
    let mut differences: Vec<f64> = shown.iter().map(|delay| (delay - least) / unit).collect();
    // Closer than half of one is equal: a drift that was put on again leaves rounding errors.
    differences.dedup_by(|later, earlier| *later - *earlier < 0.5);
    (differences.len() > 1).then(|| step(&differences) * unit)
}

/// The greatest common step of increasing differences from zero, of which there are at least two, known to a unit each.
fn step(differences: &[f64]) -> f64 {
    let least_gap = differences.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    // A clock whose tick is no whole number of nanoseconds (1/90 000 s, 1/64 s) shows rounded multiples. The tick becomes known better with each multiple
    // that it explains: `known` times it is right to a unit.
    let (mut tick, mut known) = (least_gap, 1.0_f64);
    let explains = |&difference: &f64| {
        let times = (difference / tick).round();
        let fits = (difference - times * tick).abs() <= (1.0 + times / known).min(tick / 8.0);
        if fits && times > known {
            (tick, known) = (difference / times, times);
        }
        fits
    };
    if differences.iter().all(explains) {
        return tick;
    }
    // Two neighbouring ticks need not both occur: Euclid's algorithm finds the tick all the same, in whole units.
    count_u64(differences.iter().fold(0_u64, |common, difference| greatest_common_divisor(whole(*difference), common)).max(1))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative; a number beyond 2^64 becomes 2^64 - 1")]
fn whole(units: f64) -> u64 {
    units.round() as u64
}

const fn greatest_common_divisor(mut one: u64, mut other: u64) -> u64 {
    while other != 0 {
        (one, other) = (other, one % other);
    }
    one
}

impl Cells {
    /// The cells of sorted delays, which are not all equal, of a clock of that resolution: one for each value that it shows.
    pub(super) fn new(sorted: &[f64], resolution: f64) -> Self {
        let median = sorted[sorted.len() / 2];
        let deviation = series::mean(&sorted.iter().map(|delay| (delay - median).abs()).collect::<Vec<_>>()).unwrap_or(0.0);
        let width = resolution.max(NARROWEST * deviation).max(ROUNDING * sorted[sorted.len() - 1].abs());
        // The least and the greatest value of each cell. Values nearer than half a cell, as those of a finer clock are, share one.
        let mut shared: Vec<(f64, f64, usize)> = Vec::new();
        for &delay in sorted {
            match shared.last_mut() {
                Some((first, last, held)) if delay - *first < width / 2.0 => (*last, *held) = (delay, *held + 1),
                _ => shared.push((delay, delay, 1)),
            }
        }
        let cell = |(place, &(first, last, held)): (usize, &(f64, f64, usize))| {
            // Half a cell around the values, but not beyond the middle between neighbours.
            let before = place.checked_sub(1).map_or(f64::NEG_INFINITY, |before| f64::midpoint(shared[before].1, first));
            let after = shared.get(place + 1).map_or(f64::INFINITY, |after| f64::midpoint(last, after.0));
            Cell { low: before.max(first - width / 2.0), high: after.min(last + width / 2.0), count: count(held) }
        };
        let cells = shared.iter().enumerate().map(cell).collect();
        Self { cells, n: count(sorted.len()) }
    }

    /// Few cells that say nearly as much, for the many laws that are tried: single ones at both ends, wider ones in the middle.
    pub(super) fn coarse(&self) -> Self {
        if self.cells.len() <= FEW { self.clone() } else { self.merged(|before, after| COARSE * before.min(after)) }
    }

    /// As many cells as are worth their time for the judgement of a law.
    pub(super) fn judged(&self) -> Self {
        self.merged(|_, _| self.n / JUDGED)
    }

    /// Puts neighbours together as long as they hold at most as many delays as `most` says, given the numbers before and after.
    fn merged(&self, most: impl Fn(f64, f64) -> f64) -> Self {
        let mut before = 0.0;
        let mut parts: Vec<(usize, usize, f64)> = Vec::new();
        for (place, cell) in self.cells.iter().enumerate() {
            match parts.last_mut() {
                Some((_, end, held)) if *held + cell.count <= most(before, self.n - before - *held - cell.count) => {
                    (*end, *held) = (place, *held + cell.count)
                }
                _ => {
                    before += parts.last().map_or(0.0, |part| part.2);
                    parts.push((place, place, cell.count));
                }
            }
        }
        let of_part = |&(first, last, held): &(usize, usize, f64)| {
            // The gap between two cells belongs to both, by halves: k delays stand for k of the spacings between delays.
            let low =
                if first < last && first > 0 { f64::midpoint(self.cells[first - 1].high, self.cells[first].low) } else { self.cells[first].low };
            let next = self.cells.get(last + 1).filter(|_| first < last);
            Cell { low, high: next.map_or(self.cells[last].high, |next| f64::midpoint(self.cells[last].high, next.low)), count: held }
        };
        Self { cells: parts.iter().map(of_part).collect(), n: self.n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Measurement;

    fn of(delays: &[f64]) -> Measurements {
        Measurements::new((0..).zip(delays).map(|(i, &delay)| Measurement { sent_s: f64::from(i), delay_s: Some(delay) }).collect()).unwrap()
    }

    #[test]
    fn the_resolution_is_the_greatest_common_step() {
        // Rounded to a tick; the least one is any number, as with clocks that are apart.
        let ticks = |tick: f64, shown: &dyn Fn(f64) -> f64| (0..60).map(|i| 0.012_345 + shown(f64::from(i * i % 37) * tick)).collect::<Vec<_>>();
        let nanos = |x: f64| (x * 1e9).round() / 1e9;
        for (delays, expected) in [
            (ticks(1e-3, &|x| x), 1e-3),
            (ticks(15.625e-3, &|x| x), 15.625e-3),
            // The clock of RTP for pictures, 90 kHz, is no whole number of nanoseconds.
            (ticks(1.0 / 90_000.0, &nanos), 1.0 / 90_000.0),
            (vec![0.020, 0.022, 0.025, 0.025], 1e-3),
            (vec![0.020, 0.024, 0.028], 4e-3),
            (vec![0.020, 0.020_123_457, 0.025], 1e-9),
        ] {
            let found = resolution(&of(&delays)).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
        assert_eq!(resolution(&of(&[0.02; 5])), None);
        // Clocks that are three centuries apart: rounding to two microseconds hides no step of a second.
        assert!((resolution(&of(&ticks(1.0, &|x| x + 1e10))).unwrap() - 1.0).abs() < 1e-4);
    }

    #[test]
    fn every_delay_is_in_one_cell() {
        let cells = Cells::new(&[1.0, 1.0, 2.0, 5.0], 1.0);
        let cell = |low, high, count| Cell { low, high, count };
        assert_eq!(cells.cells, [cell(0.5, 1.5, 2.0), cell(1.5, 2.5, 1.0), cell(4.5, 5.5, 1.0)]);
        // A finer clock: 20 000 values of a uniform law.
        let fine: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 1e-3).collect();
        for cells in [Cells::new(&fine, 1e-12), Cells::new(&fine, 1e-12).coarse(), Cells::new(&fine, 0.0).judged()] {
            assert!((cells.cells.iter().map(|cell| cell.count).sum::<f64>() - 20_000.0).abs() < 0.5);
            assert!(cells.cells.iter().all(|cell| cell.low < cell.high) && cells.cells.windows(2).all(|pair| pair[0].high <= pair[1].low));
        }
        let coarse = Cells::new(&fine, 1e-12).coarse().cells;
        assert!((100..400).contains(&coarse.len()) && coarse[0].count < 1.5 && coarse[coarse.len() - 1].count < 1.5, "{}", coarse.len());
        // A wide cell holds as large a share of this law as of its delays.
        assert!(coarse.iter().filter(|cell| cell.count > 1.5).all(|cell| ((cell.high - cell.low) / 1e-3 / cell.count - 1.0).abs() < 1e-6));
    }
}
