//! Instants at which a push is felt through a server, and the links over which displacements in place of states make no difference.
//!
//! **Claim** (derived in `docs/claims.md`). Over a constant delay of d ticks and with a sample every M ticks, a client that is pushed at tick 0 is first felt by
//! another client at tick M·⌈(M + d + 1)/M⌉ + d. With average-position it is felt at tick M + d + 1, for M of at least 2.
//!
//! **Claim.** Over a constant delay without loss, clients that send displacements move everything as clients that send their states, but for rounding. Repeated
//! samples change no bit of it. Of lost displacements the server's position of a client lacks each from then on.

use cohaptic_harness::Model;
use cohaptic_peer::coordination::LawValue;
use cohaptic_peer::{Contact, Coordination, Gains};
use cohaptic_tests::{Draft, DraftHand, Log, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::cases;

/// The first tick at which the third peer feels a force, where the second is pushed from tick 0 on.
fn felt_at(draft: &Draft) -> Option<u64> {
    let log = run(&draft.scene(), Model::Least);
    log.of(2).iter().position(|tick| tick.coupling_force[0] != 0.0).map(|tick| tick as u64)
}

properties! {
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

    #[test]
    fn displacements_that_all_arrive_are_positions(every in select(vec![1_u64, 2, 8]), delay in 0..9_u64, force in 0.1..3.0, returns in 0..3_usize, copies in 0.0..1.0) {
        let link = format!("delay = \"{delay}ms\"");
        let states = pushed(every, &link, force, (returns, 0));
        let increments = pushed(every, &link, force, (returns, 1));
        for (one, other) in states.of(0).iter().zip(increments.of(0)) {
            let apart = (one.object.position[0] - other.object.position[0]).abs();
            prop_assert!(apart < 1e-12, "{apart:e} at {:?}", one.at);
        }
        let repeated = pushed(every, &format!("{link}, duplicate = {{ probability = {copies} }}"), force, (returns, 1));
        for peer in 0..3 {
            prop_assert_eq!(repeated.of(peer), increments.of(peer));
        }
    }

    /// The object comes to rest at the mean of both devices as the server knows them: the first without the displacements lost on its link.
    #[test]
    fn what_is_lost_stays_missing(force in 0.5..3.0, lost in 20..60_u64) {
        let link = "delay = \"0ms\"";
        let pattern = format!("{link}, loss = {{ packets = [\"20-{lost}\"], every = 100000 }}");
        let whole = pushed(1, link, force, (2, 1));
        let log = pushed(1, &pattern, force, (2, 1));
        let at = |tick: usize| log.of(1)[tick].device.position[0];
        // Sample n shows the device at tick n. The displacement in it leads from sample n − 1.
        let missing = at(usize::try_from(lost).unwrap()) - at(19);
        let (end, expected) = (log.of(0).last().unwrap().object.position[0], whole.of(0).last().unwrap().object.position[0] - missing / 2.0);
        prop_assert!(missing > 1e-5 && (end - expected).abs() < 1e-9, "{end} is not {expected}");
    }
}

/// A run in which the second of three peers is pushed for 60 ms, and the first is the server. `words`: places of the words of `returns` and `sends`. The link is
/// that of all, but for what the server sends.
fn pushed(every: u64, link: &str, force: f64, (returns, sends): (usize, usize)) -> Log {
    let mut draft = Draft { duration: 2000, update: 1000 * every, link: link.to_owned(), strategy: Coordination::ClientServer, ..Draft::calm(3) };
    for peer in &mut draft.peers {
        (peer.contact, peer.coupling) = (Contact::Grasp, Gains { stiffness: 100.0, damping: 5.0 });
    }
    draft.peers[0].contact = Contact::None;
    draft.peers[1].hand = DraftHand::Force([force, 0.0, 0.0]);
    draft.timeline = vec!["at = \"60ms\"\npeer = \"NAME\"\nset = { hand = { force = 0.0 } }".replace("NAME", &draft.peers[1].name)];
    let own = draft.settings.of_mut(Coordination::ClientServer);
    own.set(1, LawValue::Word(returns));
    own.set(2, LawValue::Word(sends));
    run(&draft.scene(), Model::Least)
}
