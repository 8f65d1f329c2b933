//! Average-position and proportional-derivative coordination are one law with different gains: Σⱼ K(x − xⱼ) over the N−1 others is (N−1)·K·(x − x̄).

use cohaptic_harness::Model;
use cohaptic_peer::coordination::Pull;
use cohaptic_peer::{Coordination, Gains};
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, analyse};
use cohaptic_tests::{drafts, first_difference, run};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;

properties! {
    #![proptest_config(cases(300))]

    #[test]
    fn two_peers_cannot_tell_the_strategies_apart(mut draft in drafts::anything_among(Just(2))) {
        draft.strategy = Coordination::AveragePosition;
        let average_position = run(&draft.scene(), Model::Least);
        draft.strategy = Coordination::ProportionalDerivative;
        let difference = first_difference(&average_position, &run(&draft.scene(), Model::Least));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }

    /// (N−1)·K is rounded once, here and in the program, so the two agree to the bit.
    #[test]
    fn proportional_derivative_is_average_position_with_more_gain(mut draft in drafts::anything_among(2..=6_usize)) {
        draft.timeline.retain(|entry| !entry.contains("coordination"));
        let others = super::count(draft.peers.len() - 1);
        let Gains { stiffness, damping } = draft.gains;
        draft.strategy = Coordination::ProportionalDerivative;
        let proportional_derivative = run(&draft.scene(), Model::Least);
        draft.strategy = Coordination::AveragePosition;
        draft.gains = Gains { stiffness: others * stiffness, damping: others * damping };
        let difference = first_difference(&proportional_derivative, &run(&draft.scene(), Model::Least));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }

    /// The key `pull`, also where the timeline changes gains.
    #[test]
    fn average_position_that_pulls_to_each_is_proportional_derivative(mut draft in drafts::anything_among(2..=6_usize)) {
        draft.strategy = Coordination::ProportionalDerivative;
        let proportional_derivative = draft.scene();
        draft.strategy = Coordination::AveragePosition;
        let mut sum = draft.scene();
        sum.coordination.pull = Pull::Sum;
        let difference = first_difference(&run(&proportional_derivative, Model::Least), &run(&sum, Model::Least));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
        let radius = |scene: &Scene| analyse(scene, Method::Reduced).map(|found| found.radius.value.to_bits()).map_err(drop);
        prop_assert_eq!(radius(&proportional_derivative), radius(&sum));
    }

    /// And they are not the same with the same gains: otherwise the tests above would pass for a program that ignores the strategy.
    #[test]
    fn three_peers_can_tell_the_strategies_apart(mut draft in drafts::well_behaved(Just(3_usize), drafts::fixed_link())) {
        draft.strategy = Coordination::AveragePosition;
        let average_position = run(&draft.scene(), Model::Least);
        draft.strategy = Coordination::ProportionalDerivative;
        prop_assert!(first_difference(&average_position, &run(&draft.scene(), Model::Least)).is_some());
    }
}
