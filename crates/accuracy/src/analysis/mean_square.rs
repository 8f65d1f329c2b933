//! Growth of the second moment under random loss, by its operator and from simulations.

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_scene::Scene;
use cohaptic_stability::mean_square;

use super::references::{Reference, mean_square_reference};
use super::{Effort, row};
use crate::cost::{median_time, processor_time};
use crate::watch::RowSink;
use crate::{AccuracyError, Row};

const UNIT: &str = "mean-square radius [1]";
const COST: &str = "ms a verdict";
const REFERENCE: &str = "12 digits, by an independent computation";

/// Number of frames whose squares are added and compared with the sum over the following frames of the same number. The window is long, so that the phase of
/// an oscillation has little effect; late, so that faster modes have decayed; and early, so that few runs do not dominate.
const WINDOW: u32 = 24;
/// First frame of the first window.
const BEGIN: u32 = 12;

/// Number of batches of runs, whose spread gives the uncertainty.
const BATCHES: u32 = 10;

/// Measures the rows of the mean square.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let Reference { name, scene, radius, .. } = mean_square_reference();
    let case = format!("mean square, {name}");
    let found = mean_square(&scene)?;
    let millis = median_time(effort.rounds, || mean_square(&scene)).as_secs_f64() * 1e3;
    let note = format!("claims an error of at most {:.0e}; {} unknowns, {}", found.radius.error, found.unknowns, found.method.word());
    let operator = row(&case, "operator", String::new(), (millis, COST), REFERENCE);
    done.push(Row { error: Some((found.radius.value - radius).abs()), error_unit: UNIT, note, ..operator })?;
    for runs in effort.runs {
        let start = processor_time();
        let Estimate { value, spread } = estimate(&scene, *runs, done)?;
        let millis = (processor_time() - start).as_secs_f64() * 1e3;
        let note =
            format!("second moments of {WINDOW} frames and of the next {WINDOW}, which leaves a bias; tenths of the runs spread it by ±{spread:.1e}");
        let row = row(&case, "monte carlo", format!("{runs} runs"), (millis, COST), REFERENCE);
        done.push(Row { error: Some((value - radius).abs()), error_unit: UNIT, note, ..row })?;
    }
    Ok(())
}

/// Radius from runs, and its standard error from the spread of batches.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    value: f64,
    spread: f64,
}

/// Estimates the radius from `runs` runs.
fn estimate(scene: &Scene, runs: u32, done: &RowSink<'_>) -> Result<Estimate, AccuracyError> {
    let mut scene = scene.clone();
    // The run ends with the second window.
    scene.duration = scene.coordination.update * (BEGIN + 2 * WINDOW);
    // Two copies begin apart, and no hand moves them.
    for (peer, place) in scene.peers.iter_mut().zip([-0.01, 0.01]) {
        peer.position[0] = place;
    }
    let mut batches = [[[0.0; 2]; 2]; BATCHES as usize];
    for run in 0..runs {
        scene.seed = u64::from(run);
        let mut seen = Seen { frame: scene.coordination.update, copies: [[0.0; 2]; 2], squares: [[0.0; 2]; 2] };
        let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut seen);
        // Runs are dealt to the batches in turn, so all batches have nearly the same size.
        let batch = &mut batches[(run % BATCHES) as usize];
        for (sum, seen) in batch.iter_mut().flatten().zip(seen.squares.iter().flatten()) {
            *sum += seen;
        }
        if run.is_multiple_of(100) {
            done.check()?;
        }
    }
    // Position and velocity oscillate a quarter of a period apart. Divided by their sizes, their sum oscillates little.
    let total = |which: usize| batches.iter().map(|batch| batch[0][which] + batch[1][which]).sum::<f64>();
    let sizes = [total(0), total(1)];
    let moment = |window: [f64; 2]| window[0] / sizes[0] + window[1] / sizes[1];
    let radius = |[early, late]: [[f64; 2]; 2]| (moment(late) / moment(early)).powf(1.0 / f64::from(WINDOW));
    let sum = |window: usize, which: usize| batches.iter().map(|batch| batch[window][which]).sum::<f64>();
    let value = radius([0, 1].map(|window| [0, 1].map(|which| sum(window, which))));
    let count = f64::from(BATCHES);
    // Variance of a batch's estimate, from the spread of the batches. The mean of all batches has a variance smaller by their number.
    let variance = batches.iter().map(|batch| (radius(*batch) - value).powi(2)).sum::<f64>() / (count - 1.0);
    Ok(Estimate { value, spread: (variance / count).sqrt() })
}

/// Observer of the squared difference between two copies, summed over the ticks of two windows.
struct Seen {
    /// Length of a frame.
    frame: Duration,
    /// Position and velocity of each copy at its latest tick.
    copies: [[f64; 2]; 2],
    /// Sums of squared differences of position and velocity, for each window.
    squares: [[f64; 2]; 2],
}

impl Observer for Seen {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.copies[row.peer] = [row.object.position[0], row.object.velocity[0]];
        let frame = u128::from(row.at.as_nanos()) / self.frame.as_nanos();
        let window = frame.checked_sub(u128::from(BEGIN)).map(|since| since / u128::from(WINDOW));
        let which = window.and_then(|window| usize::try_from(window).ok()).filter(|window| *window < 2);
        // Peer 1 ticks after peer 0, so both copies are of the same tick then.
        if let (1, Some(which)) = (row.peer, which) {
            for quantity in 0..2 {
                self.squares[which][quantity] += (self.copies[1][quantity] - self.copies[0][quantity]).powi(2);
            }
        }
        Ok(())
    }
}
