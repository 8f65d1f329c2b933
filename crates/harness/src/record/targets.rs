//! Targets of a task in the plot of positions: place, tolerance, dwell time, and where targets were reached.

use std::ops::Range;
use std::time::Duration;

use cohaptic_picture::{Band, Fill, Line, Look, Marker};
use cohaptic_scene::{Carry, Scene, Target, TaskKind};
use cohaptic_units::Instant;

use super::band::Bands;
use crate::TickRow;
use crate::task::{Event, Judge, TaskRow};

/// Target of each judged instant of a run.
#[derive(Clone, Debug)]
pub(crate) struct Targets {
    judge: Judge,
    seen: Seen,
}

/// Targets and their instants, as the judge has seen them.
#[derive(Clone, Debug)]
struct Seen {
    /// Position of the target along each axis \[m\].
    positions: Bands,
    /// Targets in the order of reaching; empty for tasks that reach none.
    targets: Vec<Target>,
    /// Radius, or half the width of a lane \[m\]; zero for a task without a radius.
    radius: f64,
    dwell: Duration,
    /// Instants at which targets were reached, each with the index of the target.
    reached: Vec<(Instant, usize)>,
}

impl Targets {
    /// Returns the targets before the run; `None` for a scene without a task.
    pub(crate) fn new(scene: &Scene, spans: usize) -> Option<Self> {
        let (targets, radius, dwell) = match &scene.task.as_ref()?.kind {
            TaskKind::Reach(reach) | TaskKind::Carry(Carry { reach, .. }) => (reach.in_order(scene.seed), reach.radius, reach.dwell),
            TaskKind::Hold(hold) => (Vec::new(), hold.radius, Duration::ZERO),
            TaskKind::Path(path) => (Vec::new(), 0.5 * path.width, Duration::ZERO),
            TaskKind::Track(_) => (Vec::new(), 0.0, Duration::ZERO),
        };
        let positions = Bands::new(scene.duration, spans, scene.axes.count());
        Some(Self { judge: Judge::of(scene)?, seen: Seen { positions, targets, radius, dwell, reached: Vec::new() } })
    }

    /// Takes the state of a peer at a tick.
    pub(crate) fn on_tick(&mut self, row: &TickRow<'_>) {
        let Self { judge, seen } = self;
        judge.on_tick(row, &mut |at, row| seen.take(at, &row));
    }

    /// Returns the targets with the latest instant, for a run whose latest instant is over.
    pub(crate) fn settled(&self) -> Self {
        let Self { mut judge, mut seen } = self.clone();
        judge.settle(&mut |at, row| seen.take(at, &row));
        Self { judge, seen }
    }

    /// Returns the range of the target and its tolerance along an axis \[m\]; `None` if no instant was judged.
    pub(crate) fn range(&self, axis: usize) -> Option<Range<f64>> {
        let Seen { positions, radius, .. } = &self.seen;
        let ranges = positions.curve(axis).map(|(_, low, high)| low - radius..high + radius);
        ranges.reduce(|one, other| one.start.min(other.start)..one.end.max(other.end))
    }

    /// Draws the targets along an axis. `scale`: factor of positions.
    pub(crate) fn onto(&self, panel: cohaptic_picture::Panel, axis: usize, scale: f64) -> cohaptic_picture::Panel {
        let Seen { positions, targets, radius, dwell, reached } = &self.seen;
        let tolerance = positions.curve(axis).map(|(t, low, high)| (t, scale * (low - radius), scale * (high + radius)));
        let line = Line::new(positions.curve(axis).map(|(t, low, high)| (t, scale * 0.5 * (low + high))), Look::reference());
        let reached = || reached.iter().map(|(at, goal)| (at.as_secs_f64(), targets[*goal].position[axis]));
        let marks = Line::new(reached().map(|(t, target)| (t, scale * target)), Look::reference()).marks_only(Marker::Diamond);
        let dwell = dwell.as_secs_f64();
        let dwelt = reached().map(|(t, target)| {
            let (low, high) = (scale * (target - radius), scale * (target + radius));
            Band::new([(t - dwell, low, high), (t, low, high)], Fill::Hatch)
        });
        // Without a radius and without a dwell time the areas have no extent, and the legend must not name them.
        let mut panel = panel;
        if *radius > 0.0 {
            panel = panel.with(Band::new(tolerance, Fill::Grey).named("tolerance"));
        }
        if dwell > 0.0 {
            panel = dwelt.enumerate().fold(panel, |panel, (place, band)| panel.with(if place == 0 { band.named("dwell") } else { band }));
        }
        panel = panel.with(line.named("target"));
        if reached().next().is_none() { panel } else { panel.with(marks.named("reached")) }
    }
}

impl Seen {
    fn take(&mut self, at: Instant, row: &TaskRow) {
        match row {
            TaskRow::Judged(seen) => (0..self.positions.curves()).for_each(|axis| self.positions.add(axis, at, seen.target.position[axis])),
            TaskRow::Event(Event::Reached { goal, .. }) => self.reached.push((at, *goal)),
            TaskRow::Event(Event::Entered { .. } | Event::Left { .. } | Event::Ended { .. }) => {}
        }
    }
}
