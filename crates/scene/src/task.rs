//! Model of `[task]`: what the users of a scene are asked to do with the object.

use core::time::Duration;

use cohaptic_peer::Signal;
use cohaptic_units::Instant;
use cohaptic_wan::random::{Purpose, Stream};

use crate::path::PathTask;

/// A task of a run. A task observes the run, and without operators changes no motion, packet or random number. Operators move towards the target of the task.
#[derive(Clone, PartialEq, Debug)]
pub struct TaskSpec {
    /// Kind of the task, with the keys of this kind.
    pub kind: TaskKind,
    /// First instant that is judged.
    pub start: Instant,
    /// Longest duration from `start` to the outcome; `None` for the rest of the scene.
    pub timeout: Option<Duration>,
    /// Peers whose copies are judged.
    pub who: Judged,
    /// Norm of the coupling force FC \[N\] above which a judged peer has dropped the object and the task has failed; `None` for no such limit.
    pub fail_force: Option<f64>,
    /// Continuation of the run after the outcome.
    pub end: TaskEnd,
}

/// Continuation of a run after the outcome of its task.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TaskEnd {
    /// The scene goes on to its end.
    Continue,
    /// The run ends at the outcome: no peer ticks after the outcome.
    Stop,
}

/// Peers whose copies a task judges.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Judged {
    /// The peers whose devices touch the object at any time of the scene, judged together.
    All,
    /// The peers of `All`, each judged alone: the first peer whose copy fulfils the whole task ends the task.
    Any,
    /// A single peer, by the index in [`Scene::peers`](crate::Scene::peers).
    Peer(usize),
}

/// Kind of a task.
#[derive(Clone, PartialEq, Debug)]
pub enum TaskKind {
    /// The object is moved to one target after the other.
    Reach(Reach),
    /// The object follows a moving target until the timeout.
    Track(Track),
    /// The object is kept at a target until the timeout.
    Hold(Hold),
    /// The object is moved along a line.
    Path(PathTask),
    /// The object is moved to one target after the other, level or between two devices.
    Carry(Carry),
}

/// Keys of a task that moves the object to targets.
#[derive(Clone, PartialEq, Debug)]
pub struct Reach {
    /// Targets, at least one.
    pub targets: Vec<Target>,
    /// Order in which the targets are reached.
    pub order: TargetOrder,
    /// Largest distance from a target that counts as at the target \[m\]; above zero.
    pub radius: f64,
    /// Largest speed at the target [m/s]; `None` for any speed.
    pub speed: Option<f64>,
    /// Largest angle between a copy and the orientation of the target \[rad\]; above zero, and infinite for targets without orientation.
    pub angle: f64,
    /// Duration for which the copies stay at the target before the target is reached.
    pub dwell: Duration,
}

/// Target of a task that moves the object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Target {
    /// Position \[m\]. Components beyond the scene's axes are zero.
    pub position: [f64; 3],
    /// Orientation, as a unit quaternion (w, x, y, z); `None` for any orientation.
    pub orientation: Option<[f64; 4]>,
}

impl Target {
    /// Returns the target at a position \[m\], for an object of any orientation.
    #[must_use]
    pub const fn at(position: [f64; 3]) -> Self {
        Self { position, orientation: None }
    }
}

/// Order in which targets are reached.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TargetOrder {
    /// The order of the scene.
    Given,
    /// A random order, which follows from the seed of the scene: see [`Reach::in_order`].
    Shuffled,
}

/// Keys of a task that follows a moving target.
#[derive(Clone, PartialEq, Debug)]
pub struct Track {
    /// Centre of the motion \[m\].
    pub position: [f64; 3],
    /// Sines whose sum the target adds to the centre, as functions of the time since the start of the task.
    pub sines: Vec<Signal>,
    /// Time from the start for which the error is not measured.
    pub warm_up: Duration,
}

/// Keys of a task that keeps the object at a target.
#[derive(Clone, PartialEq, Debug)]
pub struct Hold {
    /// Target \[m\].
    pub target: [f64; 3],
    /// Largest distance from the target that counts as at the target \[m\]; above zero.
    pub radius: f64,
    /// Longest duration outside at once, after the first entry, without a failure of the task.
    pub grace: Duration,
}

/// Keys of a task that carries the object to targets. The task fails at once when a limit is exceeded; at least one limit is present.
#[derive(Clone, PartialEq, Debug)]
pub struct Carry {
    /// Targets.
    pub reach: Reach,
    /// Largest angle between the z axis of a copy and the z axis of the world \[rad\]; above zero.
    pub level: Option<f64>,
    /// Limits of the distance between two devices.
    pub gap: Option<Gap>,
}

/// Limits of the distance between the devices of two peers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gap {
    /// The two peers, by the index in [`Scene::peers`](crate::Scene::peers).
    pub peers: [usize; 2],
    /// Least distance \[m\]; at least zero.
    pub min: f64,
    /// Largest distance \[m\]; above `min`.
    pub max: f64,
}

impl TaskKind {
    /// Returns the name of the kind, as written in scenes.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Reach(_) => "reach",
            Self::Track(_) => "track",
            Self::Hold(_) => "hold",
            Self::Path(_) => "path",
            Self::Carry(_) => "carry",
        }
    }

    /// Returns the targets of a kind that reaches targets; `None` for the other kinds.
    #[must_use]
    pub const fn reach(&self) -> Option<&Reach> {
        match self {
            Self::Reach(reach) | Self::Carry(Carry { reach, .. }) => Some(reach),
            Self::Track(_) | Self::Hold(_) | Self::Path(_) => None,
        }
    }
}

impl Reach {
    /// Returns the targets in the order of reaching, in a run with this seed. The order has no other influence on the random numbers of the run.
    ///
    /// A shuffled order is drawn after Fisher and Yates: from the last target to the second, each changes places with a target at or before its own place.
    #[must_use]
    pub fn in_order(&self, seed: u64) -> Vec<Target> {
        let mut targets = self.targets.clone();
        if self.order == TargetOrder::Shuffled {
            // No link has this label, because a label of a link has an arrow.
            let stream = Stream::new(seed, b"task order");
            for last in (1..targets.len()).rev() {
                let word = stream.packet(last as u64).first(Purpose::TargetOrder);
                // The upper half of a product with the number of choices. Its bias is below 2^-50 for a thousand targets.
                let chosen = (u128::from(word) * (last as u128 + 1)) >> 64;
                targets.swap(last, usize::try_from(chosen).unwrap_or(last));
            }
        }
        targets
    }
}

impl TaskKind {
    /// Returns the largest distance from a target that counts as at the target, or half the width of a lane \[m\]; `None` for a kind without such a distance.
    #[must_use]
    pub const fn radius(&self) -> Option<f64> {
        match self {
            Self::Reach(Reach { radius, .. }) | Self::Hold(Hold { radius, .. }) | Self::Carry(Carry { reach: Reach { radius, .. }, .. }) => {
                Some(*radius)
            }
            Self::Path(path) => Some(0.5 * path.width),
            Self::Track(_) => None,
        }
    }
}

impl Track {
    /// Returns the position of the target \[m\] a time `since_start` after the start of the task.
    #[must_use]
    pub fn target(&self, since_start: Duration) -> [f64; 3] {
        let at = Instant::ZERO.saturating_add(since_start);
        self.sines.iter().fold(self.position, |target, sine| {
            let offset: [f64; 3] = sine.value(at);
            core::array::from_fn(|axis| target[axis] + offset[axis])
        })
    }
}

/// Result of a task.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TaskOutcome {
    /// The users did all that the task asks for.
    Done,
    /// The time was over first.
    TimedOut,
    /// A judged peer failed.
    Failed,
    /// The run diverged, and the task had no other outcome before the end of the run.
    Diverged,
    /// The run ended before the timeout of the task.
    Unfinished,
}

impl TaskOutcome {
    /// Every outcome with its name and description.
    pub(crate) const ALL: [(&'static str, Self, &'static str); 5] = [
        ("done", Self::Done, "all that was asked for was done"),
        ("timed-out", Self::TimedOut, "the time was over first"),
        ("failed", Self::Failed, "a judged peer failed"),
        ("diverged", Self::Diverged, "the run diverged first"),
        ("unfinished", Self::Unfinished, "the run ended before the timeout"),
    ];

    /// Returns the name in documents and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, outcome, _)| *outcome == self).map_or("", |(name, _, _)| name)
    }
}
