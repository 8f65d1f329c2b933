//! The panels of a comparison: a line and a band per strategy over a key of numbers, or a row per strategy without such a key; shares of runs that diverged
//! and of runs whose task was done; stable regions.

use cohaptic_campaign::{Cell, Judgement, Share};
use cohaptic_picture::{Axis, Band, Fill, Line, Look, Marker, Panel, Picture, Region};
use cohaptic_stability::Verdict;

use super::layout::{Layout, columns_of};
use super::scale::Scale;
use crate::campaign::Along;
use crate::compare::{Finished, judge};

/// Greatest number of values along x whose points are marked.
const MOST_MARKED: usize = 24;
/// Half height of the bar of an interval, in rows.
const HALF_BAR: f64 = 0.16;

/// Greatest number of panels in a picture of all measures. More panels would stand too far from the legend.
const PANELS: usize = 6;

/// Returns a picture without a title, because the page has the title.
fn picture(panels: Vec<Panel>, columns: usize) -> Picture {
    let aspect = if columns == 1 { 0.45 } else { 0.75 };
    Picture::new("").columns(columns).aspect(aspect).panels(panels)
}

/// Outcome of a run whose share of all runs is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// The run diverged.
    Diverged,
    /// The task was done.
    Done,
}

impl Outcome {
    /// Returns the name of the picture, and of the axis.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Diverged => "diverged",
            Self::Done => "done",
        }
    }

    const fn share(self, cell: &Cell) -> Option<Share> {
        match self {
            Self::Diverged => cell.diverged,
            Self::Done => cell.done,
        }
    }
}

/// Content shared by all pictures of a page.
pub(super) struct Sheet<'a> {
    pub(super) finished: &'a Finished,
    pub(super) layout: Layout,
}

impl Sheet<'_> {
    fn names(&self) -> impl Iterator<Item = (usize, &str)> {
        self.finished.comparison.strategies.iter().map(String::as_str).enumerate()
    }

    /// Draws all measures, a panel each, for a comparison without further panels. Shares of runs come first.
    pub(super) fn all(&self, scales: &[Scale]) -> Vec<Picture> {
        let has_task = self.finished.comparison.has_task();
        let shares = [(Outcome::Done, has_task), (Outcome::Diverged, self.any_diverged())].into_iter().filter(|(_, drawn)| *drawn);
        let measures = scales.iter().enumerate().map(|(measure, scale)| self.measure_panel(measure, scale, 0));
        let panels: Vec<Panel> = shares.map(|(outcome, _)| self.share_panel(outcome, 0)).chain(measures).collect();
        let arranged = |panels: &[Panel]| {
            let columns = columns_of(panels.len());
            self.arranged(picture(panels.to_vec(), columns), columns)
        };
        panels.chunks(PANELS).map(arranged).collect()
    }

    /// Shares the axis of x between the panels, or gives each strategy a row.
    fn arranged(&self, picture: Picture, columns: usize) -> Picture {
        if self.layout.x.is_some() { picture.shared_x() } else { self.with_rows(picture.shared_y(), columns) }
    }

    /// Draws a measure, with a panel per value of the keys with panels.
    pub(super) fn measure(&self, measure: usize, scale: &Scale) -> Picture {
        self.of_panels(|panel| self.measure_panel(measure, scale, panel))
    }

    /// Draws the shares of runs, with a panel per value of the keys with panels.
    pub(super) fn shares(&self, outcome: Outcome) -> Picture {
        self.of_panels(|panel| self.share_panel(outcome, panel))
    }

    /// Draws a panel per value of the keys with panels. All panels have the same axis of y.
    fn of_panels(&self, panel: impl Fn(usize) -> Panel) -> Picture {
        let panels = (0..self.layout.panels()).map(|place| self.titled(panel(place), place));
        self.arranged(picture(panels.collect(), self.layout.columns()).shared_y(), self.layout.columns())
    }

    /// Returns `true` if any run diverged.
    pub(super) fn any_diverged(&self) -> bool {
        self.finished.comparison.cells.iter().any(|cell| cell.diverged.is_some_and(|share| share.count > 0))
    }

    /// Sets the height of a picture to the height of its rows.
    fn with_rows(&self, picture: Picture, columns: usize) -> Picture {
        let rows = (1 + self.finished.comparison.strategies.len()) * columns;
        picture.aspect(0.05 * from_place(rows))
    }

    fn titled(&self, panel: Panel, place: usize) -> Panel {
        panel.titled(self.layout.title(self.finished.keys(), place))
    }

    fn measure_panel(&self, measure: usize, scale: &Scale, panel: usize) -> Panel {
        let value = |strategy: usize, at: Option<usize>| {
            let estimate = self.finished.comparison.cell(strategy, self.layout.other(panel, at)).figures[measure].mean?;
            let (low, high) = scale.ends(&estimate);
            Some((scale.mean(&estimate), low, high))
        };
        self.panel(scale.axis(), value)
    }

    fn share_panel(&self, outcome: Outcome, panel: usize) -> Panel {
        let value = |strategy: usize, at: Option<usize>| {
            let share = outcome.share(self.finished.comparison.cell(strategy, self.layout.other(panel, at)))?;
            Some((share.value(), share.low, share.high))
        };
        self.panel(Axis::new(outcome.name()).range(0.0, 1.0), value)
    }

    /// Draws values with intervals: over x, or as a row per strategy.
    fn panel(&self, axis: Axis, value: impl Fn(usize, Option<usize>) -> Option<(f64, f64, f64)>) -> Panel {
        match &self.layout.x {
            Some(x) => self.over(x, axis, |strategy, at| value(strategy, Some(at))),
            None => self.rows(axis, |strategy| value(strategy, None)),
        }
    }

    fn over(&self, x: &Along, axis: Axis, value: impl Fn(usize, usize) -> Option<(f64, f64, f64)>) -> Panel {
        let points = |strategy: usize| x.values.iter().enumerate().map(|(at, x)| (*x, value(strategy, at))).collect::<Vec<_>>();
        let nothing = (f64::NAN, f64::NAN, f64::NAN);
        let bands = self.names().map(|(strategy, _)| {
            let ends = points(strategy).into_iter().map(|(x, value)| (x, value.unwrap_or(nothing)));
            Band::new(ends.map(|(x, (_, low, high))| (x, low, high)), Fill::Tint(strategy))
        });
        let lines = self.names().map(|(strategy, name)| {
            let means = points(strategy).into_iter().map(|(x, value)| (x, value.unwrap_or(nothing).0));
            let line = Line::new(means, Look::of(strategy)).named(name);
            if x.values.len() <= MOST_MARKED { line.marked(Marker::of(strategy)) } else { line }
        });
        // The baseline lies above the other lines. The baseline is the widest line, and the other lines have gaps, so that the baseline stays visible.
        Panel::new(x.axis(), axis).with_all(bands).with_all(lines)
    }

    /// Draws a row per strategy, with the first strategy uppermost.
    fn rows(&self, axis: Axis, value: impl Fn(usize) -> Option<(f64, f64, f64)>) -> Panel {
        let count = self.finished.comparison.strategies.len();
        let rows: Vec<(usize, f64)> = (0..count).rev().enumerate().map(|(row, strategy)| (strategy, from_place(row))).collect();
        let names = rows.iter().map(|(strategy, _)| self.finished.comparison.strategies[*strategy].as_str());
        let mut panel = Panel::new(axis, Axis::new("").categories(names));
        for (strategy, y) in rows {
            let Some((mean, low, high)) = value(strategy) else { continue };
            // A mean of a single run has no interval, and a bar would have no width.
            if low < high {
                let bar = vec![(low, y - HALF_BAR), (high, y - HALF_BAR), (high, y + HALF_BAR), (low, y + HALF_BAR)];
                panel = panel.with(Region::new([bar], Fill::Deep(strategy)));
            }
            panel = panel.with(Line::new([(mean, y)], Look::of(strategy)).marks_only(Marker::of(strategy)));
        }
        panel
    }

    /// Draws the stable regions: over two keys of numbers a panel per strategy, over a single key a row per strategy. `None` without a key of numbers.
    pub(super) fn stability(&self) -> Option<Picture> {
        let x = self.layout.x.as_ref()?;
        if let Some(y) = self.layout.y(self.finished.keys()) {
            let panel = |(strategy, name): (usize, &str)| {
                let at = |column: usize, row: usize| (strategy, self.layout.other(y.places[row], Some(column)));
                self.areas(Panel::new(x.axis(), y.axis()), (&x.edges(), &y.edges()), at).titled(name)
            };
            let columns = columns_of(self.names().count());
            return Some(picture(self.names().map(panel).collect(), columns).shared_x().shared_y());
        }
        let count = self.finished.comparison.strategies.len();
        let names: Vec<&str> = self.finished.comparison.strategies.iter().rev().map(String::as_str).collect();
        let rows: Vec<f64> = (0..=count).map(|row| from_place(row) - 0.5).collect();
        let panel = |panel: usize| {
            // Rows count from below, and the first strategy is uppermost.
            let at = |column: usize, row: usize| (count - 1 - row, self.layout.other(panel, Some(column)));
            let axes = Panel::new(x.axis(), Axis::new("").categories(names.iter().copied()));
            self.titled(self.areas(axes, (&x.edges(), &rows), at), panel)
        };
        let columns = self.layout.columns();
        Some(self.with_rows(picture((0..self.layout.panels()).map(panel).collect(), columns).shared_y(), columns).shared_x())
    }

    /// Draws the verdicts of cells as areas.
    fn areas(&self, panel: Panel, (columns, rows): (&[f64], &[f64]), at: impl Fn(usize, usize) -> (usize, usize)) -> Panel {
        let word = |column: usize, row: usize| {
            let (strategy, other) = at(column, row);
            self.finished.judgement(strategy, other).and_then(Judgement::verdict).map(|verdict| &*verdict.word)
        };
        let (stable, unstable) = (Verdict::Stable.word(), Verdict::Unstable.word());
        let areas = [(Fill::Tint(0), stable), (Fill::Tint(1), unstable), (Fill::Grey, judge::UNDECIDED), (Fill::BackHatch, "refused")];
        let place_of = |word: Option<&str>| match word {
            Some(word) if word == stable => 0,
            Some(word) if word == unstable => 1,
            // Marginal, overflow and undecided.
            Some(_) => 2,
            None => 3,
        };
        areas.into_iter().enumerate().fold(panel, |panel, (place, (fill, name))| {
            let shown = |column: usize, row: usize| place_of(word(column, row)) == place;
            // An empty area would still appear in the legend. There is one cell fewer than edges.
            let any = (1..columns.len()).any(|column| (1..rows.len()).any(|row| shown(column - 1, row - 1)));
            if any { panel.with(Region::between(columns, rows, fill, shown).named(name)) } else { panel }
        })
    }
}

fn from_place(place: usize) -> f64 {
    f64::from(u32::try_from(place).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_an_outcome_is_that_of_its_own_runs() {
        let cell = Cell { refused: None, diverged: Share::of(1, 4), done: Share::of(3, 4), figures: Vec::new() };
        let drawn = |outcome: Outcome| (outcome.name(), outcome.share(&cell).map(|share| share.count));
        assert_eq!((drawn(Outcome::Diverged), drawn(Outcome::Done)), (("diverged", Some(1)), ("done", Some(3))));
    }
}
