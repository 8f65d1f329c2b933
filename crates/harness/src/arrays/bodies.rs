//! What moves in runs in arrays: copies and devices that only go, or that turn as well.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::blocks::{Blocks, Centres, LawOfLanes, Moved};
use super::place::Places;
use super::samples::Sample;

/// All bodies of the runs, with A axes. A peer sends P pairs of numbers: position and velocity along each axis, and whatever else.
pub(super) trait Bodies<const A: usize, const P: usize> {
    /// The bodies of runs of these scenes, all of which have that law, with numbers of their own.
    fn new(places: Places, scenes: &[&Scene], law: &BuiltIn) -> Self;

    /// How they go.
    fn translations(&self) -> &Blocks<A>;

    /// How they go, to change what moves them.
    fn translations_mut(&mut self) -> &mut Blocks<A>;

    /// What a peer sends now.
    fn sample<const L: usize>(&self, peer: usize) -> Sample<P, L>;

    /// Replaces the means of a pair of numbers of the samples that a peer holds, in all runs.
    fn set_target<const L: usize>(&mut self, pair: usize, peer: usize, x: [f64; L], v: [f64; L]);

    /// Hands take the force and torque of now.
    fn move_hands(&mut self, now: Instant);

    /// Everybody computes forces by the law and moves to the next tick.
    fn advance<const L: usize>(&mut self, law: &impl LawOfLanes) -> Moved<L>;

    /// How a copy is turned; `None` if it does not turn.
    fn attitude(&self, _peer: usize, _run: usize) -> Option<Attitude> {
        None
    }

    /// The largest angle between two copies so far \[rad\]; `None` if they do not turn.
    fn max_rotation_discrepancy(&self, _run: usize) -> Option<f64> {
        None
    }
}

impl<const A: usize> Bodies<A, A> for Blocks<A> {
    fn new(places: Places, scenes: &[&Scene], law: &BuiltIn) -> Self {
        Self::new(places, scenes, law)
    }

    #[inline(always)]
    fn translations(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn translations_mut(&mut self) -> &mut Self {
        self
    }

    #[inline(always)]
    fn sample<const L: usize>(&self, peer: usize) -> Sample<A, L> {
        let mut sample = Sample::ZERO;
        self.add_to(&mut sample, peer);
        sample
    }

    #[inline(always)]
    fn set_target<const L: usize>(&mut self, axis: usize, peer: usize, x: [f64; L], v: [f64; L]) {
        self.set_target(axis, peer, x, v);
    }

    #[inline(always)]
    fn move_hands(&mut self, now: Instant) {
        self.move_hands(now);
    }

    #[inline(always)]
    fn advance<const L: usize>(&mut self, law: &impl LawOfLanes) -> Moved<L> {
        self.advance(law, &Centres)
    }
}
