//! Sorted delays as intervals (cells), because a clock of finite resolution shows a delay only as an interval.
//!
//! A clock of resolution r shows the delay x for all true delays between x − r/2 and x + r/2. A law has a probability for this interval. A density at x
//! would have no bound, and the most probable law would be infinite at the least delay.

use super::Measurements;
use crate::series::{self, count, count_u64};

/// An interval of delays, and the number of measured delays in it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Cell {
    /// Lower end \[s\].
    pub(super) low: f64,
    /// Upper end \[s\].
    pub(super) high: f64,
    /// Number of delays in the interval.
    pub(super) count: f64,
}

/// A sorted sample as cells, in increasing order and without overlap.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Cells {
    /// Cells in increasing order.
    pub(super) cells: Vec<Cell>,
    /// Number of all delays.
    pub(super) n: f64,
}

/// A nanosecond \[s\], the finest step of a link's delay.
const NANO: f64 = 1e-9;
/// Relative difference of two numbers up to which rounding may be the only difference.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Least width of a cell, as a share of the mean deviation from the median. With this width the difference of two probabilities keeps six digits, and a law
/// cannot gain likelihood from a single delay.
const NARROWEST: f64 = 1e-6;
/// Number of cells up to which no coarser cells are needed.
const FEW: usize = 200;
/// Largest share of the delays beyond a cell, on the side with fewer delays, that is merged into the cell for the search of a law.
const COARSE: f64 = 1.0 / 12.0;
/// Largest number of cells in the judgement of a law.
const JUDGED: f64 = 50_000.0;

/// Returns the resolution of the clock \[s\]: the greatest step such that all differences of delays are whole multiples, in nanoseconds. A removed drift is
/// added again first, because the clock showed the delays with the drift. Returns `None` for equal delays.
pub(super) fn resolution(measurements: &Measurements) -> Option<f64> {
    let first_s = measurements.packets().first()?.sent_s;
    let drift = measurements.removed().map_or(0.0, |skew| skew.seconds_per_second);
    let mut shown: Vec<f64> = measurements.arrivals().map(|(sent_s, delay_s)| delay_s + drift * (sent_s - first_s)).collect();
    shown.sort_by(f64::total_cmp);
    let least = *shown.first()?;
    // The unit is a nanosecond, or more where floating point cannot hold nanoseconds, as for a delay of some months.
    let unit = NANO.max(ROUNDING * shown.last()?.abs().max(least.abs()));
    let mut differences: Vec<f64> = shown.iter().map(|delay| (delay - least) / unit).collect();
    // Differences below half a unit count as equal, because adding the drift leaves rounding errors.
    differences.dedup_by(|later, earlier| *later - *earlier < 0.5);
    (differences.len() > 1).then(|| step(&differences) * unit)
}

/// Returns the greatest common step of increasing differences. The first difference is zero, at least one more follows, and each is known to one unit.
fn step(differences: &[f64]) -> f64 {
    let least_gap = differences.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    // A clock with a tick of no whole number of nanoseconds (1/90 000 s, 1/64 s) shows rounded multiples. Each multiple that fits makes the estimate of the
    // tick more accurate: `known` ticks are right to one unit.
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
    // Two neighbouring multiples need not both occur. Euclid's algorithm then finds the tick, but in whole units only.
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
    /// Divides sorted delays of a clock: a cell for each value shown by the clock. `tick` returns the tick of the clock \[s\] for the delay with that index.
    pub(super) fn new(sorted: &[f64], tick: impl Fn(usize) -> f64) -> Self {
        let median = sorted[sorted.len() / 2];
        let deviation = series::mean(&sorted.iter().map(|delay| (delay - median).abs()).collect::<Vec<_>>()).unwrap_or(0.0);
        let narrowest = (NARROWEST * deviation).max(ROUNDING * sorted[sorted.len() - 1].abs());
        // Least value, greatest value, count and width of each cell. Values less than half a width apart share a cell, as with a fine clock.
        let mut shared: Vec<(f64, f64, usize, f64)> = Vec::new();
        for (place, &delay) in sorted.iter().enumerate() {
            match shared.last_mut() {
                Some((first, last, held, width)) if delay - *first < *width / 2.0 => (*last, *held) = (delay, *held + 1),
                _ => shared.push((delay, delay, 1, tick(place).max(narrowest))),
            }
        }
        let cell = |(place, &(first, last, held, width)): (usize, &(f64, f64, usize, f64))| {
            // Half a width around the values, but not beyond the middle between two neighbours. Where the tick changes, as in ping from 9.99 ms to 10.0 ms,
            // that middle is the true border: 9.995 ms.
            let before = place.checked_sub(1).map_or(f64::NEG_INFINITY, |before| f64::midpoint(shared[before].1, first));
            let after = shared.get(place + 1).map_or(f64::INFINITY, |after| f64::midpoint(last, after.0));
            Cell { low: before.max(first - width / 2.0), high: after.min(last + width / 2.0), count: count(held) }
        };
        let cells = shared.iter().enumerate().map(cell).collect();
        Self { cells, n: count(sorted.len()) }
    }

    /// Returns few cells with nearly the same information, for the many laws of a search: single cells at both ends, wide cells in the middle.
    pub(super) fn coarse(&self) -> Self {
        if self.cells.len() <= FEW { self.clone() } else { self.merged(|before, after| COARSE * before.min(after)) }
    }

    /// Returns at most about [`JUDGED`] cells, for the judgement of a law.
    pub(super) fn judged(&self) -> Self {
        self.merged(|_, _| self.n / JUDGED)
    }

    /// Merges neighbouring cells as long as a merged cell has at most `most(before, after)` delays, given the numbers of delays before and after the cell.
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
            // The gap between two cells is divided in halves, so that k delays of a merged cell stand for k spacings between delays.
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
        // Rounded to a tick. The least value is arbitrary, as with two clocks apart.
        let ticks = |tick: f64, shown: &dyn Fn(f64) -> f64| (0..60).map(|i| 0.012_345 + shown(f64::from(i * i % 37) * tick)).collect::<Vec<_>>();
        let nanos = |x: f64| (x * 1e9).round() / 1e9;
        for (delays, expected) in [
            (ticks(1e-3, &|x| x), 1e-3),
            (ticks(15.625e-3, &|x| x), 15.625e-3),
            // The 90 kHz clock of RTP for pictures has a tick of no whole number of nanoseconds.
            (ticks(1.0 / 90_000.0, &nanos), 1.0 / 90_000.0),
            (vec![0.020, 0.022, 0.025, 0.025], 1e-3),
            (vec![0.020, 0.024, 0.028], 4e-3),
            (vec![0.020, 0.020_123_457, 0.025], 1e-9),
        ] {
            let found = resolution(&of(&delays)).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
        assert_eq!(resolution(&of(&[0.02; 5])), None);
        // Clocks three centuries apart: rounding to two microseconds does not hide steps of a second.
        assert!((resolution(&of(&ticks(1.0, &|x| x + 1e10))).unwrap() - 1.0).abs() < 1e-4);
    }

    #[test]
    fn cells_meet_where_the_tick_changes() {
        // ping prints 9.98, 9.99 and then 10.0 ms, for all from 9.995 to 10.05 ms.
        let cells = Cells::new(&[9.98, 9.99, 10.0, 10.1], |place| if place < 2 { 0.01 } else { 0.1 });
        let ends = [(9.975, 9.985), (9.985, 9.995), (9.995, 10.05), (10.05, 10.15)];
        assert!(
            cells.cells.iter().zip(ends).all(|(cell, (low, high))| (cell.low - low).abs() < 1e-12 && (cell.high - high).abs() < 1e-12),
            "{cells:?}"
        );
    }

    #[test]
    fn every_delay_is_in_one_cell() {
        let cells = Cells::new(&[1.0, 1.0, 2.0, 5.0], |_| 1.0);
        let cell = |low, high, count| Cell { low, high, count };
        assert_eq!(cells.cells, [cell(0.5, 1.5, 2.0), cell(1.5, 2.5, 1.0), cell(4.5, 5.5, 1.0)]);
        // A finer clock: 20 000 values of a uniform law.
        let fine: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 1e-3).collect();
        for cells in [Cells::new(&fine, |_| 1e-12), Cells::new(&fine, |_| 1e-12).coarse(), Cells::new(&fine, |_| 0.0).judged()] {
            assert!((cells.cells.iter().map(|cell| cell.count).sum::<f64>() - 20_000.0).abs() < 0.5);
            assert!(cells.cells.iter().all(|cell| cell.low < cell.high) && cells.cells.windows(2).all(|pair| pair[0].high <= pair[1].low));
        }
        let coarse = Cells::new(&fine, |_| 1e-12).coarse().cells;
        assert!((100..400).contains(&coarse.len()) && coarse[0].count < 1.5 && coarse[coarse.len() - 1].count < 1.5, "{}", coarse.len());
        // A wide cell has the same share of the law as of the delays.
        assert!(coarse.iter().filter(|cell| cell.count > 1.5).all(|cell| ((cell.high - cell.low) / 1e-3 / cell.count - 1.0).abs() < 1e-6));
    }
}
