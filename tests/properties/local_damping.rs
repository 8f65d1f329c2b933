//! The law `local-damping` is average-position without BT on an object that is damped by so much more: the motion to the bit, and the analysis.

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_stability::{Method, analyse};
use cohaptic_tests::drafts::anything;
use cohaptic_tests::{Draft, run};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;

/// The scene with `local-damping`, and the one with the same damping in its object.
fn both(draft: Draft, damping: f64) -> (Draft, Draft) {
    let mut local = Draft { strategy: Coordination::LocalDamping, ..draft };
    // Both laws would use new gains of the timeline, but for the damping.
    local.timeline.retain(|change| !change.contains("coordination"));
    local.settings.of_mut(Coordination::LocalDamping).set(0, LawValue::Number(damping));
    let mut object = Draft { strategy: Coordination::AveragePosition, damping: local.damping + damping, ..local.clone() };
    object.gains.damping = 0.0;
    (local, object)
}

properties! {
    #![proptest_config(cases(60))]

    #[test]
    fn it_moves_as_average_position_with_a_damped_object(draft in anything(), damping in 0.0..60.0) {
        let (local, object) = both(draft, damping);
        for model in [Model::Least, Model::General] {
            let (one, other) = (run(&local.scene(), model), run(&object.scene(), model));
            prop_assert_eq!(one.ticks.len(), other.ticks.len());
            for (one, other) in one.ticks.iter().zip(&other.ticks) {
                prop_assert_eq!((one.device, one.object, one.coupling_force), (other.device, other.object, other.coupling_force));
                for axis in 0..3 {
                    let recorded = other.coordination_force[axis] + damping * one.object.velocity[axis];
                    prop_assert_eq!(one.coordination_force[axis], recorded, "FT on the record is the force held and the damping");
                }
            }
        }
    }

    #[test]
    fn its_radius_is_that_of_a_damped_object(draft in anything(), damping in 0.0..60.0) {
        let (local, object) = both(draft, damping);
        for method in [Method::Reduced, Method::Full] {
            let radius = |draft: &Draft| analyse(&draft.scene(), method).map(|found| found.radius.value.to_bits()).map_err(drop);
            prop_assert_eq!(radius(&local), radius(&object));
        }
    }
}
