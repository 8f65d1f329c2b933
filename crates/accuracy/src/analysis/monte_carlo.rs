//! Probability of an event from runs: its error against the exact probability, and the width of its confidence interval.

use super::every_pattern::{LIMIT, exact, happens, scene};
use super::{Effort, row};
use crate::cost::processor_time;
use crate::watch::RowSink;
use crate::{AccuracyError, Row};

const COST: &str = "s a verdict";
const REFERENCE: &str = "every pattern of losses, weighed";

/// Number of standard deviations below which 97.5 % of a normal law lie.
const Z: f64 = 1.959_963_984_540_054;

/// Measures the rows of the probability.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let mut scene = scene()?;
    let case = format!("probability of more than {:.1} mm apart", 1e3 * LIMIT);
    let start = processor_time();
    let exact = exact(&scene, || done.check())?;
    let seconds = (processor_time() - start).as_secs_f64();
    // The probability of all patterns together is known to be 1, so its error shows the rounding of the weights.
    let weighed = row(&case, "every pattern", format!("{} runs", exact.patterns), (seconds, COST), "certainty: all patterns together");
    let note = format!("{:.6}; the error is that of the weights, which sum to one; each further sample doubles the cost", exact.probability);
    done.push(Row { error: Some((exact.all - 1.0).abs()), error_unit: "probability [1]", note, ..weighed })?;
    for runs in effort.runs {
        let start = processor_time();
        let mut count = 0_u32;
        for run in 0..*runs {
            // The run number is the seed, so that a longer series repeats the runs of a shorter one.
            scene.seed = u64::from(run);
            count += u32::from(happens(&scene));
            if run.is_multiple_of(256) {
                done.check()?;
            }
        }
        let seconds = (processor_time() - start).as_secs_f64();
        let interval = Interval::wilson(count, *runs);
        let covered = if interval.covers(exact.probability) { "covers" } else { "misses" };
        let share = f64::from(count) / f64::from(*runs);
        let note =
            format!("{share:.5}; the interval of 95 % from {:.5} to {:.5} {covered} the exact {:.6}", interval.low, interval.high, exact.probability);
        let row = row(&case, "monte carlo", format!("{runs} runs"), (seconds, COST), REFERENCE);
        done.push(Row { error: Some((share - exact.probability).abs()), error_unit: "probability [1]", note: note.clone(), ..row.clone() })?;
        // A second row shows the width, which is the error that a user without the exact number can state.
        let half = 0.5 * (interval.high - interval.low);
        done.push(Row {
            error: Some(half),
            error_unit: "half of the interval of 95 % [1]",
            reference: "none: what the runs say of themselves",
            note,
            ..row
        })?;
    }
    Ok(())
}

/// Confidence interval of a probability.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    /// Returns Wilson's (1927) interval for `count` events in `runs` runs. The interval lies within \[0, 1\], and has a width even for `count` = 0.
    fn wilson(count: u32, runs: u32) -> Self {
        let (n, share) = (f64::from(runs), f64::from(count) / f64::from(runs));
        let scale = 1.0 / (1.0 + Z * Z / n);
        let middle = scale * (share + 0.5 * Z * Z / n);
        let half = scale * Z * (share * (1.0 - share) / n + 0.25 * Z * Z / (n * n)).sqrt();
        Self { low: middle - half, high: middle + half }
    }

    /// Returns whether the probability lies in the interval.
    fn covers(self, probability: f64) -> bool {
        (self.low..=self.high).contains(&probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both ends solve |p̂ − p| = z·√(p·(1 − p)/n), from which Wilson derived the interval.
    #[test]
    fn the_ends_are_where_the_share_is_just_credible() {
        for (count, runs) in [(1, 10), (5, 10), (37, 1000)] {
            let share = f64::from(count) / f64::from(runs);
            let Interval { low, high } = Interval::wilson(count, runs);
            for end in [low, high] {
                assert!(((share - end).abs() - Z * (end * (1.0 - end) / f64::from(runs)).sqrt()).abs() < 1e-12);
            }
        }
    }

    /// The upper end for no event in n runs is z²/(n + z²).
    #[test]
    fn nothing_seen_is_not_nothing_possible() {
        let Interval { low, high } = Interval::wilson(0, 100);
        assert!(low.abs() < 1e-15 && (high - Z * Z / (100.0 + Z * Z)).abs() < 1e-15);
    }
}
