//! Tasks: what the users of a scene are asked to do, judged during a run.
//!
//! The judge of an observed run reads the states of the copies and changes nothing, so a scene moves the same, to the bit, with and without being observed.
//! Operators see the targets of the task in a judge of their own. Every instant at which a judged peer ticks is judged, with the states of all judged peers at
//! their latest ticks. [`Measures`](crate::measures::Measures) has the result of a task, and [`crate::record`] writes its files.
//!
//! ```
//! use cohaptic_harness::Model;
//! use cohaptic_harness::measures::Measures;
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
//! let result = Measures::run(&scene, Model::Least).task.expect("the scene has a task");
//! assert_eq!(result.outcome, TaskOutcome::Done);
//! assert_eq!(result.reached.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod copies;
mod judge;
mod rows;
#[cfg(test)]
mod tests;
mod throughput;

use std::time::Duration;

use cohaptic_scene::{Scene, Target, TaskOutcome};
use cohaptic_units::Instant;
use cohaptic_units::print::Span;

use crate::{Ending, Summary};
pub(crate) use judge::Judge;
pub(crate) use rows::{Event, Seen, TaskRow};
pub use rows::{Failure, FailureReason};
pub use throughput::{Movement, throughput};

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
    /// Movements to these targets, without those from a target to the same place.
    pub movements: Vec<Movement>,
    /// The failure; `None` unless the outcome is [`TaskOutcome::Failed`].
    pub failure: Option<Failure>,
}

/// State of a task at an instant of a run that goes on, of the judged copies with the most reached targets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TaskView {
    /// The target of the instant.
    pub target: Target,
    /// Largest distance from the target that counts as at the target \[m\]; `None` for a task without a radius.
    pub radius: Option<f64>,
    /// Number of reached targets.
    pub reached: usize,
    /// Number of all targets; zero for a target that moves, and for a path.
    pub targets: usize,
    /// Part of the dwell time for which the copies have been at the target without a break, 0 to 1. Zero without a dwell time.
    pub dwelt: f64,
    /// Time from the instant to the start of the task; zero after the start.
    pub until_start: Duration,
    /// Time from the instant, or from the later start, to the end of the time for the task.
    pub left: Duration,
    /// The outcome; `None` while there is none.
    pub outcome: Option<TaskOutcome>,
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
            FailureReason::Tilted => format!(": {name} tilted the object"),
            FailureReason::Gap => ": the devices were too near or too far apart".to_owned(),
        }
    });
    match result.outcome {
        TaskOutcome::Done => format!("done after {after}"),
        TaskOutcome::TimedOut => format!("timed out after {after}"),
        TaskOutcome::Failed => format!("failed after {after}{}", reason.unwrap_or_default()),
        TaskOutcome::Diverged => "the run diverged".to_owned(),
        // People and signals end a live run at any nanosecond.
        TaskOutcome::Unfinished => format!("unfinished: the run ended {} after the start of the task", Span::measured(result.time)),
    }
}

/// Returns whether divergence is the outcome of a task without an outcome until the end of a run. A run has diverged as [`Summary::has_diverged`] says, but an
/// interrupted run leaves its task unfinished.
pub(crate) fn has_diverged(summary: &Summary) -> bool {
    !matches!(summary.ending, Ending::Interrupted(_)) && summary.has_diverged()
}
