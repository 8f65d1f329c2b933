//! Model of `[task]`: what the users of a scene are asked to do with the object.

use core::time::Duration;

use cohaptic_peer::Signal;
use cohaptic_units::Instant;

/// A task of a run. A task observes the run and changes no motion, packet or random number.
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
}

/// Peers whose copies a task judges.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Judged {
    /// The peers whose devices touch the object at any time of the scene, judged together.
    All,
    /// The same peers, each judged alone: the first peer whose copy does all that is asked for ends the task.
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
}

/// Keys of a task that moves the object to targets.
#[derive(Clone, PartialEq, Debug)]
pub struct Reach {
    /// Targets \[m\], at least one, in the order of reaching. Components beyond the scene's axes are zero.
    pub targets: Vec<[f64; 3]>,
    /// Largest distance from a target that counts as at the target \[m\]; above zero.
    pub radius: f64,
    /// Largest speed at the target [m/s]; `None` for any speed.
    pub speed: Option<f64>,
    /// Duration for which the copies stay at the target before the target is reached.
    pub dwell: Duration,
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

impl TaskKind {
    /// Returns the name of the kind, as written in scenes.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Reach(_) => "reach",
            Self::Track(_) => "track",
            Self::Hold(_) => "hold",
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
