//! Bodies that only go: copies with devices at their centres, and the hands that push the devices.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::{Hand, HandForce};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::blocks::{Blocks, Centres, Grasped, Moved, moves};
use super::bodies::{Bodies, SeenPlace};
use super::lanes::Lanes;
use super::place::Places;
use super::samples::Sample;
use crate::plan::DeviceChoice;

/// All bodies and hands, with A axes.
#[derive(Clone, Debug)]
pub(super) struct Translations<const A: usize> {
    blocks: Blocks,
    /// Hands whose force varies: peer, run and force.
    hands: Vec<(usize, usize, HandForce<A>)>,
}

impl<const A: usize> Translations<A> {
    /// [`Bodies::advance`] of devices that hold those points.
    #[inline(always)]
    pub(super) fn advance_grasped<const L: usize>(&mut self, processor: pulp::Arch, law: &BuiltIn<Lanes>, grasped: &impl Grasped) -> Moved<L> {
        self.blocks.advance(processor, law, grasped)
    }
}

impl<const A: usize> Bodies<A, A> for Translations<A> {
    fn new(places: Places, scenes: &[&Scene], law: &BuiltIn, devices: Option<&[DeviceChoice]>) -> Self {
        let varying = |(peer, run): (usize, usize)| {
            let (scene, member) = (scenes[run], places.first + peer);
            let hand = HandForce::of(scene.peers[member].hand.as_ref());
            (hand.constant().is_none() && moves(scene, member, devices)).then_some((peer, run, hand))
        };
        Self {
            hands: (0..places.peers).flat_map(|peer| (0..places.runs).map(move |run| (peer, run))).filter_map(varying).collect(),
            blocks: Blocks::new::<A>(places, scenes, law, devices),
        }
    }

    #[inline(always)]
    fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    #[inline(always)]
    fn blocks_mut(&mut self) -> &mut Blocks {
        &mut self.blocks
    }

    #[inline(always)]
    fn sample<const L: usize>(&self, peer: usize) -> Sample<A, L> {
        let mut sample = Sample::ZERO;
        self.blocks.add_to::<A, A, L>(&mut sample, peer);
        sample
    }

    #[inline(always)]
    fn set_target<const L: usize>(&mut self, axis: usize, peer: usize, x: [f64; L], v: [f64; L]) {
        self.blocks.set_target(axis, peer, x, v);
    }

    fn set_hand(&mut self, peer: usize, hand: Option<&Hand>) {
        let (hand, runs) = (HandForce::<A>::of(hand), self.blocks.runs());
        self.hands.retain(|(other, ..)| *other != peer);
        match hand.constant() {
            None => self.hands.extend((0..runs).map(|run| (peer, run, hand.clone()))),
            Some(force) => (0..runs).for_each(|run| self.blocks.set_hand(peer, run, force)),
        }
    }

    #[inline(always)]
    fn move_hands(&mut self, now: Instant) {
        for (peer, run, hand) in &self.hands {
            self.blocks.set_hand(*peer, *run, hand.at(now));
        }
    }

    #[inline(always)]
    fn advance<const L: usize>(&mut self, processor: pulp::Arch, law: &BuiltIn<Lanes>) -> Moved<L> {
        self.advance_grasped(processor, law, &Centres)
    }

    fn seen(&self, place: usize, law: &BuiltIn<Lanes>) -> SeenPlace<A> {
        let blocks = self.blocks.of_all().len() / A;
        SeenPlace { axes: std::array::from_fn(|axis| self.blocks.seen(axis * blocks + place, law, None)), turn: None }
    }
}
