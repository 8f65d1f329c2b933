//! Copies that a task judges, and their progress.

use std::ops::Range;
use std::time::Duration;

use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::{Hold, Leave, PathTask, Reach, Target};
use cohaptic_units::Instant;

use super::rows::{Event, Failure, FailureReason, OnRow, TaskRow};
use super::throughput::Movement;

/// Copy of a judged peer at its latest tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Copy {
    /// Index of the peer.
    pub(super) peer: usize,
    pub(super) position: [f64; 3],
    /// At rest for an object that does not turn.
    pub(super) attitude: Attitude,
    /// Norm of the velocity [m/s].
    pub(super) speed: f64,
    /// Norm of the coupling force \[N\].
    pub(super) force: f64,
    /// False before the first tick.
    pub(super) has_ticked: bool,
    /// True if the copy was at the target at the latest judgement.
    pub(super) is_inside: bool,
    /// Length along a path up to which the copy has come \[m\].
    pub(super) progress: f64,
    /// Distance from the target at the latest judgement \[m\].
    pub(super) error: f64,
    /// Position at the first judged instant \[m\]; `None` before.
    pub(super) began: Option<[f64; 3]>,
    /// Σ of the squared distances from the target \[m²\].
    pub(super) squares: f64,
    /// Number of distances in `squares`.
    pub(super) count: u64,
    /// Time outside of a held target.
    pub(super) outside: Duration,
    /// Largest distance of the copy beyond a target, along the way to the target \[m\]; zero if the copy was never beyond.
    pub(super) overshoot: f64,
}

impl Copy {
    /// Returns the copy of the peer at an index before its first tick.
    pub(super) const fn of(peer: usize) -> Self {
        Self {
            peer,
            position: [0.0; 3],
            attitude: Attitude::REST,
            speed: 0.0,
            force: 0.0,
            has_ticked: false,
            is_inside: false,
            progress: 0.0,
            error: 0.0,
            began: None,
            squares: 0.0,
            count: 0,
            outside: Duration::ZERO,
            overshoot: 0.0,
        }
    }

    /// Returns the angle between the z axis of the copy and the z axis of the world \[rad\].
    pub(super) fn tilt(&self) -> f64 {
        let [[_, _, x], [_, _, y], [_, _, z]] = self.attitude.matrix();
        libm::atan2(libm::hypot(x, y), z)
    }

    /// Returns the angle between the copy and the orientation of a target \[rad\]; `None` for a target without orientation.
    pub(super) fn turn(&self, target: &Target) -> Option<f64> {
        target.orientation.map(|orientation| self.attitude.angle_to(&orientation))
    }
}

/// Region around a target that counts as at the target.
#[derive(Clone, Copy, Debug)]
struct Zone {
    /// Largest distance \[m\].
    radius: f64,
    /// Largest angle \[rad\]; infinite without a limit.
    angle: f64,
}

impl Zone {
    fn holds(self, copy: &Copy, target: &Target, axes: usize) -> bool {
        distance(copy.position, target.position, axes) <= self.radius && copy.turn(target).is_none_or(|turn| turn <= self.angle)
    }
}

/// Progress of copies that are judged together.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// First copy, by index in the list of all judged copies.
    first: usize,
    /// Number of copies.
    count: usize,
    /// Instants at which targets were reached.
    pub(super) reached: Vec<Instant>,
    /// Movements to the reached targets, without those from a target to the same place.
    pub(super) movements: Vec<Movement>,
    /// Mean position of the copies at the first judged instant or, later, where the latest target was reached \[m\].
    origin: Option<[f64; 3]>,
    /// First instant of the unbroken time for which the copies have been at the target until now; `None` while a copy is elsewhere.
    since: Option<Instant>,
    /// First instant of the unbroken time outside of the target, after an entry; `None` while inside and before the first entry.
    outside_since: Option<Instant>,
    /// True after the first entry.
    pub(super) has_entered: bool,
}

impl Group {
    /// Returns a group of `count` copies from the copy `first` on, before the first judgement.
    pub(super) const fn new(first: usize, count: usize) -> Self {
        Self { first, count, reached: Vec::new(), movements: Vec::new(), origin: None, since: None, outside_since: None, has_entered: false }
    }

    /// Returns the indices of the copies of the group.
    pub(super) const fn places(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Returns the copies of the group.
    pub(super) fn of<'a>(&self, copies: &'a [Copy]) -> &'a [Copy] {
        &copies[self.places()]
    }

    /// Returns the peer of a group of one copy; `None` for a larger group.
    pub(super) fn alone(&self, copies: &[Copy]) -> Option<usize> {
        match self.of(copies) {
            [copy] => Some(copy.peer),
            _ => None,
        }
    }

    /// Returns the mean position of the copies \[m\].
    #[expect(clippy::cast_precision_loss, reason = "a few copies")]
    fn place(&self, copies: &[Copy]) -> [f64; 3] {
        core::array::from_fn(|axis| self.of(copies).iter().map(|copy| copy.position[axis]).sum::<f64>() / self.count as f64)
    }

    /// Notes the beginning of the first movement, at the first judged instant.
    pub(super) fn begin(&mut self, copies: &[Copy]) {
        if self.origin.is_none() {
            self.origin = Some(self.place(copies));
        }
    }

    /// Returns the part of a dwell time for which the copies have been at the target until an instant, 0 to 1. Zero without a dwell time.
    pub(super) fn dwelt(&self, at: Instant, dwell: Duration) -> f64 {
        let since = self.since.filter(|_| !dwell.is_zero());
        since.map_or(0.0, |since| (at.saturating_duration_since(since).as_secs_f64() / dwell.as_secs_f64()).min(1.0))
    }

    /// Notes for each copy whether the copy is at a target, with events of changes. Returns whether all copies are.
    fn see(&self, at: Instant, (goal, target, zone): (usize, &Target, Zone), copies: &mut [Copy], axes: usize, on_row: OnRow<'_>) -> bool {
        let mut all = true;
        for copy in &mut copies[self.places()] {
            let is_inside = zone.holds(copy, target, axes);
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
    /// A target is reached at the first instant t with all copies within radius and angle, no faster than the speed, at every judged instant of
    /// [t − dwell, t], but not before the target was the next one. `targets`: the targets in the order of reaching. `start`: start of the task.
    pub(super) fn reach(
        &mut self,
        at: Instant,
        (reach, targets, start): (&Reach, &[Target], Instant),
        copies: &mut [Copy],
        axes: usize,
        on_row: OnRow<'_>,
    ) -> bool {
        // Without a dwell time a copy may reach several targets at one instant.
        while let Some(target) = targets.get(self.reached.len()) {
            let goal = self.reached.len();
            let inside = self.see(at, (goal, target, Zone { radius: reach.radius, angle: reach.angle }), copies, axes, on_row);
            let is_slow = reach.speed.is_none_or(|speed| self.of(copies).iter().all(|copy| copy.speed <= speed));
            if !(inside && is_slow) {
                self.since = None;
                return false;
            }
            let since = *self.since.get_or_insert(at);
            if at.saturating_duration_since(since) < reach.dwell {
                return false;
            }
            let (end, origin) = (self.place(copies), self.origin.unwrap_or(target.position));
            let from = goal.checked_sub(1).map_or(origin, |before| targets[before].position);
            let time = at.saturating_duration_since(self.reached.last().copied().unwrap_or(start));
            let along =
                |along: [f64; 3]| Movement { distance: dot(less(end, origin), along), deviation: dot(less(end, target.position), along), time };
            self.movements.extend(direction(from, target.position, axes).map(along));
            self.origin = Some(end);
            self.reached.push(at);
            on_row(at, TaskRow::Event(Event::Reached { peer: self.alone(copies), goal }));
            self.since = None;
            // The next target is another place: each copy enters anew.
            copies[self.places()].iter_mut().for_each(|copy| copy.is_inside = false);
        }
        true
    }

    /// Judges an instant of a task that follows a path, with the progress of this instant. Returns whether all copies are at the end, or the failure of a copy
    /// that has left the lane.
    pub(super) fn follow(&self, at: Instant, path: &PathTask, copies: &mut [Copy], on_row: OnRow<'_>) -> Result<bool, Failure> {
        for copy in &mut copies[self.places()] {
            let (is_inside, peer) = (copy.error <= 0.5 * path.width, copy.peer);
            let has_left = copy.is_inside && !is_inside;
            if copy.is_inside != is_inside {
                on_row(at, TaskRow::Event(if is_inside { Event::Entered { peer, goal: 0 } } else { Event::Left { peer, goal: 0 } }));
            }
            copy.is_inside = is_inside;
            // A copy that begins beside the lane has not left it.
            if has_left && path.leave == Leave::Fail {
                return Err(Failure { peer, reason: FailureReason::Left });
            }
        }
        Ok(self.of(copies).iter().all(|copy| path.is_at_end(copy.progress)))
    }

    /// Judges an instant of a task that holds a target. Returns the failure of a group that was outside for longer than the grace time.
    pub(super) fn hold(&mut self, at: Instant, hold: &Hold, copies: &mut [Copy], axes: usize, on_row: OnRow<'_>) -> Option<Failure> {
        let zone = Zone { radius: hold.radius, angle: f64::INFINITY };
        let inside = self.see(at, (0, &Target::at(hold.target), zone), copies, axes, on_row);
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
pub(super) fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|component| component * component).sum::<f64>().sqrt()
}

/// Returns the distance of two positions along the first `axes` axes \[m\].
pub(super) fn distance(a: [f64; 3], b: [f64; 3], axes: usize) -> f64 {
    norm(&less(a, b)[..axes])
}

/// Returns the unit vector from one position to another; `None` for equal positions.
pub(super) fn direction(from: [f64; 3], to: [f64; 3], axes: usize) -> Option<[f64; 3]> {
    let length = distance(from, to, axes);
    (length > 0.0).then(|| less(to, from).map(|component| component / length))
}

/// Returns the difference of two vectors.
pub(super) fn less(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|axis| a[axis] - b[axis])
}

/// Returns the inner product of two vectors.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}
