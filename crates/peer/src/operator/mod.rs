//! Operators: models of a person who does a task.
//!
//! In: the position that the person sees at a tick, and the target. Out: the wanted motion of the person's arm. This module knows neither the task nor the
//! peers: the driver says what is seen.

mod config;
mod crossover;
mod delay_line;
mod moves;
#[cfg(test)]
mod tests;

use core::time::Duration;

use crate::State;
use crossover::Crossover;
use delay_line::DelayLine;
use moves::Moves;

pub use config::{MovesConfig, OperatorConfig, OperatorLaw, Seen};

/// Positions of object and target that the person of an operator sees at a tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View<const A: usize> {
    /// Position of the copy of the object \[m\].
    pub position: [f64; A],
    /// Position of the target \[m\].
    pub target: [f64; A],
    /// Largest distance from the target that counts as at the target \[m\]; zero for a target without a radius.
    pub radius: f64,
}

/// A model of a person: from the seen positions of object and target to the wanted motion of the arm.
///
/// The driver calls [`Operator::tick`] once at each tick of the peer, from the tick on at which the person is first asked to do something. The counts of ticks
/// below begin at this tick. The wanted motion holds for the whole tick.
#[derive(Clone, Debug)]
pub struct Operator<const A: usize> {
    /// Views of the ticks that the person has not seen yet.
    views: DelayLine<A>,
    law: Law<A>,
}

#[derive(Clone, Debug)]
enum Law<const A: usize> {
    Moves(Moves<A>),
    Crossover(Crossover<A>),
}

impl<const A: usize> Operator<A> {
    /// Returns a person with the hand at rest at `place` \[m\]. `tick` is the period of the peer's tick. `expects` is the delay that a person who makes moves
    /// expects between a motion of the hand and the same motion of the copy that this person sees, without the visual delay.
    #[must_use]
    pub fn new(config: &OperatorConfig, tick: Duration, expects: Duration, place: [f64; A]) -> Self {
        let law = match &config.law {
            OperatorLaw::Moves(moves) => Law::Moves(Moves::new(moves, config.visual_ticks(tick), tick, expects, place)),
            OperatorLaw::Crossover { frequency } => Law::Crossover(Crossover::new(*frequency, tick, place)),
        };
        Self { views: DelayLine::new(config.visual_ticks(tick)), law }
    }

    /// Takes in the view of a tick, and returns the wanted motion over this tick. `draw` returns a standard normal number for each axis, for the movement with
    /// the given number, counted from 0. A movement calls `draw` once, and without noise not at all.
    #[inline]
    pub fn tick(&mut self, view: &View<A>, draw: impl FnOnce(u64) -> [f64; A]) -> State<A> {
        let seen = self.views.pass(view);
        match &mut self.law {
            Law::Moves(moves) => moves.tick(&seen, draw),
            Law::Crossover(crossover) => crossover.tick(&seen),
        }
    }

    /// Returns the memory of a tracking person: the wanted position at the next tick \[m\], and the views not used yet, the newest first. No views before the
    /// first tick. `None` for a person who makes movements.
    pub fn tracking(&self) -> Option<([f64; A], impl Iterator<Item = &View<A>>)> {
        let Law::Crossover(crossover) = &self.law else { return None };
        Some((crossover.position(), self.views.waiting()))
    }

    /// Sets the memory of a tracking person: the wanted position at the next tick \[m\], and the views not used yet, the newest first. Missing views stand for
    /// views of the origin. A person who makes movements stays as before.
    pub fn set_tracking(&mut self, position: [f64; A], views: impl Iterator<Item = View<A>>) {
        let Law::Crossover(crossover) = &mut self.law else { return };
        crossover.set_position(position);
        self.views.set_waiting(views);
    }
}

/// Returns the number of ticks that a span takes, rounded up.
fn ticks(span: Duration, tick: Duration) -> u64 {
    u64::try_from(span.as_nanos().div_ceil(tick.as_nanos().max(1))).unwrap_or(u64::MAX)
}
