//! Required results of a run, as `[expect]` of a scene says.

use core::fmt;
use core::time::Duration;

use cohaptic_linkfile::LinkSelector;
use cohaptic_units::{Instant, Probability};
use cohaptic_wan::DropCause;

use crate::TaskOutcome;
use crate::measures::MeasureName;

/// Required results of a run, for `cohaptic check`. An absent entry is not checked.
#[derive(Clone, PartialEq, Default)]
pub struct Expect {
    /// Stability of the relative motion: `true` if a small disturbance must die out, `false` if it must grow.
    pub stable: Option<bool>,
    /// Bounds of the largest distance along an axis between two copies, over the whole run \[m\].
    pub discrepancy: Option<Bounds>,
    /// Positions of copies at given instants.
    pub positions: Vec<ExpectPosition>,
    /// Times at which copies have first moved a given distance from their initial positions.
    pub travel: Vec<ExpectTravel>,
    /// Dropped fractions of the packets offered to links.
    pub loss: Vec<ExpectLoss>,
    /// Mean delays of delivered packets.
    pub delay: Vec<ExpectDelay>,
    /// Values of measures.
    pub measures: Vec<ExpectMeasure>,
    /// Bounds of the largest angle between two copies, over the whole run \[rad\].
    pub rotation_discrepancy: Option<Bounds>,
    /// Orientations of copies at given instants.
    pub orientations: Vec<ExpectOrientation>,
    /// Outcome of the task; `None` if nothing is expected.
    pub task: Option<ExpectTask>,
}

/// Expected outcome of a task; at least one field is present.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ExpectTask {
    /// The outcome.
    pub outcome: Option<TaskOutcome>,
    /// Bounds of the time from the start of the task to its outcome \[s\].
    pub time: Option<Bounds>,
}

impl fmt::Debug for Expect {
    /// Writes measures, the angle, orientations and the task only where the scene expects any: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stable, discrepancy, positions, travel, loss, delay, measures, rotation_discrepancy, orientations, task } = self;
        let mut shown = f.debug_struct("Expect");
        shown.field("stable", stable).field("discrepancy", discrepancy).field("positions", positions).field("travel", travel);
        shown.field("loss", loss).field("delay", delay);
        if !measures.is_empty() {
            shown.field("measures", measures);
        }
        if let Some(bounds) = rotation_discrepancy {
            shown.field("rotation_discrepancy", bounds);
        }
        if !orientations.is_empty() {
            shown.field("orientations", orientations);
        }
        if let Some(task) = task {
            shown.field("task", task);
        }
        shown.finish()
    }
}

/// A closed interval with at least one end, in the unit of the bounded value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bounds {
    /// Lower end; `None` for no lower end.
    pub min: Option<f64>,
    /// Upper end; `None` for no upper end.
    pub max: Option<f64>,
}

impl Bounds {
    /// Returns true if the value lies in the interval; false for a NaN.
    #[must_use]
    pub fn contain(&self, value: f64) -> bool {
        self.min.is_none_or(|min| value >= min) && self.max.is_none_or(|max| value <= max) && !value.is_nan()
    }
}

/// An expected orientation of a copy.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectOrientation {
    /// Index of the peer in [`Scene::peers`](crate::Scene::peers).
    pub peer: usize,
    /// Instant of the check, since the beginning of the scene.
    pub at: Instant,
    /// Expected unit quaternion (w, x, y, z).
    pub of: [f64; 4],
    /// Largest angle between the expected orientation and the orientation of the copy \[rad\].
    pub max: f64,
}

/// An expected position of a copy along an axis.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectPosition {
    /// Index into [`Scene::peers`](crate::Scene::peers) of the peer with the checked copy.
    pub peer: usize,
    /// Axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Instant of the check. The checked position is the position at the peer's last tick at or before this instant; at the end of the scene, the position
    /// after the last tick.
    pub at: Instant,
    /// Bounds of the position \[m\].
    pub bounds: Bounds,
}

/// An expected time of travel of a copy along an axis.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectTravel {
    /// Index into [`Scene::peers`](crate::Scene::peers) of the peer with the checked copy.
    pub peer: usize,
    /// Axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Distance from the initial position of the copy, in either direction \[m\]; above zero.
    pub distance: f64,
    /// Bounds of the time from the beginning of the scene to the first instant at the distance \[s\].
    pub bounds: Bounds,
}

/// An expected fraction of dropped packets.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectLoss {
    /// Links of the counted packets.
    pub link: LinkSelector,
    /// Cause of the drops to count; `None` for every cause.
    pub cause: Option<DropCause>,
    /// Least fraction of the offered packets, from 0 to 1; `None` for no lower end.
    pub min: Option<Probability>,
    /// Largest fraction of the offered packets, from 0 to 1; `None` for no upper end.
    pub max: Option<Probability>,
}

/// An expected value of a measure.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectMeasure {
    /// Measure to check.
    pub name: MeasureName,
    /// Bounds of the value, in the unit of the measure. A measure without a value fails the check.
    pub bounds: Bounds,
}

/// An expected mean delay of delivered packets.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectDelay {
    /// Links whose delivered packets are averaged.
    pub link: LinkSelector,
    /// Least mean delay; `None` for no lower end.
    pub min: Option<Duration>,
    /// Largest mean delay; `None` for no upper end.
    pub max: Option<Duration>,
}
