//! What a run comes to.

mod links;

use std::time::Duration;

use cohaptic_peer::rotation::Attitude;
use cohaptic_units::Instant;
use cohaptic_wan::LinkStats;

pub use links::{EachLink, LinkQuantiles, LinkSummaries, LinkSummary};

/// The result of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Summary {
    /// How it ended.
    pub ending: Ending,
    /// How much of the scene was simulated.
    pub duration: Duration,
    /// The number of control ticks of the peer that made the most.
    pub ticks: u64,
    /// The peers, in the order of the scene.
    pub peers: Vec<PeerSummary>,
    /// The links between peers, by sender, then receiver.
    pub links: LinkSummaries,
    /// The access lines that peers have.
    pub access_lines: Vec<AccessSummary>,
    /// The largest distance along an axis between two copies of the object at their latest ticks, over the whole run \[m\].
    pub max_discrepancy: f64,
    /// The largest angle between two copies at their latest ticks, over the whole run \[rad\]; `None` if the object does not turn.
    pub max_rotation_discrepancy: Option<f64>,
}

/// Distance between two copies \[m\] beyond which a run counts as diverged: people at desktop devices move no copy farther than this. Whether the numbers of
/// an unstable run overflow before its end depends on its duration alone, so the overflow by itself would be a poor definition.
pub const DIVERGED_DISTANCE: f64 = 1.0;

impl Summary {
    /// Returns whether the run diverged: a position or a velocity was not finite, or two copies were more than [`DIVERGED_DISTANCE`] apart along an axis.
    #[must_use]
    pub fn has_diverged(&self) -> bool {
        matches!(self.ending, Ending::Diverged(_)) || self.max_discrepancy.is_nan() || self.max_discrepancy > DIVERGED_DISTANCE
    }

    /// Returns one word for how the run ended: `interrupted`, or `diverged` if the run [has diverged](Self::has_diverged), or `complete`.
    #[must_use]
    pub fn ending_name(&self) -> &'static str {
        match self.ending {
            Ending::Interrupted(_) => "interrupted",
            Ending::Complete | Ending::Diverged(_) => {
                if self.has_diverged() {
                    "diverged"
                } else {
                    "complete"
                }
            }
        }
    }
}

/// How a run ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ending {
    /// The scene ran to its end.
    Complete,
    /// At this tick a position or a velocity was not finite: the scene diverged until its numbers overflowed, and was not simulated further.
    Diverged(Instant),
    /// The observer ended the run after this tick.
    Interrupted(Instant),
}

/// One peer at the end of a run: at its first tick at or after the end, which is the state that its last tick leads to.
#[derive(Clone, PartialEq, Debug)]
pub struct PeerSummary {
    /// Its name.
    pub name: String,
    /// Position of its copy along each axis \[m\].
    pub position: Vec<f64>,
    /// Velocity of its copy along each axis [m/s].
    pub velocity: Vec<f64>,
    /// How its copy is turned; `None` if the object does not turn.
    pub attitude: Option<Attitude>,
    /// How many samples arrived too late or repeated, and changed nothing.
    pub stale_samples: u64,
    /// Samples that arrived damaged and were refused by the decoder.
    pub refused_samples: u64,
}

/// One access line at the end of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AccessSummary {
    /// The peer's place in the scene.
    pub peer: usize,
    /// Whether it is the line that the peer sends through.
    pub uplink: bool,
    /// Its counters.
    pub stats: LinkStats,
}
