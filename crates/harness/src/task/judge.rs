//! Laws by which a task is judged.

use std::time::Duration;

use cohaptic_scene::{Hold, Judged, Reach, Scene, TaskKind, TaskOutcome, TaskSpec};
use cohaptic_units::Instant;

use super::TaskResult;
use crate::TickRow;

/// Judge of a task during a run.
#[derive(Clone, Debug)]
pub(crate) struct Judge {
    spec: TaskSpec,
    axes: usize,
    /// End of the time for the task: `start` and the timeout, or the end of the scene.
    deadline: Instant,
    /// True if the deadline lies within the scene.
    is_in_scene: bool,
    /// Judged copies at their latest ticks.
    copies: Vec<Copy>,
    /// Copies that are judged together. One group of all copies or, where each peer is judged alone, a group a copy.
    groups: Vec<Group>,
    /// Latest instant with a tick of a judged peer, which is not judged yet; `None` before the first tick.
    now: Option<Instant>,
    /// Latest instant in the sums of the copies.
    measured: Option<Instant>,
    /// The outcome and its instant, once known.
    outcome: Option<(TaskOutcome, Instant, Option<Failure>)>,
}

/// Copy of a judged peer at its latest tick.
#[derive(Clone, Copy, Debug)]
struct Copy {
    /// Index of the peer.
    peer: usize,
    position: [f64; 3],
    /// Norm of the velocity [m/s].
    speed: f64,
    /// Norm of the coupling force \[N\].
    force: f64,
    /// False before the first tick.
    has_ticked: bool,
    /// True if the copy was within the radius at the latest judgement.
    is_inside: bool,
    /// Σ of the squared distances from the target \[m²\].
    squares: f64,
    /// Number of distances in `squares`.
    count: u64,
    /// Time outside of a held target.
    outside: Duration,
}

/// Progress of copies that are judged together.
#[derive(Clone, Debug)]
struct Group {
    /// First copy, by index in [`Judge::copies`].
    first: usize,
    /// Number of copies.
    count: usize,
    /// Instants at which targets were reached.
    reached: Vec<Instant>,
    /// First instant of the unbroken time for which the copies have been at the target until now; `None` while a copy is elsewhere.
    since: Option<Instant>,
    /// First instant of the unbroken time outside of the target, after an entry; `None` while inside and before the first entry.
    outside_since: Option<Instant>,
    /// True after the first entry.
    has_entered: bool,
}

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
    /// The copy was outside of the target for longer than the grace time.
    Left,
}

impl FailureReason {
    /// Returns the reason in one word, for documents.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dropped => "dropped",
            Self::Left => "left",
        }
    }
}

/// Event of a task. A peer is an index in [`Scene::peers`]; `None` stands for all judged peers together.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Event {
    /// The copy of a peer came within the radius of the target.
    Entered {
        /// The peer.
        peer: usize,
        /// Number of the target, from 0.
        goal: usize,
    },
    /// The copy of a peer left the radius of the target.
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
    /// Position of the target \[m\].
    pub(crate) target: [f64; 3],
    /// Largest distance of a copy of the group from the target \[m\].
    pub(crate) error: f64,
    /// True if all copies of the group are within the radius; `None` for a task without a radius.
    pub(crate) is_inside: Option<bool>,
}

impl Judge {
    /// Returns the judge before the run; `None` for a scene without a task.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let spec = (**scene.task.as_ref()?).clone();
        let copy = |peer| Copy {
            peer,
            position: [0.0; 3],
            speed: 0.0,
            force: 0.0,
            has_ticked: false,
            is_inside: false,
            squares: 0.0,
            count: 0,
            outside: Duration::ZERO,
        };
        let copies: Vec<Copy> = spec.judged(scene).into_iter().map(copy).collect();
        let group = |first, count| Group { first, count, reached: Vec::new(), since: None, outside_since: None, has_entered: false };
        let groups = match spec.who {
            Judged::Any => (0..copies.len()).map(|first| group(first, 1)).collect(),
            Judged::All | Judged::Peer(_) => vec![group(0, copies.len())],
        };
        let end = Instant::ZERO.saturating_add(scene.duration);
        let deadline = spec.timeout.map_or(end, |timeout| spec.start.saturating_add(timeout));
        let is_in_scene = deadline <= end;
        Some(Self { axes: scene.axes.count(), deadline, is_in_scene, copies, groups, now: None, measured: None, outcome: None, spec })
    }

    /// Takes the state of a peer at a tick. The states of peers that are not judged have no effect. An instant is judged at the first row of a later instant,
    /// when the ticks of all peers of the instant are known.
    pub(crate) fn on_tick(&mut self, row: &TickRow<'_>, on_row: OnRow<'_>) {
        if let Some(at) = self.now.take_if(|at| *at < row.at) {
            self.on_instant(at, on_row);
        }
        // Judged peers are in order of their indices.
        let Ok(place) = self.copies.binary_search_by_key(&row.peer, |copy| copy.peer) else { return };
        self.now = Some(row.at);
        let copy = &mut self.copies[place];
        copy.position[..self.axes].copy_from_slice(row.object.position);
        copy.speed = norm(row.object.velocity);
        copy.force = norm(row.coupling_force);
        copy.has_ticked = true;
    }

    /// Returns whether an instant with rows seen by [`on_tick`](Self::on_tick) belongs to the time of the task, from the start to the outcome, both included.
    pub(crate) fn is_under_way(&self, at: Instant) -> bool {
        at >= self.spec.start && self.outcome.is_none() && at <= self.deadline
    }

    /// Returns the sum of the squared distances between the target and the copy of a peer, over the judged instants of the task but for the warm-up \[m²\], and
    /// the number of these instants. `None` for a peer that is not judged.
    pub(crate) fn squared_errors(&self, peer: usize) -> Option<(f64, u64)> {
        self.copies.iter().find(|copy| copy.peer == peer).map(|copy| (copy.squares, copy.count))
    }

    /// Returns the time for which the copy of a peer was outside of the held target, after the first entry of all judged copies together. `None` for a task of
    /// another kind, and for a peer that is not judged.
    pub(crate) fn outside(&self, peer: usize) -> Option<Duration> {
        let copy = self.copies.iter().find(|copy| copy.peer == peer)?;
        matches!(self.spec.kind, TaskKind::Hold(_)).then_some(copy.outside)
    }

    /// Judges an instant. Nothing is judged before the start, after the outcome, and before each judged peer has ticked once.
    fn on_instant(&mut self, at: Instant, on_row: OnRow<'_>) {
        if at < self.spec.start || self.outcome.is_some() || !self.copies.iter().all(|copy| copy.has_ticked) {
            return;
        }
        // An instant after the deadline comes too late for anything but the timeout. At the deadline itself the task can still be done.
        if at > self.deadline {
            self.time_is_over(on_row);
            return;
        }
        self.measure(at);
        on_row(at, TaskRow::Judged(self.seen(at)));
        if let Some(limit) = self.spec.fail_force
            && let Some(copy) = self.copies.iter().find(|copy| copy.force > limit)
        {
            self.fail(at, Failure { peer: copy.peer, reason: FailureReason::Dropped }, on_row);
        } else {
            self.judge(at, on_row);
        }
        if at == self.deadline && self.outcome.is_none() {
            self.time_is_over(on_row);
        }
    }

    /// Returns the result at the end of a run of the simulated duration `duration`, after judging the last instant, and the judge with that instant in its
    /// sums. `otherwise`: outcome of a task without an outcome until then; `None` if the run came to the end of the scene, so that the deadline decides.
    pub(crate) fn finish(mut self, otherwise: Option<TaskOutcome>, duration: Duration, on_row: OnRow<'_>) -> (TaskResult, Self) {
        if let Some(at) = self.now {
            self.on_instant(at, on_row);
        }
        let end = Instant::ZERO.saturating_add(duration);
        if self.outcome.is_none() {
            // No tick lies at the end of the scene, so a deadline at the end is decided here.
            match otherwise {
                None if self.is_in_scene => self.time_is_over(on_row),
                otherwise => self.end(otherwise.unwrap_or(TaskOutcome::Unfinished), end, None, None, on_row),
            }
        }
        let (outcome, at, failure) = self.outcome.unwrap_or((TaskOutcome::Unfinished, end, None));
        let time = at.saturating_duration_since(self.spec.start);
        let reached = self.groups[self.leading()].reached.clone();
        (TaskResult { outcome, at, time, reached, failure }, self)
    }

    /// Adds an instant to the sums of all copies, before the instant is judged.
    fn measure(&mut self, at: Instant) {
        let is_warm = match &self.spec.kind {
            TaskKind::Track(track) => at.saturating_duration_since(self.spec.start) >= track.warm_up,
            TaskKind::Reach(_) | TaskKind::Hold(_) => true,
        };
        let passed = self.measured.replace(at).map_or(Duration::ZERO, |before| at.saturating_duration_since(before));
        for place in 0..self.groups.len() {
            let target = self.target_of(place, at);
            let group = &self.groups[place];
            let has_entered = group.has_entered;
            for copy in &mut self.copies[group.first..group.first + group.count] {
                // The state at the instant before holds until this instant.
                if has_entered && !copy.is_inside {
                    copy.outside += passed;
                }
                if is_warm {
                    let error = distance(copy.position, target, self.axes);
                    copy.squares += error * error;
                    copy.count += 1;
                }
            }
        }
    }

    /// Judges an instant by the law of the kind.
    fn judge(&mut self, at: Instant, on_row: OnRow<'_>) {
        let Self { spec, copies, groups, axes, .. } = self;
        let mut decided = None;
        match &spec.kind {
            TaskKind::Reach(reach) => {
                for group in groups {
                    if group.reach(at, reach, copies, *axes, on_row) {
                        decided = Some((group.alone(copies), None));
                        break;
                    }
                }
            }
            TaskKind::Hold(hold) => {
                for group in groups {
                    if let Some(failure) = group.hold(at, hold, copies, *axes, on_row) {
                        decided = Some((Some(failure.peer), Some(failure)));
                        break;
                    }
                }
            }
            TaskKind::Track(_) => {}
        }
        match decided {
            Some((_, Some(failure))) => self.fail(at, failure, on_row),
            Some((peer, None)) => self.end(TaskOutcome::Done, at, peer, None, on_row),
            None => {}
        }
    }

    /// Decides the task at its deadline.
    fn time_is_over(&mut self, on_row: OnRow<'_>) {
        let outcome = match &self.spec.kind {
            TaskKind::Reach(_) => TaskOutcome::TimedOut,
            TaskKind::Track(_) => TaskOutcome::Done,
            // A target that was never entered was not held.
            TaskKind::Hold(_) if self.groups.iter().any(|group| group.has_entered) => TaskOutcome::Done,
            TaskKind::Hold(_) => TaskOutcome::TimedOut,
        };
        self.end(outcome, self.deadline, None, None, on_row);
    }

    fn fail(&mut self, at: Instant, failure: Failure, on_row: OnRow<'_>) {
        self.end(TaskOutcome::Failed, at, Some(failure.peer), Some(failure), on_row);
    }

    fn end(&mut self, outcome: TaskOutcome, at: Instant, peer: Option<usize>, failure: Option<Failure>, on_row: OnRow<'_>) {
        on_row(at, TaskRow::Event(Event::Ended { peer, outcome, goal: self.goal_of(self.leading()) }));
        self.outcome = Some((outcome, at, failure));
    }

    /// Returns the index of the group with the most reached targets: the first among equals.
    fn leading(&self) -> usize {
        let most = self.groups.iter().map(|group| group.reached.len()).max();
        self.groups.iter().position(|group| Some(group.reached.len()) == most).unwrap_or(0)
    }

    /// Returns the number of the target of a group: the last one if all are reached.
    fn goal_of(&self, group: usize) -> usize {
        match &self.spec.kind {
            TaskKind::Reach(reach) => self.groups[group].reached.len().min(reach.targets.len() - 1),
            TaskKind::Track(_) | TaskKind::Hold(_) => 0,
        }
    }

    /// Returns what there is to see at an instant, before the instant is judged.
    fn seen(&self, at: Instant) -> Seen {
        let leading = self.leading();
        let (goal, target) = (self.goal_of(leading), self.target_of(leading, at));
        let radius = match &self.spec.kind {
            TaskKind::Reach(Reach { radius, .. }) | TaskKind::Hold(Hold { radius, .. }) => Some(*radius),
            TaskKind::Track(_) => None,
        };
        let group = &self.groups[leading];
        let error = group.of(&self.copies).iter().map(|copy| distance(copy.position, target, self.axes)).fold(0.0, f64::max);
        Seen { goal, target, error, is_inside: radius.map(|radius| error <= radius) }
    }

    /// Returns the position of the target of a group at an instant \[m\].
    fn target_of(&self, group: usize, at: Instant) -> [f64; 3] {
        match &self.spec.kind {
            TaskKind::Reach(reach) => reach.targets[self.goal_of(group)],
            TaskKind::Track(track) => track.target(at.saturating_duration_since(self.spec.start)),
            TaskKind::Hold(hold) => hold.target,
        }
    }
}

impl Group {
    /// Returns the copies of the group.
    fn of<'a>(&self, copies: &'a [Copy]) -> &'a [Copy] {
        &copies[self.first..self.first + self.count]
    }

    /// Returns the peer of a group of one copy; `None` for a larger group.
    fn alone(&self, copies: &[Copy]) -> Option<usize> {
        match self.of(copies) {
            [copy] => Some(copy.peer),
            _ => None,
        }
    }

    /// Notes for each copy whether it is within the radius of a target, with events of changes. Returns whether all copies are.
    fn see(&self, at: Instant, (goal, target, radius): (usize, [f64; 3], f64), copies: &mut [Copy], axes: usize, on_row: OnRow<'_>) -> bool {
        let mut all = true;
        for copy in &mut copies[self.first..self.first + self.count] {
            let is_inside = distance(copy.position, target, axes) <= radius;
            if is_inside != copy.is_inside {
                let peer = copy.peer;
                on_row(at, TaskRow::Event(if is_inside { Event::Entered { peer, goal } } else { Event::Left { peer, goal } }));
            }
            copy.is_inside = is_inside;
            all &= is_inside;
        }
        all
    }

    /// Judges an instant of a task that reaches targets. Returns whether the last target was reached.
    ///
    /// A target is reached at the first instant t with all copies within the radius, no faster than the speed, at every judged instant of [t − dwell, t], but
    /// not before the target was the next one.
    fn reach(&mut self, at: Instant, reach: &Reach, copies: &mut [Copy], axes: usize, on_row: OnRow<'_>) -> bool {
        // Without a dwell time a copy may reach several targets at one instant.
        while let Some(target) = reach.targets.get(self.reached.len()) {
            let goal = self.reached.len();
            let inside = self.see(at, (goal, *target, reach.radius), copies, axes, on_row);
            let is_slow = reach.speed.is_none_or(|speed| self.of(copies).iter().all(|copy| copy.speed <= speed));
            if !(inside && is_slow) {
                self.since = None;
                return false;
            }
            let since = *self.since.get_or_insert(at);
            if at.saturating_duration_since(since) < reach.dwell {
                return false;
            }
            self.reached.push(at);
            on_row(at, TaskRow::Event(Event::Reached { peer: self.alone(copies), goal }));
            self.since = None;
            // The next target is another place: each copy enters anew.
            copies[self.first..self.first + self.count].iter_mut().for_each(|copy| copy.is_inside = false);
        }
        true
    }

    /// Judges an instant of a task that holds a target. Returns the failure of a group that was outside for longer than the grace time.
    fn hold(&mut self, at: Instant, hold: &Hold, copies: &mut [Copy], axes: usize, on_row: OnRow<'_>) -> Option<Failure> {
        let inside = self.see(at, (0, hold.target, hold.radius), copies, axes, on_row);
        self.has_entered |= inside;
        if inside || !self.has_entered {
            self.outside_since = None;
            return None;
        }
        let since = *self.outside_since.get_or_insert(at);
        let is_over = at.saturating_duration_since(since) > hold.grace;
        let outside = || self.of(copies).iter().find(|copy| !copy.is_inside);
        is_over.then(outside).flatten().map(|copy| Failure { peer: copy.peer, reason: FailureReason::Left })
    }
}

/// Returns the norm of a vector.
fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|component| component * component).sum::<f64>().sqrt()
}

/// Returns the distance of two positions along the first `axes` axes \[m\].
fn distance(a: [f64; 3], b: [f64; 3], axes: usize) -> f64 {
    (0..axes).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>().sqrt()
}
