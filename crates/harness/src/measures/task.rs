//! Time and errors of a task.

use std::time::Duration;

use cohaptic_scene::{Measure, TaskOutcome};

use super::{Accumulator, Asked, Rows, mean_square_root};
use crate::TickRow;
use crate::task::Judge;

/// Judge of the task of a scene, for the measures that the judge itself keeps.
#[derive(Clone, Debug)]
pub(super) struct TaskFigures {
    /// `None` for a scene without a task, which asks for no such measure.
    judge: Option<Judge>,
    /// Duration of the scene.
    duration: Duration,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Time,
    Error,
    Outside,
}

impl Accumulator for TaskFigures {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] =
        &[(Measure::TaskTime, Figure::Time), (Measure::TaskError, Figure::Error), (Measure::Outside, Figure::Outside)];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        Self { judge: Judge::of(asked.scene), duration: asked.scene.duration }
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        if let Some(judge) = &mut self.judge {
            judge.on_tick(row, &mut |_, _| ());
        }
    }

    fn value(&self, figure: Figure, peer: Option<usize>, elapsed: Duration) -> Option<f64> {
        // A task is undecided in a run that has not come to the end of the scene, unless it was decided before.
        let otherwise = (elapsed < self.duration).then_some(TaskOutcome::Unfinished);
        let (result, judge) = self.judge.clone()?.finish(otherwise, elapsed, &mut |_, _| ());
        match figure {
            Figure::Time => (result.outcome == TaskOutcome::Done).then_some(result.time.as_secs_f64()),
            Figure::Error => judge.squared_errors(peer?).and_then(|(squares, count)| mean_square_root(squares, count)),
            Figure::Outside => judge.outside(peer?).map(|outside| outside.as_secs_f64()),
        }
    }
}
