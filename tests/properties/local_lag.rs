//! The law `local-lag` with a lag of 0 is average-position: the motion and the radius to the bit.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_stability::{Method, analyse};
use cohaptic_tests::drafts::anything;
use cohaptic_tests::{Draft, run};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;

fn both(draft: Draft) -> (Draft, Draft) {
    let mut lagging = Draft { strategy: Coordination::LocalLag, ..draft };
    lagging.settings.of_mut(Coordination::LocalLag).set(0, LawValue::Duration(Duration::ZERO));
    let plain = Draft { strategy: Coordination::AveragePosition, ..lagging.clone() };
    (lagging, plain)
}

properties! {
    #![proptest_config(cases(60))]

    #[test]
    fn without_a_lag_it_moves_as_average_position(draft in anything()) {
        let (lagging, plain) = both(draft);
        for model in [Model::Least, Model::General] {
            prop_assert_eq!(run(&lagging.scene(), model).ticks, run(&plain.scene(), model).ticks);
        }
    }

    #[test]
    fn without_a_lag_its_radius_is_that_of_average_position(draft in anything()) {
        let (lagging, plain) = both(draft);
        for method in [Method::Reduced, Method::Full] {
            let radius = |draft: &Draft| analyse(&draft.scene(), method).map(|found| found.radius.value.to_bits()).map_err(drop);
            prop_assert_eq!(radius(&lagging), radius(&plain));
        }
    }
}
