//! Representation of time: events in whole nanoseconds compared with steps of a millisecond.
//!
//! Other simulators of control over networks use steps, and represent every time as a number of steps. The rows compare the cost of both representations with
//! the effect on delays and on the verdict of stability. Steps have no effect for peers that tick together every millisecond if delays are rounded up, which
//! is a row too.

mod events;
mod steps;
#[cfg(test)]
mod tests;
mod traffic;
mod verdicts;

use std::time::Duration;

use cohaptic_stability::Method;

use crate::cost::median_time;
use crate::watch::RowSink;
use crate::{AccuracyError, Options, Row, Subject, Watch};
use steps::Rounding;
use traffic::{Errors, Traffic};
use verdicts::{Times, grid};

const COST: &str = "ns a packet";
const MEAN: &str = "mean delay [s]";
const WORST: &str = "worst delay of a packet [s]";
const WRONG: &str = "wrong verdicts [1]";
const DELAYS: &str = "instant of sampling plus the delay of the link";
const VERDICTS: &str = "stability analysis of the scene as written, reduced";

/// A setting of the peers' clocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clocks {
    /// Name of the setting.
    name: &'static str,
    /// Period of the ticks.
    tick: Duration,
    /// Offset from each peer to the next.
    offset: Duration,
}

pub(crate) const CLOCKS: [Clocks; 3] = [
    Clocks { name: "1 ms ticks in lockstep", tick: Duration::from_millis(1), offset: Duration::ZERO },
    Clocks { name: "1 ms ticks, clocks 0.37 ms apart", tick: Duration::from_millis(1), offset: Duration::from_micros(370) },
    Clocks { name: "0.7 ms ticks in lockstep", tick: Duration::from_micros(700), offset: Duration::ZERO },
];

/// Compared steps \[ns\].
const STEPS: [u64; 4] = [1_000_000, 100_000, 10_000, 1_000];

/// Measures the rows of this subject.
///
/// # Errors
///
/// The errors of [`crate::measure`].
pub fn rows(options: Options, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut sink = RowSink { rows: Vec::new(), watch };
    for clocks in CLOCKS {
        let work = Work::new(clocks, options, watch)?;
        for way in Way::all() {
            sink.check()?;
            work.rows(way, watch)?.into_iter().try_for_each(|row| sink.push(row))?;
        }
    }
    Ok(sink.rows)
}

/// A representation of time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Way {
    Events,
    Steps(Duration, Rounding),
}

impl Way {
    fn all() -> impl Iterator<Item = Self> {
        let steps = |rounding| STEPS.map(move |nanos| Self::Steps(Duration::from_nanos(nanos), rounding));
        std::iter::once(Self::Events).chain(Rounding::BOTH.into_iter().flat_map(steps))
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Events => "events in nanoseconds",
            Self::Steps(_, Rounding::Up) => "steps, rounded up",
            Self::Steps(_, Rounding::Nearest) => "steps, rounded to the nearest",
        }
    }

    fn setting(self) -> String {
        match self {
            Self::Events => String::new(),
            Self::Steps(step, _) => format!("{step:?} a step"),
        }
    }
}

/// Traffic and scenes of one setting of clocks.
struct Work {
    clocks: Clocks,
    traffic: Traffic,
    /// Scenes of the grid, each with its stiffness \[N/m\] and its verdict, as far as the verdict can be told.
    scenes: Vec<(Times, f64, bool)>,
    /// Number of timed rounds of each representation of time. The median of their times gives the cost.
    rounds: usize,
}

impl Work {
    fn new(clocks: Clocks, options: Options, watch: &dyn Watch) -> Result<Self, AccuracyError> {
        let (sendings, side, rounds) = if options.quick { (250, 11, 5) } else { (1250, 25, 15) };
        let Clocks { tick, offset, .. } = clocks;
        let mut scenes = Vec::new();
        for (delay, stiffness) in grid(side) {
            if watch.stops() {
                return Err(AccuracyError::Stopped);
            }
            let times = Times { tick, offset, delay };
            // A scene without a clear verdict cannot be called right or wrong, so it is left out.
            scenes.extend(times.verdict(stiffness, Method::Reduced)?.map(|stable| (times, stiffness, stable)));
        }
        Ok(Self { clocks, traffic: Traffic::new(tick * 8, offset, sendings), scenes, rounds })
    }

    /// Measures the rows of one representation of time.
    fn rows(&self, way: Way, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
        let traffic = &self.traffic;
        let mut errors = Errors::default();
        let mut failure = None;
        let cost = match way {
            Way::Events => {
                // The errors come from a run of their own, so that the timed runs do no bookkeeping.
                events::carry(traffic, |arrival| errors.add(traffic, arrival))?;
                median_time(self.rounds, || {
                    // Summing the delays keeps the compiler from leaving out the work.
                    let mut sum = Duration::ZERO;
                    failure = events::carry(traffic, |arrival| sum += arrival.delay).err();
                    sum
                })
            }
            Way::Steps(step, rounding) => {
                steps::carry(traffic, step, rounding, |arrival| errors.add(traffic, arrival));
                median_time(self.rounds, || {
                    let mut sum = Duration::ZERO;
                    steps::carry(traffic, step, rounding, |arrival| sum += arrival.delay);
                    sum
                })
            }
        };
        if let Some(failure) = failure {
            return Err(failure);
        }
        let cost = (cost.as_secs_f64() * 1e9 / traffic.packets(), COST);
        let row = |error, error_unit, reference, note: String| Row {
            error: Some(error),
            error_unit,
            reference,
            note,
            ..Row::of(Subject::Time, self.clocks.name, way.name(), way.setting(), cost)
        };
        let mut rows = vec![row(errors.of_mean(), MEAN, DELAYS, String::new()), row(errors.worst(), WORST, DELAYS, String::new())];
        let (share, note) = self.wrong(way, watch)?;
        rows.push(row(share, WRONG, VERDICTS, note));
        Ok(rows)
    }

    /// Returns the share of scenes whose verdict differs from the verdict of the scene as written, and a note.
    fn wrong(&self, way: Way, watch: &dyn Watch) -> Result<(f64, String), AccuracyError> {
        let (mut wrong, mut hidden) = (0_u32, 0_u32);
        for (times, stiffness, right) in &self.scenes {
            if watch.stops() {
                return Err(AccuracyError::Stopped);
            }
            let found = match way {
                // The full method pushes unit vectors through the peers of the program, so it is independent of the reference.
                Way::Events => times.verdict(*stiffness, Method::Full)?,
                Way::Steps(step, rounding) => times.in_steps(step, rounding).verdict(*stiffness, Method::Reduced)?,
            };
            // An undecided verdict counts as wrong, because the scene as written has a clear verdict.
            wrong += u32::from(found != Some(*right));
            hidden += u32::from(found == Some(true) && !right);
        }
        let how = match way {
            Way::Events => "by unit vectors through the program's peers at the scene's own instants",
            Way::Steps(..) => "ticks, offsets and delays as numbers of steps",
        };
        let all = u32::try_from(self.scenes.len()).unwrap_or(u32::MAX);
        let note = format!("{how}: {wrong} of {all} scenes, {hidden} of them called stable that are not");
        Ok((f64::from(wrong) / f64::from(all.max(1)), note))
    }
}
