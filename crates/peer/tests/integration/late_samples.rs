//! A peer holds the newest sample of each sender, in whatever order the network delivers datagrams.

use std::time::Duration;

use cohaptic_peer::wire::MAX_LEN;
use cohaptic_peer::{
    Clock, Contact, Coordination, CopyConfig, Exchange, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, ReceiveError, Reception,
    RestingDevice, State, coordination::LawStrategy, wire::Sample,
};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

type Receiver = Peer<1, RestingDevice<1>, LawStrategy<1>>;

const SESSION: u64 = 7;
const PLACE: u32 = 1;

/// Returns peer 1 of three peers.
fn receiver() -> Receiver {
    let gains = Gains { stiffness: 1000.0, damping: 5.0 };
    let config = PeerConfig {
        session: SESSION,
        place: PLACE,
        axes: 1,
        contact: Contact::None,
        coupling: gains,
        tick: Duration::from_millis(1),
        compute_delay: false,
        exchange: Exchange::EACH_TICK,
        own_damping: 0.0,
        enclosure: None,
    };
    let clock = Clock::regular(Duration::from_millis(1));
    let object = ObjectCopy::new(CopyConfig { mass: 0.15, damping: 0.0 }, State::REST, Integrator::Exact, &clock);
    let held = Held::new([state(0, 0), state(2, 0)]);
    Peer::new(config, RestingDevice { position: [0.0] }, object, Coordination::AveragePosition.strategy(gains, 3, Duration::from_millis(1)), held)
}

/// Returns the state in sample `sequence` of sender `from`, where the first sample has the number 1. The numbers are small integers, so means are exact.
fn state(from: u32, sequence: u64) -> State<1> {
    let number = f64::from(from) * 1000.0 + f64::from(u32::try_from(sequence).unwrap());
    State { position: [number], velocity: [-number] }
}

fn datagram(session: u64, sender: u32, sequence: u64) -> Vec<u8> {
    let mut bytes = [0; MAX_LEN];
    let len = Sample { session, sender, sequence, sent: Instant::ZERO, state: state(sender, sequence) }.encode(1, &mut bytes);
    bytes[..len].to_vec()
}

properties! {
    #![proptest_config(crate::cases(500))]

    #[test]
    fn a_late_or_repeated_datagram_never_replaces_a_newer_one(
        arrivals in vec((prop_oneof![Just(0_u32), Just(2)], 1..40_u64), 0..80),
        ticks in vec(any::<bool>(), 80),
    ) {
        let mut peer = receiver();
        let mut newest = [0_u64; 3];
        for ((sender, sequence), tick) in arrivals.into_iter().zip(ticks) {
            let held = &mut newest[sender as usize];
            let expected = if sequence > *held { Reception::Newest } else { Reception::Stale };
            *held = sequence.max(*held);
            prop_assert_eq!(peer.handle_datagram(&datagram(SESSION, sender, sequence)), Ok(expected));
            // Some arrivals are in the same tick, others in different ticks.
            if tick {
                let target = peer.compute(Instant::ZERO).target;
                prop_assert_eq!(target.position[0], f64::midpoint(state(0, newest[0]).position[0], state(2, newest[2]).position[0]));
                prop_assert_eq!(target.velocity[0], -target.position[0]);
            }
        }
    }

    #[test]
    fn a_datagram_of_nobody_else_in_the_session_changes_nothing(session in any::<u64>(), sender in 0..6_u32, sequence in 1..9_u64) {
        let mut peer = receiver();
        let before = peer.compute(Instant::ZERO);
        let expected = if session != SESSION { ReceiveError::Session { found: session } } else { ReceiveError::Sender { sender } };
        if session != SESSION || ![0, 2].contains(&sender) {
            prop_assert_eq!(peer.handle_datagram(&datagram(session, sender, sequence)), Err(expected));
        }
        for sender in [PLACE, 3, u32::MAX] {
            prop_assert_eq!(peer.handle_datagram(&datagram_from(sender)), Err(ReceiveError::Sender { sender }));
        }
        prop_assert_eq!(peer.compute(Instant::ZERO), before);
    }
}

fn datagram_from(sender: u32) -> Vec<u8> {
    datagram(SESSION, sender, 99)
}
