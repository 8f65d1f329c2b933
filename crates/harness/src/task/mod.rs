//! Tasks: what the users of a scene are asked to do, judged during a run.
//!
//! A [`TaskWatch`] is an [`Observer`]: it reads the states of the copies and changes nothing, so a scene moves the same, to the bit, with and without its task.
//! Every instant at which a judged peer ticks is judged, with the states of all judged peers at their latest ticks. [`crate::record`] writes the files of a task.
//!
//! ```
//! use cohaptic_harness::task::TaskWatch;
//! use cohaptic_harness::{Model, Simulation};
//! use cohaptic_scene::{Scene, TaskOutcome};
//!
//! let text = r#"
//!     scene = { duration = "5s", count = 2 }
//!     object = { mass = 0.45 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     peers = [{ name = "peer1", hand = { arm = { mass = 0.5, damping = 20.0, stiffness = 300.0 }, follows = { position = 0.1 } } }]
//!     link = { delay = "24ms" }
//!     task = { kind = "reach", targets = [0.1], radius = 0.005 }
//! "#;
//! let scene = Scene::parse(text, "two.toml".as_ref(), &[])?;
//! let mut watch = TaskWatch::of(&scene).expect("the scene has a task");
//! let summary = Simulation::new(&scene, Model::Least).run(&mut watch)?;
//! let result = watch.result(&summary);
//! assert_eq!(result.outcome, TaskOutcome::Done);
//! assert_eq!(result.reached.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod judge;
#[cfg(test)]
mod tests;

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_scene::{Scene, TaskOutcome};
use cohaptic_units::Instant;
use cohaptic_units::print::Span;

use crate::{Ending, Observer, Summary, TickRow};
pub(crate) use judge::{Event, Judge, Seen, TaskRow};
pub use judge::{Failure, FailureReason};

/// Result of a task.
#[derive(Clone, PartialEq, Debug)]
pub struct TaskResult {
    /// The outcome.
    pub outcome: TaskOutcome,
    /// Instant of the outcome: the end of the run for [`TaskOutcome::Unfinished`].
    pub at: Instant,
    /// Time from the start of the task to the outcome; zero if the run ended before the start.
    pub time: Duration,
    /// Instants at which targets were reached, in the order of reaching. Where each peer is judged alone, the instants of the peer with the most targets.
    pub reached: Vec<Instant>,
    /// The failure; `None` unless the outcome is [`TaskOutcome::Failed`].
    pub failure: Option<Failure>,
}

/// Returns the outcome of a task in words: `done after 2.821 s`, `failed after 1.2 s: left dropped the object`.
#[must_use]
pub fn task_words(result: &TaskResult, scene: &Scene) -> String {
    let after = Span(result.time);
    let reason = result.failure.map(|failure| {
        let name = &scene.peers[failure.peer].name;
        match failure.reason {
            FailureReason::Dropped => format!(": {name} dropped the object"),
            FailureReason::Left => format!(": {name} left the target"),
        }
    });
    match result.outcome {
        TaskOutcome::Done => format!("done after {after}"),
        TaskOutcome::TimedOut => format!("timed out after {after}"),
        TaskOutcome::Failed => format!("failed after {after}{}", reason.unwrap_or_default()),
        TaskOutcome::Diverged => "the run diverged".to_owned(),
        TaskOutcome::Unfinished => format!("unfinished: the run ended {after} after the start of the task"),
    }
}

/// Observer that judges the task of a scene.
#[derive(Clone, Debug)]
pub struct TaskWatch {
    judge: Judge,
}

impl TaskWatch {
    /// Returns the observer before the run; `None` for a scene without a task.
    #[must_use]
    pub fn of(scene: &Scene) -> Option<Self> {
        Judge::of(scene).map(|judge| Self { judge })
    }

    /// Returns the result after the run with this summary.
    #[must_use]
    pub fn result(&self, summary: &Summary) -> TaskResult {
        self.judge.clone().finish(without_outcome(summary), summary.duration, &mut |_, _| ()).0
    }
}

impl Observer for TaskWatch {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.judge.on_tick(row, &mut |_, _| ());
        Ok(())
    }
}

/// Returns the outcome of a task that had no outcome before the end of a run; `None` if the deadline of the task decides. A run has diverged as
/// [`Summary::has_diverged`] says.
pub(crate) fn without_outcome(summary: &Summary) -> Option<TaskOutcome> {
    match summary.ending {
        Ending::Complete | Ending::Diverged(_) => summary.has_diverged().then_some(TaskOutcome::Diverged),
        Ending::Interrupted(_) => Some(TaskOutcome::Unfinished),
    }
}
