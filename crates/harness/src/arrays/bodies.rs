//! What moves in runs in arrays: copies and devices that only go, or that turn as well.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_peer::{Contact, Gains, Hand, Signal};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::blocks::{Blocks, Moved, Seen};
use super::lanes::Lanes;
use super::place::Places;
use super::samples::Sample;
use crate::plan::DeviceChoice;

/// What rows say of eight peers along each axis, and if they turn the torques of coupling and coordination on their copies, the latter without what the law damps.
pub(super) struct SeenPlace<const A: usize> {
    pub(super) axes: [Seen; A],
    pub(super) turn: Option<(Triple<Lanes>, Triple<Lanes>)>,
}

/// All bodies of the runs, with A axes. A peer sends P pairs of numbers: position and velocity along each axis, and whatever else.
pub(super) trait Bodies<const A: usize, const P: usize> {
    /// The bodies of runs of these scenes, all of which have that law, with numbers of their own; `devices` as for [`Blocks::new`].
    fn new(places: Places, scenes: &[&Scene], law: &BuiltIn, devices: Option<&[DeviceChoice]>) -> Self;

    /// How they go.
    fn blocks(&self) -> &Blocks;

    /// [`Bodies::blocks`], to change what moves them.
    fn blocks_mut(&mut self) -> &mut Blocks;

    /// What a peer sends now.
    fn sample<const L: usize>(&self, peer: usize) -> Sample<P, L>;

    /// Replaces the means of a pair of numbers of the samples that a peer holds, in all runs.
    fn set_target<const L: usize>(&mut self, pair: usize, peer: usize, x: [f64; L], v: [f64; L]);

    /// A hand does that from now on, in all runs.
    fn set_hand(&mut self, peer: usize, hand: Option<&Hand>);

    /// Hands take the force and torque of now.
    fn move_hands(&mut self, now: Instant);

    /// A device touches its copy in that way from now on, in all runs.
    fn set_contact(&mut self, peer: usize, contact: Contact) {
        self.blocks_mut().set_contact(peer, contact);
    }

    /// A hand turns its device by that torque from now on, in all runs, if the device turns.
    fn set_hand_torque(&mut self, _peer: usize, _torque: Option<&Signal>) {}

    /// KR and BR of each run from now on, if copies turn.
    fn set_gains_of_turns<const L: usize>(&mut self, _gains: &[Gains<Triple>; L]) {}

    /// The damping of copies from now on is that of these scenes, in each run.
    fn set_damping(&mut self, scenes: &[&Scene]) {
        self.blocks_mut().set_damping(scenes);
    }

    /// Everybody computes forces by the law and moves to the next tick.
    fn advance<const L: usize>(&mut self, processor: pulp::Arch, law: &BuiltIn<Lanes>) -> Moved<L>;

    /// What rows say of the peers in a place, before they move.
    fn seen(&self, place: usize, law: &BuiltIn<Lanes>) -> SeenPlace<A>;

    /// How a device is turned; `None` if it does not turn.
    fn device_attitude(&self, _peer: usize, _run: usize) -> Option<Attitude> {
        None
    }

    /// How a copy is turned; `None` if it does not turn.
    fn attitude(&self, _peer: usize, _run: usize) -> Option<Attitude> {
        None
    }

    /// The largest angle between two copies so far \[rad\]; `None` if they do not turn.
    fn max_rotation_discrepancy(&self, _run: usize) -> Option<f64> {
        None
    }
}
