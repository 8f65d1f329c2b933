//! Laws by which a task is judged.

use std::time::Duration;

use cohaptic_scene::{Carry, Gap, Judged, Scene, Target, TaskKind, TaskOutcome, TaskSpec};
use cohaptic_units::Instant;

use super::copies::{Copy, Group, direction, distance, dot, less, norm};
use super::rows::{Event, Failure, FailureReason, OnRow, Seen, TaskRow};
use super::{TaskResult, TaskView};
use crate::TickRow;

/// Judge of a task during a run.
#[derive(Clone, Debug)]
pub(crate) struct Judge {
    spec: TaskSpec,
    /// Targets in the order of reaching, or the held target. Empty for a moving target and for a path.
    targets: Vec<Target>,
    /// Positions of the two devices with a limited distance \[m\]; `None` before the first tick of the device's peer.
    devices: [Option<[f64; 3]>; 2],
    axes: usize,
    /// True if only targets and outcome matter, so that no judged instant is shown, and nothing is measured but the progress along a path.
    only_targets: bool,
    /// End of the time for the task: `start` and the timeout, or the end of the scene.
    deadline: Instant,
    /// Judged copies at their latest ticks.
    copies: Vec<Copy>,
    /// Copies that are judged together: one group of all copies or, where each peer is judged alone, a group a copy.
    groups: Vec<Group>,
    /// Latest instant with a tick of a judged peer. The instant is not judged yet. `None` before the first tick.
    now: Option<Instant>,
    /// Latest instant in the sums of the copies.
    measured: Option<Instant>,
    /// The outcome and its instant, once known.
    outcome: Option<(TaskOutcome, Instant, Option<Failure>)>,
}

impl Judge {
    /// Returns the judge before the run; `None` for a scene without a task.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let spec = (**scene.task.as_ref()?).clone();
        let copies: Vec<Copy> = spec.judged(scene).into_iter().map(Copy::of).collect();
        let groups = match spec.who {
            Judged::Any => (0..copies.len()).map(|first| Group::new(first, 1)).collect(),
            Judged::All | Judged::Peer(_) => vec![Group::new(0, copies.len())],
        };
        let targets = match &spec.kind {
            TaskKind::Reach(reach) | TaskKind::Carry(Carry { reach, .. }) => reach.in_order(scene.seed),
            TaskKind::Hold(hold) => vec![Target::at(hold.target)],
            TaskKind::Track(_) | TaskKind::Path(_) => Vec::new(),
        };
        let end = Instant::ZERO.saturating_add(scene.duration);
        let deadline = spec.timeout.map_or(end, |timeout| spec.start.saturating_add(timeout));
        let axes = scene.axes.count();
        let (devices, only_targets) = ([None; 2], false);
        Some(Self { axes, only_targets, targets, devices, deadline, copies, groups, now: None, measured: None, outcome: None, spec })
    }

    /// Returns a judge who knows the targets and the outcome of a run, and measures nothing else; `None` for a scene without a task.
    pub(crate) fn of_targets(scene: &Scene) -> Option<Self> {
        Self::of(scene).map(|judge| Self { only_targets: true, ..judge })
    }

    /// Takes the state of a peer at a tick. The states of peers that are not judged have no effect. An instant is judged at the first row of a later instant,
    /// when the ticks of all peers of the instant are known.
    pub(crate) fn on_tick(&mut self, row: &TickRow<'_>, on_row: OnRow<'_>) {
        if self.now.is_some_and(|at| at < row.at) {
            self.settle(on_row);
        }
        if let Some(place) = self.gap().and_then(|gap| gap.peers.iter().position(|peer| *peer == row.peer)) {
            self.devices[place] = Some(std::array::from_fn(|axis| row.device.position.get(axis).copied().unwrap_or(0.0)));
        }
        // Judged peers are in order of their indices.
        let Ok(place) = self.copies.binary_search_by_key(&row.peer, |copy| copy.peer) else { return };
        self.now = Some(row.at);
        let copy = &mut self.copies[place];
        copy.position[..self.axes].copy_from_slice(row.object.position);
        if let Some(turn) = &row.turn {
            copy.attitude = *turn.object;
        }
        copy.speed = norm(row.object.velocity);
        copy.force = norm(row.coupling_force);
        copy.has_ticked = true;
    }

    /// Judges the latest instant with rows, if this instant is not judged yet. For a caller that knows that no further peer ticks at this instant.
    pub(crate) fn settle(&mut self, on_row: OnRow<'_>) {
        if let Some(at) = self.now.take() {
            self.on_instant(at, on_row);
        }
    }

    /// Returns the instant of the outcome; `None` before the outcome.
    pub(crate) fn ended(&self) -> Option<Instant> {
        self.outcome.map(|(_, at, _)| at)
    }

    /// Returns the end of the time for the task: `start` and the timeout, or the end of the scene.
    pub(crate) const fn deadline(&self) -> Instant {
        self.deadline
    }

    /// Returns whether the target depends on the copies, and not on the time alone.
    pub(crate) fn target_follows_copies(&self) -> bool {
        match &self.spec.kind {
            TaskKind::Reach(reach) | TaskKind::Carry(Carry { reach, .. }) => reach.targets.len() > 1,
            TaskKind::Path(_) => true,
            TaskKind::Track(_) | TaskKind::Hold(_) => false,
        }
    }

    /// Returns the position that the task asks the user of a peer for at an instant \[m\], and the largest distance that counts as there \[m\], zero for a task
    /// without such a distance. All earlier instants must be judged: a target reached at an instant is replaced at the next one, as in `task.csv`. The user of
    /// a peer that is not judged is asked for the target of the leading peers.
    ///
    /// `noise`: standard deviation of the end of the user's movement over the length of the movement. On a path of the width w the user aims w/(4·noise) ahead
    /// of the progress of the copy, so that half of the width is two standard deviations of such a movement (Accot & Zhai 1997: the time grows as length over
    /// width).
    pub(crate) fn asks(&self, peer: usize, at: Instant, noise: f64) -> ([f64; 3], f64) {
        let copy = self.copies.binary_search_by_key(&peer, |copy| copy.peer).ok();
        let of_copy = copy.and_then(|copy| self.groups.iter().position(|group| group.places().contains(&copy)));
        let group = of_copy.unwrap_or_else(|| self.leading());
        if let TaskKind::Path(path) = &self.spec.kind {
            return (path.point(self.progress_of(group) + path.width / (4.0 * noise)), 0.0);
        }
        (self.target_of(group, at).position, self.spec.kind.radius().unwrap_or(0.0))
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

    /// Returns the time for which the copy of a peer was outside of the held target, after the first entry of all judged copies together, or outside of the
    /// lane of a path. `None` for a task of another kind, and for a peer that is not judged.
    pub(crate) fn outside(&self, peer: usize) -> Option<Duration> {
        let copy = self.copies.iter().find(|copy| copy.peer == peer)?;
        matches!(self.spec.kind, TaskKind::Hold(_) | TaskKind::Path(_)).then_some(copy.outside)
    }

    /// Returns the largest distance by which the copy of a peer was beyond a target, along the line to this target from the target before \[m\]; zero if the
    /// copy was never beyond. The line to the first target begins where the copy was at the first judged instant. `None` for a task of another kind than
    /// reaching, and for a peer that is not judged.
    pub(crate) fn overshoot(&self, peer: usize) -> Option<f64> {
        let copy = self.copies.iter().find(|copy| copy.peer == peer)?;
        self.spec.kind.reach().map(|_| copy.overshoot)
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
        if !self.only_targets || matches!(self.spec.kind, TaskKind::Path(_)) {
            self.measure(at);
        }
        if !self.only_targets {
            on_row(at, TaskRow::Judged(self.seen(at)));
        }
        if let Some(limit) = self.spec.fail_force
            && let Some(copy) = self.copies.iter().find(|copy| copy.force > limit)
        {
            self.fail(at, Failure { peer: copy.peer, reason: FailureReason::Dropped }, on_row);
        } else if let Some(failure) = self.not_carried() {
            self.fail(at, failure, on_row);
        } else {
            self.judge(at, on_row);
        }
        if at == self.deadline && self.outcome.is_none() {
            self.time_is_over(on_row);
        }
    }

    /// Returns the result at the end of a run of the simulated duration `duration`, after judging the last instant, and the judge with that instant in its
    /// sums. `has_diverged`: the run diverged, which is the outcome of a task without an outcome until then.
    pub(crate) fn finish(mut self, has_diverged: bool, duration: Duration, on_row: OnRow<'_>) -> (TaskResult, Self) {
        self.settle(on_row);
        let end = Instant::ZERO.saturating_add(duration);
        if self.outcome.is_none() {
            if has_diverged {
                self.end(TaskOutcome::Diverged, end, None, None, on_row);
            } else if end >= self.deadline {
                // No tick lies at the end of a run, so a deadline at the end is decided here.
                self.time_is_over(on_row);
            } else {
                self.end(TaskOutcome::Unfinished, end, None, None, on_row);
            }
        }
        let (outcome, at, failure) = self.outcome.unwrap_or((TaskOutcome::Unfinished, end, None));
        let time = at.saturating_duration_since(self.spec.start);
        let Group { reached, movements, .. } = self.groups[self.leading()].clone();
        (TaskResult { outcome, at, time, reached, movements, failure }, self)
    }

    /// Returns the limits of the distance between two devices; `None` without such limits.
    fn gap(&self) -> Option<&Gap> {
        match &self.spec.kind {
            TaskKind::Carry(carry) => carry.gap.as_ref(),
            TaskKind::Reach(_) | TaskKind::Track(_) | TaskKind::Hold(_) | TaskKind::Path(_) => None,
        }
    }

    /// Returns the failure of a task that carries the object, at the present instant; `None` if no limit is exceeded.
    fn not_carried(&self) -> Option<Failure> {
        let TaskKind::Carry(carry) = &self.spec.kind else { return None };
        if let Some(copy) = carry.level.and_then(|level| self.copies.iter().find(|copy| copy.tilt() > level)) {
            return Some(Failure { peer: copy.peer, reason: FailureReason::Tilted });
        }
        let (gap, [Some(one), Some(other)]) = (self.gap()?, self.devices) else { return None };
        let is_beyond = !(gap.min..=gap.max).contains(&distance(one, other, self.axes));
        // Only a judged peer can fail. There is one, because a task without is refused.
        let peer = self.copies.iter().find(|copy| gap.peers.contains(&copy.peer)).or_else(|| self.copies.first())?.peer;
        is_beyond.then_some(Failure { peer, reason: FailureReason::Gap })
    }

    /// Adds an instant to the sums of all copies, before the instant is judged.
    fn measure(&mut self, at: Instant) {
        let is_warm = match &self.spec.kind {
            TaskKind::Track(track) => at.saturating_duration_since(self.spec.start) >= track.warm_up,
            TaskKind::Reach(_) | TaskKind::Hold(_) | TaskKind::Path(_) | TaskKind::Carry(_) => true,
        };
        let passed = self.measured.replace(at).map_or(Duration::ZERO, |before| at.saturating_duration_since(before));
        for place in 0..self.groups.len() {
            let target = self.target_of(place, at).position;
            let before = self.groups[place].reached.len().checked_sub(1).map(|before| self.targets[before].position);
            let is_reached = self.spec.kind.reach().is_some();
            let path = if let TaskKind::Path(path) = &self.spec.kind { Some(path) } else { None };
            let group = &mut self.groups[place];
            group.begin(&self.copies);
            // A held target counts from the first entry on, a lane from the start.
            let has_entered = group.has_entered || path.is_some();
            for copy in &mut self.copies[group.places()] {
                let began = *copy.began.get_or_insert(copy.position);
                if is_reached && let Some(along) = direction(before.unwrap_or(began), target, self.axes) {
                    copy.overshoot = copy.overshoot.max(dot(less(copy.position, target), along));
                }
                // The state at the instant before holds until this instant.
                if has_entered && !copy.is_inside {
                    copy.outside += passed;
                }
                match path {
                    Some(path) => (copy.progress, copy.error) = path.nearest(copy.position, copy.progress),
                    None => copy.error = distance(copy.position, target, self.axes),
                }
                if is_warm {
                    copy.squares += copy.error * copy.error;
                    copy.count += 1;
                }
            }
        }
    }

    /// Judges an instant by the law of the kind.
    fn judge(&mut self, at: Instant, on_row: OnRow<'_>) {
        let Self { spec, targets, copies, groups, axes, .. } = self;
        let mut decided = None;
        match &spec.kind {
            // The first group that is done, or fails, ends the task. Peers judged alone are groups of their own, in the order of the scene.
            TaskKind::Reach(reach) | TaskKind::Carry(Carry { reach, .. }) => {
                for group in groups {
                    if group.reach(at, (reach, targets, spec.start), copies, *axes, on_row) {
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
            TaskKind::Path(path) => {
                for group in groups {
                    match group.follow(at, path, copies, on_row) {
                        Ok(false) => continue,
                        Ok(true) => decided = Some((group.alone(copies), None)),
                        Err(failure) => decided = Some((Some(failure.peer), Some(failure))),
                    }
                    break;
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
            TaskKind::Reach(_) | TaskKind::Path(_) | TaskKind::Carry(_) => TaskOutcome::TimedOut,
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
        self.groups[group].reached.len().min(self.targets.len().saturating_sub(1))
    }

    /// Returns the view of the task at an instant that is measured and not judged yet.
    fn seen(&self, at: Instant) -> Seen {
        let leading = self.leading();
        let (goal, target) = (self.goal_of(leading), self.target_of(leading, at));
        let group = &self.groups[leading];
        let copies = group.of(&self.copies);
        let error = copies.iter().map(|copy| copy.error).fold(0.0, f64::max);
        let turn = copies.iter().filter_map(|copy| copy.turn(&target)).reduce(f64::max);
        let is_turned = turn.is_none_or(|turn| turn <= self.angle());
        Seen { goal, target, error, turn, is_inside: self.spec.kind.radius().map(|radius| error <= radius && is_turned) }
    }

    /// Returns what there is to see at an instant, at or after the latest judged instant.
    pub(crate) fn view(&self, at: Instant) -> TaskView {
        let leading = self.leading();
        let group = &self.groups[leading];
        let dwell = self.spec.kind.reach().map_or(Duration::ZERO, |reach| reach.dwell);
        // A task with an outcome shows the target of the outcome, which may move, at that instant.
        let seen = self.ended().unwrap_or(at).max(self.spec.start);
        TaskView {
            target: self.target_of(leading, seen),
            radius: self.spec.kind.radius(),
            reached: group.reached.len(),
            targets: self.targets.len(),
            dwelt: group.dwelt(at, dwell),
            until_start: self.spec.start.saturating_duration_since(at),
            left: self.deadline.saturating_duration_since(seen),
            outcome: self.outcome.map(|(outcome, _, _)| outcome),
        }
    }

    /// Returns the length along a path up to which all copies of a group have come \[m\].
    fn progress_of(&self, group: usize) -> f64 {
        self.groups[group].of(&self.copies).iter().map(|copy| copy.progress).reduce(f64::min).unwrap_or(0.0)
    }

    /// Returns the largest angle between a copy and the orientation of a target \[rad\]; infinite without a limit.
    fn angle(&self) -> f64 {
        self.spec.kind.reach().map_or(f64::INFINITY, |reach| reach.angle)
    }

    /// Returns the target of a group at an instant.
    fn target_of(&self, group: usize, at: Instant) -> Target {
        match &self.spec.kind {
            TaskKind::Track(track) => Target::at(track.target(at.saturating_duration_since(self.spec.start))),
            TaskKind::Path(path) => Target::at(path.point(self.progress_of(group))),
            TaskKind::Reach(_) | TaskKind::Hold(_) | TaskKind::Carry(_) => self.targets[self.goal_of(group)],
        }
    }
}
