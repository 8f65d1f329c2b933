//! A strategy that somebody wrote outside the workspace runs over any scene's network like one of the program's own.

use cohaptic_harness::{Model, Simulation, Strategies};
use cohaptic_peer::{Command, Context, Coordination, Gains, State, Strategy};
use cohaptic_scene::Scene;
use cohaptic_tests::{drafts, first_difference, keep, run};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;

/// Average-position coordination written again, from the samples one by one.
struct Mine(Gains);

impl<const A: usize> Strategy<A> for Mine {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut target = State::REST;
        for place in 0..context.held.len() {
            let sample = context.held.state(place).expect("places count up to the length");
            for axis in 0..A {
                target.position[axis] += sample.position[axis];
                target.velocity[axis] += sample.velocity[axis];
            }
        }
        let others = super::count(context.held.len());
        let mean = State { position: target.position.map(|sum| sum / others), velocity: target.velocity.map(|sum| sum / others) };
        let force = core::array::from_fn(|axis| {
            self.0.stiffness * (context.own.position[axis] - mean.position[axis])
                + self.0.damping * (context.own.velocity[axis] - mean.velocity[axis])
        });
        Command { force, target: mean }
    }

    fn set_gains(&mut self, gains: Gains) {
        self.0 = gains;
    }
}

/// Makes [`Mine`] for every peer, with these gains.
struct AllMine(Gains);

impl Strategies for AllMine {
    // The loops of a run are compiled for each type of strategies. `claims::passivity_control` has boxed strategies too.
    type Strategy<const A: usize> = Box<dyn Strategy<A>>;

    fn strategy<const A: usize>(&self, _scene: &Scene, _peer: usize) -> Self::Strategy<A> {
        Box::new(Mine(self.0))
    }
}

properties! {
    #![proptest_config(cases(100))]

    /// With one or two others there is one way to add samples up, so the two agree to the bit.
    #[test]
    fn a_strategy_written_again_moves_every_copy_the_same(mut draft in drafts::anything_among(2..=3_usize)) {
        draft.strategy = Coordination::AveragePosition;
        let scene = draft.scene();
        let gains = scene.coordination.gains.scaled(scene.coordination.scaling.coordination_factor(scene.peers.len()));
        let own = keep(&Simulation::with_strategies(&scene, Model::Least, AllMine(gains)));
        let difference = first_difference(&run(&scene, Model::Least), &own);
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }

    /// And the strategy that the scene names is really left out.
    #[test]
    fn a_strategy_with_other_gains_moves_copies_otherwise(mut draft in drafts::well_behaved(Just(3_usize), drafts::fixed_link())) {
        draft.strategy = Coordination::AveragePosition;
        let scene = draft.scene();
        let own = keep(&Simulation::with_strategies(&scene, Model::Least, AllMine(scene.coordination.gains.scaled(0.5))));
        prop_assert!(first_difference(&run(&scene, Model::Least), &own).is_some());
    }
}
