//! Bodies of all peers (copies and devices), and the hands on the devices.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::{Hand, HandForce};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::blocks::{Blocks, Moved, Seen, moves};
use super::lanes::Lanes;
use super::place::Places;
use super::samples::Sample;
use crate::plan::DeviceChoice;

/// All bodies and hands, with A axes.
#[derive(Clone, Debug)]
pub(super) struct Bodies<const A: usize> {
    blocks: Blocks,
    /// Hands whose force varies in time: index of the peer, index of the run, force.
    hands: Vec<(usize, usize, HandForce<A>)>,
}

impl<const A: usize> Bodies<A> {
    /// Returns the bodies of runs of these scenes, which share the kind of `law`. `devices` as for [`Blocks::new`].
    pub(super) fn new(places: Places, scenes: &[&Scene], law: &BuiltIn, devices: Option<&[DeviceChoice]>) -> Self {
        let varying = |(peer, run): (usize, usize)| {
            let (scene, member) = (scenes[run], places.first + peer);
            let hand = HandForce::of(scene.peers[member].hand.as_ref());
            // Constant hands are part of the blocks, and an unmoved device needs no hand: only varying forces remain.
            (hand.constant().is_none() && moves(scene, member, devices)).then_some((peer, run, hand))
        };
        Self {
            hands: (0..places.peers).flat_map(|peer| (0..places.runs).map(move |run| (peer, run))).filter_map(varying).collect(),
            blocks: Blocks::new::<A>(places, scenes, law, devices),
        }
    }

    /// Returns the bodies without the hands.
    pub(super) fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    /// Returns the bodies without the hands, to change contacts, hands and means.
    pub(super) fn blocks_mut(&mut self) -> &mut Blocks {
        &mut self.blocks
    }

    /// Returns the sample that a peer sends at the present tick.
    #[inline(always)]
    pub(super) fn sample<const L: usize>(&self, peer: usize) -> Sample<A, L> {
        let mut sample = Sample::ZERO;
        for axis in 0..A {
            for run in 0..L {
                (sample.position[axis][run], sample.velocity[axis][run]) = self.blocks.object(axis, peer, run);
            }
        }
        sample
    }

    /// Replaces the hand of a peer in all runs. `None`: no hand.
    pub(super) fn set_hand(&mut self, peer: usize, hand: Option<&Hand>) {
        let (hand, runs) = (HandForce::<A>::of(hand), self.blocks.runs());
        // The old hand may vary and the new hand not, so the list forgets the old hand in both cases.
        self.hands.retain(|(other, ..)| *other != peer);
        match hand.constant() {
            None => self.hands.extend((0..runs).map(|run| (peer, run, hand.clone()))),
            Some(force) => (0..runs).for_each(|run| self.blocks.set_hand(peer, run, force)),
        }
    }

    /// Sets the forces of varying hands to those of the instant `now`.
    #[inline(always)]
    pub(super) fn move_hands(&mut self, now: Instant) {
        for (peer, run, hand) in &self.hands {
            self.blocks.set_hand(*peer, *run, hand.at(now));
        }
    }

    /// Computes the forces of all peers and moves all bodies to the next tick.
    #[inline(always)]
    pub(super) fn advance<const L: usize>(&mut self, processor: pulp::Arch, law: &BuiltIn<Lanes>) -> Moved<L> {
        self.blocks.advance(processor, law)
    }

    /// Returns states and forces of the peers in the block at index `place`, along each axis, before the move.
    pub(super) fn seen(&self, place: usize, law: &BuiltIn<Lanes>) -> [Seen; A] {
        // The blocks of an axis stand together, so the next axis is one axis' blocks away.
        let blocks = self.blocks.of_all().len() / A;
        std::array::from_fn(|axis| self.blocks.seen(axis * blocks + place, law))
    }
}
