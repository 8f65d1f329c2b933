//! Measures of a task: one judge for all of them, and the accumulators that take the ticks of the task.

mod effort;
mod following;
mod smoothness;

use std::time::Duration;

use cohaptic_scene::{Measure, Scene, TaskOutcome};
use cohaptic_units::Instant;

use super::{Accumulator, Asked, Rows, mean_square_root};
use crate::TickRow;
use crate::task::{Judge, TaskResult, TaskView, throughput};
use effort::Effort;
use following::Following;
use smoothness::Smoothness;

/// Judge of the task of a scene, and the accumulators of wanted measures.
#[derive(Clone, Debug)]
pub(super) struct TaskMeasures {
    /// `None` for a scene without a task, which asks for no such measure.
    judge: Option<Judge>,
    effort: Option<Effort>,
    smoothness: Option<Smoothness>,
    following: Option<Following>,
}

/// A measure of a task: a figure of the judge, or of an accumulator.
#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Time,
    Throughput,
    Error,
    Overshoot,
    Outside,
    Effort(effort::Figure),
    Smoothness(smoothness::Figure),
    Following(following::Figure),
}

impl Accumulator for TaskMeasures {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] = &[
        (Measure::TaskTime, Figure::Time),
        (Measure::Throughput, Figure::Throughput),
        (Measure::TaskError, Figure::Error),
        (Measure::Overshoot, Figure::Overshoot),
        (Measure::Outside, Figure::Outside),
        (Measure::MotionForce, Figure::Effort(effort::Figure::Motion)),
        (Measure::InternalForce, Figure::Effort(effort::Figure::Internal)),
        (Measure::Effort, Figure::Effort(effort::Figure::Effort)),
        (Measure::Given, Figure::Effort(effort::Figure::Given)),
        (Measure::Taken, Figure::Effort(effort::Figure::Taken)),
        (Measure::LoadShare, Figure::Effort(effort::Figure::Share)),
        (Measure::Submovements, Figure::Smoothness(smoothness::Figure::Submovements)),
        (Measure::Sparc, Figure::Smoothness(smoothness::Figure::Sparc)),
        (Measure::Ldlj, Figure::Smoothness(smoothness::Figure::Ldlj)),
        (Measure::Lag, Figure::Following(following::Figure::Lag)),
        (Measure::LagResidual, Figure::Following(following::Figure::Residual)),
    ];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn is_needed(scene: &Scene) -> bool {
        scene.task.is_some()
    }

    fn new(asked: &Asked<'_>) -> Self {
        let wants = |of: fn(Figure) -> bool| Self::GIVES.iter().any(|(measure, figure)| of(*figure) && asked.has(*measure));
        Self {
            judge: Judge::of(asked.scene),
            effort: wants(|figure| matches!(figure, Figure::Effort(_))).then(|| Effort::new(asked.scene)),
            smoothness: wants(|figure| matches!(figure, Figure::Smoothness(_))).then(|| Smoothness::new(asked.scene)),
            following: wants(|figure| matches!(figure, Figure::Following(_))).then(|| Following::new(asked.scene)),
        }
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        let Some(judge) = &mut self.judge else { return };
        judge.on_tick(row, &mut |_, _| ());
        let is_under_way = judge.is_under_way(row.at);
        if let Some(effort) = &mut self.effort {
            effort.on_tick(row, is_under_way);
        }
        if !is_under_way {
            return;
        }
        if let Some(smoothness) = &mut self.smoothness {
            smoothness.on_tick(row);
        }
        if let Some(following) = &mut self.following {
            following.on_tick(row);
        }
    }

    fn value(&self, figure: Figure, peer: Option<usize>, elapsed: Duration) -> Option<f64> {
        let finished = || self.judge.clone().map(|judge| judge.finish(false, elapsed, &mut |_, _| ()));
        match figure {
            Figure::Time => finished().and_then(|(result, _)| (result.outcome == TaskOutcome::Done).then_some(result.time.as_secs_f64())),
            Figure::Throughput => finished().and_then(|(result, _)| throughput(&result.movements)),
            Figure::Error => {
                finished().and_then(|(_, judge)| judge.squared_errors(peer?)).and_then(|(squares, count)| mean_square_root(squares, count))
            }
            Figure::Overshoot => finished().and_then(|(_, judge)| judge.overshoot(peer?)),
            Figure::Outside => finished().and_then(|(_, judge)| judge.outside(peer?)).map(|outside| outside.as_secs_f64()),
            Figure::Effort(figure) => self.effort.as_ref()?.value(figure, peer),
            Figure::Smoothness(figure) => self.smoothness.as_ref()?.value(figure, peer?),
            Figure::Following(figure) => self.following.as_ref()?.value(figure, peer?),
        }
    }
}

impl TaskMeasures {
    /// Returns the result at the end of a run of this simulated duration.
    pub(super) fn result(&self, has_diverged: bool, duration: Duration) -> Option<TaskResult> {
        self.judge.clone().map(|judge| judge.finish(has_diverged, duration, &mut |_, _| ()).0)
    }

    /// Returns what there is to see at an instant.
    pub(super) fn view(&self, at: Instant) -> Option<TaskView> {
        self.judge.as_ref().map(|judge| judge.view(at))
    }
}

/// Time between two samples of a copy, for measures that need equal steps of time.
const PERIOD: Duration = Duration::from_millis(10);
/// The same \[s\].
const PERIOD_S: f64 = 0.01;

/// Returns whether a tick at `at` gives the sample after `count` samples of a task from `start` on: the first tick at or after the sample's instant does.
fn is_due(start: Instant, count: usize, at: Instant) -> bool {
    u32::try_from(count).is_ok_and(|count| at >= start.saturating_add(PERIOD.saturating_mul(count)))
}
