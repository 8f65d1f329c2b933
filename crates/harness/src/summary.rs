//! Results of a run.

mod links;

use std::time::Duration;

use cohaptic_peer::rotation::Attitude;
use cohaptic_units::Instant;
use cohaptic_wan::LinkStats;

pub use links::{EachLink, LinkQuantiles, LinkSummaries, LinkSummary};

/// Results of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Summary {
    /// Ending of the run.
    pub ending: Ending,
    /// Simulated part of the scene.
    pub duration: Duration,
    /// Largest number of control ticks of a peer.
    pub ticks: u64,
    /// Results of the peers, in the order of the scene.
    pub peers: Vec<PeerSummary>,
    /// Counters of the links between peers, by sender, then receiver.
    pub links: LinkSummaries,
    /// Counters of the access lines of the scene.
    pub access_lines: Vec<AccessSummary>,
    /// Largest distance along an axis between two copies of the object at their latest ticks, over the whole run \[m\].
    pub max_discrepancy: f64,
    /// Largest angle between two copies at their latest ticks, over the whole run \[rad\]; `None` if the object does not turn.
    pub max_rotation_discrepancy: Option<f64>,
}

/// Distance between two copies \[m\] beyond which a run counts as diverged: people at desktop devices move no copy farther than this. Whether the numbers of
/// an unstable run overflow before its end depends on its duration alone, so the overflow by itself would be a poor definition.
pub const DIVERGED_DISTANCE: f64 = 1.0;

impl Summary {
    /// Returns whether the run diverged: a position or a velocity was not finite, or two copies were more than [`DIVERGED_DISTANCE`] apart along an axis.
    #[must_use]
    pub fn has_diverged(&self) -> bool {
        // A NaN compares as not larger, so it is asked for separately.
        matches!(self.ending, Ending::Diverged(_)) || self.max_discrepancy.is_nan() || self.max_discrepancy > DIVERGED_DISTANCE
    }

    /// Returns the ending as one word: `interrupted`, or `diverged` if the run [has diverged](Self::has_diverged), or `complete`.
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

/// Ending of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ending {
    /// The scene ran to its end.
    Complete,
    /// At this tick a position or a velocity was not finite: the numbers of the scene overflowed, and the run stopped.
    Diverged(Instant),
    /// The observer ended the run after this tick.
    Interrupted(Instant),
}

/// Results of a peer: the state at the first tick at or after the end, to which the last computed tick leads.
#[derive(Clone, PartialEq, Debug)]
pub struct PeerSummary {
    /// Name of the peer.
    pub name: String,
    /// Position of its copy along each axis \[m\].
    pub position: Vec<f64>,
    /// Velocity of its copy along each axis [m/s].
    pub velocity: Vec<f64>,
    /// Attitude of its copy; `None` if the object does not turn.
    pub attitude: Option<Attitude>,
    /// Number of samples that arrived late or repeated, without effect.
    pub stale_samples: u64,
    /// Number of damaged samples that the decoder refused.
    pub refused_samples: u64,
}

/// Results of one access line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AccessSummary {
    /// Index of the peer in the scene.
    pub peer: usize,
    /// `true` if the peer sends through this line; else the peer receives through it.
    pub uplink: bool,
    /// Counters of the line.
    pub stats: LinkStats,
}
