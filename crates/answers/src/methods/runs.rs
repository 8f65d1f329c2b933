//! Runs of methods: watched runs for the positions of the copies, and unwatched runs for the time.

use std::convert::Infallible;

use cohaptic_harness::{Ending, Observer, PacketRow, Simulation, Summary, TickRow};
use cohaptic_units::{Instant, print::Span};

use super::Run;

/// Positions of the copies in the runs of a method.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Trajectory {
    /// Positions along the compared axes \[m\]: tick by tick, then at the end of the same run, then at the end of an unwatched run, which may use another
    /// engine.
    positions: Vec<f64>,
    /// Instant of divergence; `None` if no run diverged.
    diverged: Option<Instant>,
}

impl Trajectory {
    /// Runs twice, watched and unwatched; `None` if `stops` ended a run.
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

    /// Returns the largest difference of the positions \[m\], or the reason for a missing difference.
    pub(crate) fn difference(&self, other: &Self) -> Result<f64, String> {
        for (trajectory, whose) in [(self, "the run diverges"), (other, "the run of the reference diverges")] {
            if let Some(at) = trajectory.diverged
                // Two runs with the same instant of divergence can still be compared up to this instant.
                && self.diverged != other.diverged
            {
                return Err(format!("{whose} at {}", Span(at - Instant::ZERO)));
            }
        }
        if self.positions.len() != other.positions.len() {
            return Err("the runs have other numbers of ticks".to_owned());
        }
        // Equal bits count as no difference, so that a NaN equals itself.
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

/// Runs without watching ticks; `None` if `stops` ended the run.
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
        // Receiving a packet is part of the measured work, and `black_box` keeps the compiler from removing it.
        std::hint::black_box(row);
        Ok(())
    }

    fn keep_going(&mut self, _now: Instant) -> bool {
        !(self.stops)()
    }
}
