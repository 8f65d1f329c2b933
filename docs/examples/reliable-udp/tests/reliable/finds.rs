//! The strategy finds the bug and shrinks it.

use std::cell::Cell;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::test_runner::{RngAlgorithm, TestError, TestRng, TestRunner};
use cohaptic_testkit::strategies::{ImpairedNetwork, Stage, any_network};

use crate::transfer::transfer;

/// How many networks are tried at most.
const CASES: u32 = 1000;

/// Tries networks until one loses messages. Gives how many were tried, and the least impaired one that loses some.
fn search(seed: u8) -> (u32, ImpairedNetwork) {
    let config = ProptestConfig { cases: CASES, failure_persistence: None, ..ProptestConfig::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]));
    let (tried, found) = (Cell::new(0), Cell::new(None));
    let searched = runner.run(&any_network(2), |network| {
        tried.set(tried.get() + 1);
        let missing = transfer::<false>(&network).missing;
        if !missing.is_empty() && found.get().is_none() {
            found.set(Some(tried.get()));
        }
        prop_assert_eq!(missing, []);
        Ok(())
    });
    match (searched, found.get()) {
        (Err(TestError::Fail(_, network)), Some(found)) => (found, network),
        (searched, _) => panic!("nothing found in {} cases: {searched:?}", tried.get()),
    }
}

#[test]
fn the_bug_is_found_and_shrinks_to_one_link_with_one_impairment() {
    for seed in 0..16 {
        let (cases, network) = search(seed);
        assert!(cases < CASES, "seed {seed}: {cases} cases");
        let impaired: Vec<_> = network.impaired().collect();
        assert_eq!(impaired.len(), 1, "seed {seed}: {network}");
        // Only what changes the order of packets can do it.
        let stages = impaired[0].2.stages();
        assert!(stages == [Stage::Jitter] || stages == [Stage::Reorder], "seed {seed}: {stages:?} in {network}");
        // What it prints can be pasted back.
        let pasted = ImpairedNetwork::words(&network.to_string());
        assert_eq!(pasted, network);
        assert_ne!(transfer::<false>(&pasted).missing, []);
        assert_eq!(transfer::<true>(&pasted).missing, []);
    }
}

#[test]
fn the_same_search_gives_the_same() {
    assert_eq!(search(7), search(7));
    let (_, network) = search(7);
    assert_eq!(transfer::<false>(&network), transfer::<false>(&network));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: CASES, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn without_the_bug_all_messages_arrive_over_any_network(network in any_network(2)) {
        prop_assert_eq!(transfer::<true>(&network).missing, []);
    }
}
