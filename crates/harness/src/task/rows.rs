//! Rows that a judge gives: judged instants and events.

use cohaptic_scene::{Target, TaskOutcome};
use cohaptic_units::Instant;

/// Failure of a task.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Failure {
    /// Index of the peer that failed.
    pub peer: usize,
    /// Reason of the failure.
    pub reason: FailureReason,
}

/// Reason of a failure of a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FailureReason {
    /// The coupling force exceeded the limit of the task.
    Dropped,
    /// The copy was outside of the target for longer than the grace time, or outside of the lane.
    Left,
    /// The copy was not level.
    Tilted,
    /// The distance to another device was beyond a limit.
    Gap,
}

impl FailureReason {
    /// Returns the reason in one word, for documents.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dropped => "dropped",
            Self::Left => "left",
            Self::Tilted => "tilted",
            Self::Gap => "gap",
        }
    }
}

/// Event of a task. A peer is an index in [`Scene::peers`]; `None` stands for all judged peers together.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Event {
    /// The copy of a peer came within the radius and the angle of the target.
    Entered {
        /// The peer.
        peer: usize,
        /// Number of the target, from 0.
        goal: usize,
    },
    /// The copy of a peer left the radius or the angle of the target.
    Left {
        /// The peer.
        peer: usize,
        /// Number of the target, from 0.
        goal: usize,
    },
    /// A target was reached.
    Reached {
        /// The peer.
        peer: Option<usize>,
        /// Number of the target, from 0.
        goal: usize,
    },
    /// The task has its outcome.
    Ended {
        /// The peer that is done or has failed.
        peer: Option<usize>,
        /// The outcome.
        outcome: TaskOutcome,
        /// Number of the target at the end, from 0.
        goal: usize,
    },
}

/// Row of the records of a task.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum TaskRow {
    /// An instant was judged.
    Judged(Seen),
    /// Something happened at the instant.
    Event(Event),
}

/// Function that takes the rows of a task, each with its instant, in order of time.
pub(crate) type OnRow<'a> = &'a mut dyn FnMut(Instant, TaskRow);

/// State of a group at a judgement, for records: of the group with the most reached targets, and among equals of the first.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Seen {
    /// Number of the target, from 0.
    pub(crate) goal: usize,
    /// The target.
    pub(crate) target: Target,
    /// Largest distance of a copy of the group from the target \[m\].
    pub(crate) error: f64,
    /// Largest angle between a copy of the group and the orientation of the target \[rad\]; `None` for a target without orientation.
    pub(crate) turn: Option<f64>,
    /// True if all copies of the group are within the radius and the angle of the target; `None` for a task without a radius.
    pub(crate) is_inside: Option<bool>,
}
