//! Expectations decided by a single run.

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::{Bounds, Expect, ExpectDelay, ExpectLoss, ExpectOrientation, ExpectTask, LinkSelector, MeasureName, Scene, TaskOutcome};
use cohaptic_units::Instant;
use cohaptic_units::print::Span;
use cohaptic_wan::{DropCause, LinkName, LinkStats};

use super::Outcome;
use crate::measures::Measures;
use crate::measures::travel::Travelled;
use crate::observer::observe_by_field;
use crate::task::{TaskResult, task_words};
use crate::{Ending, Observer, Summary, TickRow, Ticks};

/// Observer for all expectations of a scene.
#[derive(Debug)]
pub(crate) struct Watched {
    seen: (Positions, Option<Measures>),
}

/// Positions and attitudes seen so far.
#[derive(Debug)]
struct Positions {
    /// Expected positions, with the position seen last up to the expected instant.
    positions: Vec<WatchedPosition>,
    /// Expected travels.
    travels: Vec<WatchedTravel>,
    /// Expected orientations.
    expected: Vec<ExpectOrientation>,
    /// Attitude seen last up to the expected instant, indexed like `expected`; `None` before the first.
    orientations: Vec<Option<Attitude>>,
}

#[derive(Debug)]
struct WatchedPosition {
    peer: usize,
    axis: usize,
    at: Instant,
    seen: Option<f64>,
}

#[derive(Debug)]
struct WatchedTravel {
    peer: usize,
    axis: usize,
    distance: f64,
    travelled: Travelled,
}

impl Observer for Watched {
    type Error = Infallible;

    observe_by_field! { seen }
}

impl Positions {
    fn new(expect: &Expect) -> Self {
        let position =
            |expected: &cohaptic_scene::ExpectPosition| WatchedPosition { peer: expected.peer, axis: expected.axis, at: expected.at, seen: None };
        let travel = |expected: &cohaptic_scene::ExpectTravel| WatchedTravel {
            peer: expected.peer,
            axis: expected.axis,
            distance: expected.distance,
            travelled: Travelled::default(),
        };
        Self {
            positions: expect.positions.iter().map(position).collect(),
            travels: expect.travel.iter().map(travel).collect(),
            expected: expect.orientations.clone(),
            orientations: vec![None; expect.orientations.len()],
        }
    }

    /// Takes the positions and attitudes of an instant. `position` has the arguments peer and axis; both functions return `None` for peers without a row.
    fn see(&mut self, at: Instant, position: impl Fn(usize, usize) -> Option<f64>, attitude: impl Fn(usize) -> Option<Attitude>) {
        // Until the expected instant each position replaces the one before, so the last tick at or before that instant stays.
        for watched in self.positions.iter_mut().filter(|watched| at <= watched.at) {
            watched.seen = position(watched.peer, watched.axis).or(watched.seen);
        }
        for (expected, seen) in self.expected.iter().zip(&mut self.orientations).filter(|(expected, _)| at <= expected.at) {
            *seen = attitude(expected.peer).or(*seen);
        }
        for watched in &mut self.travels {
            if let Some(position) = position(watched.peer, watched.axis) {
                watched.travelled.see(at, position, watched.distance);
            }
        }
    }
}

impl Observer for Positions {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        !self.positions.is_empty() || !self.travels.is_empty() || !self.expected.is_empty()
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        // A row belongs to one peer, so each expectation takes the rows of its own peer only.
        let is_its = |peer: usize| peer == row.peer;
        self.see(
            row.at,
            |peer, axis| is_its(peer).then(|| row.object.position[axis]),
            |peer| row.turn.filter(|_| is_its(peer)).map(|turn| *turn.object),
        );
        Ok(())
    }

    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Infallible> {
        // Arrays have no turning objects, so no attitude exists.
        self.see(ticks.at(), |peer, axis| Some(ticks.position(peer, axis)), |_| None);
        Ok(())
    }
}

impl Watched {
    pub(crate) fn new(scene: &Scene, expect: &Expect) -> Self {
        let names: Vec<MeasureName> = expect.measures.iter().map(|expected| expected.name).collect();
        let measures = (!names.is_empty() || expect.task.is_some()).then(|| Measures::new(scene, &names, &scene.measure_settings()));
        Self { seen: (Positions::new(expect), measures) }
    }

    /// Returns the outcome of each expectation, in the order of the sections in the file.
    pub(crate) fn outcomes(&self, scene: &Scene, expect: &Expect, summary: &Summary) -> Vec<Outcome> {
        let name = |peer: usize| &scene.peers[peer].name;
        let (watched, measures) = &self.seen;
        let reach = Reach::of(scene, summary);
        let unseen = |peer: usize, at: Instant| reach.why_not(at).unwrap_or_else(|| format!("{} has not ticked by then", name(peer)));
        let mut outcomes = Vec::new();
        if let Some(bounds) = &expect.discrepancy {
            let name = "largest discrepancy between copies".to_owned();
            outcomes.push(reach.judge_largest(Outcome::number("discrepancy", name, "m", bounds, summary.max_discrepancy)));
        }
        for (expected, watched) in expect.positions.iter().zip(&watched.positions) {
            let what = format!("position of {}'s copy along {} at {}", name(expected.peer), AXES[expected.axis], expected.at);
            // Copies move until the end of the scene, after their last tick, so the final state comes from the summary.
            let seen = if expected.at >= reach.end { Some(summary.peers[expected.peer].position[expected.axis]) } else { watched.seen };
            outcomes.push(match seen.filter(|_| reach.why_not(expected.at).is_none()) {
                None => Outcome::nothing("position", what, "m", &expected.bounds, &unseen(expected.peer, expected.at)),
                Some(seen) => Outcome::number("position", what, "m", &expected.bounds, seen),
            });
        }
        for (expected, watched) in expect.travel.iter().zip(&watched.travels) {
            let what = format!("time in which {}'s copy travels {} m along {}", name(expected.peer), expected.distance, AXES[expected.axis]);
            // A distance reached before an overflow stays reached, so the outcome needs no judgement by the reach.
            outcomes.push(match watched.travelled.reached() {
                None => Outcome::nothing("travel", what, "s", &expected.bounds, &reach.not_reached()),
                Some(at) => Outcome::number("travel", what, "s", &expected.bounds, at.as_secs_f64()),
            });
        }
        if let (Some(bounds), Some(angle)) = (&expect.rotation_discrepancy, summary.max_rotation_discrepancy) {
            let name = "largest angle between copies".to_owned();
            outcomes.push(reach.judge_largest(Outcome::number("rotation-discrepancy", name, "rad", bounds, angle)));
        }
        for (expected, seen) in expect.orientations.iter().zip(&watched.orientations) {
            let what = format!("angle of {}'s copy from the orientation expected at {}", name(expected.peer), expected.at);
            let seen = if expected.at >= reach.end { summary.peers[expected.peer].attitude } else { *seen };
            let bounds = Bounds { min: None, max: Some(expected.max) };
            outcomes.push(match seen.filter(|_| reach.why_not(expected.at).is_none()) {
                None => Outcome::nothing("orientation", what, "rad", &bounds, &unseen(expected.peer, expected.at)),
                Some(seen) => Outcome::number("orientation", what, "rad", &bounds, seen.angle_to(&expected.of)),
            });
        }
        outcomes.extend(expect.loss.iter().map(|expected| reach.judge(loss(scene, expected, summary))));
        outcomes.extend(expect.delay.iter().map(|expected| reach.judge(delay(scene, expected, summary))));
        let values = measures.as_ref().map(|measures| measures.values(summary.duration)).unwrap_or_default();
        outcomes.extend(expect.measures.iter().zip(values).map(|(expected, measured)| {
            let (what, unit) = (expected.name.text(scene), expected.name.measure.unit());
            reach.judge(match measured.value {
                None => Outcome::nothing("measures", what, unit, &expected.bounds, "no value"),
                Some(value) => Outcome::number("measures", what, unit, &expected.bounds, value),
            })
        }));
        let task = measures.as_ref().and_then(|measures| measures.task(summary));
        if let (Some(expected), Some(result)) = (expect.task, task) {
            outcomes.extend(of_task(expected, &result, scene));
        }
        outcomes
    }
}

/// Returns the outcomes of the expectations of a task.
fn of_task(expected: ExpectTask, result: &TaskResult, scene: &Scene) -> Vec<Outcome> {
    let words = task_words(result, scene);
    let outcome = expected.outcome.map(|outcome| Outcome {
        passed: result.outcome == outcome,
        expected: outcome.name().to_owned(),
        found: words.clone(),
        ..Outcome::nothing("task", "outcome of the task".to_owned(), "", &Bounds { min: None, max: None }, "")
    });
    let time = expected.time.map(|bounds| {
        let what = "time from the start of the task to its outcome".to_owned();
        match result.outcome {
            TaskOutcome::Diverged | TaskOutcome::Unfinished => Outcome::nothing("task", what, "s", &bounds, &words),
            TaskOutcome::Done | TaskOutcome::TimedOut | TaskOutcome::Failed => Outcome::number("task", what, "s", &bounds, result.time.as_secs_f64()),
        }
    });
    outcome.into_iter().chain(time).collect()
}

/// Part of the scene that a run reached. A run with overflowed numbers proves nothing about later instants, nor about the whole scene. A run that its task has
/// ended says nothing about later instants.
struct Reach {
    /// First instant with a number that is not finite; `None` if the run reached its end.
    overflow: Option<Instant>,
    /// End of the run, or of the scene if the run diverged.
    end: Instant,
}

impl Reach {
    fn of(scene: &Scene, summary: &Summary) -> Self {
        let (overflow, duration) = match summary.ending {
            Ending::Diverged(at) => (Some(at), scene.duration),
            Ending::Complete | Ending::Interrupted(_) => (None, summary.duration),
        };
        Self { overflow, end: Instant::ZERO.saturating_add(duration) }
    }

    /// Returns why the run says nothing about an instant; `None` if the run reached the instant.
    fn why_not(&self, at: Instant) -> Option<String> {
        if self.overflow.is_none() && at > self.end {
            return Some(format!("the run ended at {}, with its task", self.end));
        }
        // The state at the instant of the overflow is not finite, so that instant was not reached either.
        let overflow = self.overflow.filter(|overflow| *overflow <= at)?;
        Some(if overflow < at { format!("the run diverged at {overflow}, before {at}") } else { format!("the run diverged at {overflow}") })
    }

    /// Returns the text for a distance that the copy did not travel.
    fn not_reached(&self) -> String {
        self.overflow.map_or_else(|| "not reached".to_owned(), |at| format!("not reached before the run diverged at {at}"))
    }

    /// Fails the outcome of a figure over the whole scene if the run did not come to its end.
    fn judge(&self, outcome: Outcome) -> Outcome {
        match self.why_not(self.end) {
            None => outcome,
            Some(why) => Outcome { passed: false, found: format!("{}, but {why}", outcome.found), ..outcome },
        }
    }

    /// Like [`judge`](Self::judge) for the largest value over the scene: a lower bound that a part of the scene reaches holds for the whole scene too.
    fn judge_largest(&self, outcome: Outcome) -> Outcome {
        if outcome.high.is_none() && outcome.measured >= outcome.low { Outcome { passed: true, ..outcome } } else { self.judge(outcome) }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

#[expect(clippy::cast_precision_loss, reason = "packet counts below 2^53")]
fn loss(scene: &Scene, expected: &ExpectLoss, summary: &Summary) -> Outcome {
    let stats = selected(expected.link, summary);
    let offered: u64 = stats.iter().map(|(stats, links)| stats.offered() * links).sum();
    let dropped_on = |stats: &LinkStats| expected.cause.map_or_else(|| stats.dropped_in_all(), |cause| stats.dropped(cause));
    let dropped: u64 = stats.iter().map(|(stats, links)| dropped_on(stats) * links).sum();
    let cause = expected.cause.map_or("for any reason", DropCause::name);
    let what = format!("fraction of packets dropped on {} ({cause})", link_name(expected.link, scene));
    let bounds = Bounds { min: expected.min.map(|min| min.get()), max: expected.max.map(|max| max.get()) };
    if offered == 0 {
        return Outcome::nothing("loss", what, "", &bounds, "no packet was offered");
    }
    let fraction = dropped as f64 / offered as f64;
    Outcome { found: format!("{fraction} ({dropped} of {offered})"), ..Outcome::number("loss", what, "", &bounds, fraction) }
}

fn delay(scene: &Scene, expected: &ExpectDelay, summary: &Summary) -> Outcome {
    let stats = selected(expected.link, summary);
    let delivered: u64 = stats.iter().map(|(stats, links)| stats.delivered() * links).sum();
    let what = format!("mean delay on {}", link_name(expected.link, scene));
    // The mean over all links is weighted by the delivered packets.
    let of_link = |stats: &LinkStats| stats.mean_delay().map_or(0, |mean| mean.as_nanos() * u128::from(stats.delivered()));
    let total: u128 = stats.iter().map(|(stats, links)| of_link(stats) * u128::from(*links)).sum();
    let bounds = Bounds { min: expected.min.map(|min| min.as_secs_f64()), max: expected.max.map(|max| max.as_secs_f64()) };
    let range = match (expected.min, expected.max) {
        (Some(min), Some(max)) => format!("{} to {}", Span(min), Span(max)),
        (Some(min), None) => format!("at least {}", Span(min)),
        (None, Some(max)) => format!("at most {}", Span(max)),
        (None, None) => "any delay".to_owned(),
    };
    let Some(mean) = total.checked_div(u128::from(delivered)) else {
        return Outcome { expected: range, ..Outcome::nothing("delay", what, "s", &bounds, "no packet was delivered") };
    };
    let mean = Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX));
    // Compared in whole nanoseconds, without rounding.
    let passed = expected.min.is_none_or(|min| mean >= min) && expected.max.is_none_or(|max| mean <= max);
    Outcome { passed, expected: range, found: Span(mean).to_string(), ..Outcome::number("delay", what, "s", &bounds, mean.as_secs_f64()) }
}

/// Returns the counters of the selected links, each with the number of links with these counters.
fn selected(link: LinkSelector, summary: &Summary) -> Vec<(LinkStats, u64)> {
    let access = |peer: usize, uplink: bool| {
        summary.access_lines.iter().filter(|line| line.peer == peer && line.uplink == uplink).map(|line| (line.stats, 1)).collect()
    };
    match link {
        LinkSelector::All => summary.links.counted().map(|(stats, links)| (*stats, links)).collect(),
        LinkSelector::Between { from, to } => summary.links.between(from, to).map(|stats| (*stats, 1)).into_iter().collect(),
        LinkSelector::Uplink(peer) => access(peer, true),
        LinkSelector::Downlink(peer) => access(peer, false),
    }
}

fn link_name(link: LinkSelector, scene: &Scene) -> String {
    let name = |peer: usize| &scene.peers[peer].name;
    match link {
        LinkSelector::All => "all links".into(),
        LinkSelector::Between { from, to } => LinkName::between(name(from), name(to)).as_str().into(),
        LinkSelector::Uplink(peer) => LinkName::uplink(name(peer)).as_str().into(),
        LinkSelector::Downlink(peer) => LinkName::downlink(name(peer)).as_str().into(),
    }
}
