//! Runs that show where copies are, and runs that show nothing but how long they take.

use std::convert::Infallible;

use cohaptic_harness::{Ending, Observer, PacketRow, Simulation, Summary, TickRow};
use cohaptic_units::{Instant, print::Span};

use super::Run;

/// Positions of the copies in one run.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Trajectory {
    /// Positions along the compared axes \[m\]: in the order of the ticks, then those at the end, then those at the end of a run of which no tick is watched,
    /// which may take another way.
    positions: Vec<f64>,
    /// The instant at which the run diverged, if it did.
    diverged: Option<Instant>,
}

impl Trajectory {
    /// Runs twice, watched and not; `None` if `stops` ended a run.
    pub(crate) fn of(run: &Run, stops: &dyn Fn() -> bool) -> Option<Self> {
        let mut watched = Watching { positions: Some(Vec::new()), ..Watching::new(run, stops) };
        let summaries = [watched.finish(run)?, unwatched(run, stops)?];
        let mut positions = watched.positions.unwrap_or_default();
        for peer in summaries.iter().flat_map(|summary| &summary.peers) {
            positions.extend(peer.position.iter().take(run.compared_axes));
        }
        let diverged = summaries.iter().find_map(|summary| match summary.ending {
            Ending::Diverged(at) => Some(at),
            Ending::Complete | Ending::Interrupted(_) => None,
        });
        Some(Self { positions, diverged })
    }

    /// Returns the largest difference from another trajectory \[m\], or why there is none.
    pub(crate) fn difference(&self, other: &Self) -> Result<f64, String> {
        for (trajectory, whose) in [(self, "the run diverges"), (other, "the run of the reference diverges")] {
            if let Some(at) = trajectory.diverged
                && self.diverged != other.diverged
            {
                return Err(format!("{whose} at {}", Span(at - Instant::ZERO)));
            }
        }
        if self.positions.len() != other.positions.len() {
            return Err("the runs have other numbers of ticks".to_owned());
        }
        // Equal bits are no difference, so that a NaN is equal to itself alone.
        let apart = |(one, other): (&f64, &f64)| if one.to_bits() == other.to_bits() { 0.0 } else { (one - other).abs() };
        let largest = self
            .positions
            .iter()
            .zip(&other.positions)
            .map(apart)
            .fold(0.0, |largest: f64, apart| if apart > largest || apart.is_nan() { apart } else { largest });
        if largest.is_finite() { Ok(largest) } else { Err("positions are no numbers any more".to_owned()) }
    }
}

/// Runs and keeps nothing but the summary; `None` if `stops` ended the run.
pub(crate) fn unwatched(run: &Run, stops: &dyn Fn() -> bool) -> Option<Summary> {
    Watching::new(run, stops).finish(run)
}

struct Watching<'a> {
    /// Positions so far; `None` if ticks are not watched.
    positions: Option<Vec<f64>>,
    watches_packets: bool,
    axes: usize,
    stops: &'a dyn Fn() -> bool,
}

impl<'a> Watching<'a> {
    const fn new(run: &Run, stops: &'a dyn Fn() -> bool) -> Self {
        Self { positions: None, watches_packets: run.watches_packets, axes: run.compared_axes, stops }
    }

    fn finish(&mut self, run: &Run) -> Option<Summary> {
        let Ok(summary) = Simulation::new(&run.scene, run.model).run(self);
        if matches!(summary.ending, Ending::Interrupted(_)) || (self.stops)() { None } else { Some(summary) }
    }
}

impl Observer for Watching<'_> {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        self.positions.is_some()
    }

    fn wants_packets(&self) -> bool {
        self.watches_packets
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if let Some(positions) = &mut self.positions {
            positions.extend(row.object.position.iter().take(self.axes));
        }
        Ok(())
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        // Looking at a packet is part of the work, and its result is used nowhere.
        std::hint::black_box(row);
        Ok(())
    }

    fn keep_going(&mut self, _now: Instant) -> bool {
        !(self.stops)()
    }
}
