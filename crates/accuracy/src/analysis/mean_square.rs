//! The growth of the second moment under random loss: by its operator, and from runs.

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_scene::Scene;
use cohaptic_stability::mean_square;

use super::references::{Reference, mean_square_reference};
use super::{Effort, row};
use crate::cost::{median_time, processor_time};
use crate::row::RowSink;
use crate::{AccuracyError, Row};

const UNIT: &str = "mean-square radius [1]";
const COST: &str = "ms a verdict";
const REFERENCE: &str = "12 digits, by an independent computation";

/// Frames whose squares are added up, and compared with those of as many frames after them: enough that the phase of an oscillation counts little, so late
/// that what dies out sooner is gone, so early that few runs do not decide alone.
const WINDOW: u32 = 24;
/// The first of them.
const BEGIN: u32 = 12;

/// The batches in which runs are taken together, whose spread tells the uncertainty.
const BATCHES: u32 = 10;

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

/// A radius from runs, and its standard error as the spread of batches tells.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    value: f64,
    spread: f64,
}

fn estimate(scene: &Scene, runs: u32, done: &RowSink<'_>) -> Result<Estimate, AccuracyError> {
    let mut scene = scene.clone();
    scene.duration = scene.coordination.update * (BEGIN + 2 * WINDOW);
    // Two copies apart, which no hand moves.
    for (peer, place) in scene.peers.iter_mut().zip([-0.01, 0.01]) {
        peer.position[0] = place;
    }
    let mut batches = [[[0.0; 2]; 2]; BATCHES as usize];
    for run in 0..runs {
        scene.seed = u64::from(run);
        let mut seen = Seen { frame: scene.coordination.update, copies: [[0.0; 2]; 2], squares: [[0.0; 2]; 2] };
        let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut seen);
        let batch = &mut batches[(run % BATCHES) as usize];
        for (sum, seen) in batch.iter_mut().flatten().zip(seen.squares.iter().flatten()) {
            *sum += seen;
        }
        if run.is_multiple_of(100) {
            done.check()?;
        }
    }
    // Position and velocity swing a quarter of a period apart: each counts by its own size, and together they swing little.
    let total = |which: usize| batches.iter().map(|batch| batch[0][which] + batch[1][which]).sum::<f64>();
    let sizes = [total(0), total(1)];
    let moment = |window: [f64; 2]| window[0] / sizes[0] + window[1] / sizes[1];
    let radius = |[early, late]: [[f64; 2]; 2]| (moment(late) / moment(early)).powf(1.0 / f64::from(WINDOW));
    let sum = |window: usize, which: usize| batches.iter().map(|batch| batch[window][which]).sum::<f64>();
    let value = radius([0, 1].map(|window| [0, 1].map(|which| sum(window, which))));
    let count = f64::from(BATCHES);
    let variance = batches.iter().map(|batch| (radius(*batch) - value).powi(2)).sum::<f64>() / (count - 1.0);
    Ok(Estimate { value, spread: (variance / count).sqrt() })
}

/// The sum over the ticks of two windows of the squared difference between two copies.
struct Seen {
    frame: Duration,
    /// Position and velocity of each.
    copies: [[f64; 2]; 2],
    /// For each window, those of the difference.
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
        if let (1, Some(which)) = (row.peer, which) {
            for quantity in 0..2 {
                self.squares[which][quantity] += (self.copies[1][quantity] - self.copies[0][quantity]).powi(2);
            }
        }
        Ok(())
    }
}
