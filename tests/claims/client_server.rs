//! When a push is felt through a server.
//!
//! **Claim** (derived in `docs/claims.md`). Over a constant delay of d ticks and with a sample every M ticks, a client that is pushed at tick 0 is first felt by
//! another client at tick M·⌈(M + d + 1)/M⌉ + d. With average-position it is felt at tick M + d + 1, for M of at least 2.

use cohaptic_harness::Model;
use cohaptic_peer::{Contact, Coordination};
use cohaptic_tests::{Draft, DraftHand, run};
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::cases;

/// The first tick at which the third peer feels a force, where the second is pushed from tick 0 on.
fn felt_at(draft: &Draft) -> Option<u64> {
    let log = run(&draft.scene(), Model::Least);
    log.of(2).iter().position(|tick| tick.coupling_force[0] != 0.0).map(|tick| tick as u64)
}

proptest! {
    #![proptest_config(cases(100))]

    #[test]
    fn a_push_is_felt_after_two_ways(every in select(vec![2_u64, 3, 4, 8]), delay in 0..40_u64, force in 0.1..3.0) {
        let mut draft = Draft { duration: 200, update: 1000 * every, link: format!("delay = \"{delay}ms\""), ..Draft::calm(3) };
        for peer in &mut draft.peers {
            peer.contact = Contact::Grasp;
        }
        draft.peers[0].contact = Contact::None;
        draft.peers[1].hand = DraftHand::Force([force, 0.0, 0.0]);
        draft.strategy = Coordination::ClientServer;
        prop_assert_eq!(felt_at(&draft), Some(every * (every + delay + 1).div_ceil(every) + delay));
        draft.strategy = Coordination::AveragePosition;
        prop_assert_eq!(felt_at(&draft), Some(every + delay + 1));
    }
}
