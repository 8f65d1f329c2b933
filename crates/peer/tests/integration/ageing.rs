//! Effect on the force of a sender that falls silent, returns, or never sends.

use std::time::Duration;

use cohaptic_peer::wire::Sample;
use cohaptic_peer::{
    Age, Ages, Clock, Contact, Coordination, CopyConfig, Exchange, Forces, Gains, Held, Integrator, ObjectCopy, Peer, PeerConfig, RestingDevice,
    State, coordination::LawStrategy,
};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

const TICK: Duration = Duration::from_millis(1);
const GAINS: Gains = Gains { stiffness: 2000.0, damping: 7.0 };

/// A peer, and the ages of other peers as seen by this peer.
struct Receiver {
    peer: Peer<1, RestingDevice<1>, LawStrategy<1>>,
    ages: Ages<1>,
}

impl Receiver {
    fn set_age(&mut self, other: usize, age: Age) {
        self.ages.set(&mut self.peer, other, age);
    }

    fn await_return(&mut self, other: usize, sequence: u64) {
        self.ages.await_return(&mut self.peer, other, sequence);
    }

    fn take_in(&mut self, sample: &Sample<1>) {
        self.ages.handle_sample(&mut self.peer, sample).unwrap();
    }

    fn compute(&mut self) -> Forces<1> {
        self.ages.apply(&mut self.peer);
        self.peer.compute(Instant::ZERO)
    }

    fn force(&mut self) -> f64 {
        self.compute().coordination[0]
    }
}

/// Returns peer 0 of `peers` peers, at rest at `own`. All other peers begin at the origin.
fn receiver(peers: usize, own: f64) -> Receiver {
    let config = PeerConfig {
        session: 1,
        place: 0,
        axes: 1,
        contact: Contact::None,
        coupling: GAINS,
        tick: TICK,
        compute_delay: false,
        exchange: Exchange::EACH_TICK,
        own_damping: 0.0,
        enclosure: None,
    };
    let clock = Clock::regular(Duration::from_millis(1));
    let object = ObjectCopy::new(CopyConfig { mass: 0.2, damping: 0.0 }, at(own, 0.0), Integrator::Exact, &clock);
    let held = Held::new(vec![State::REST; peers - 1]);
    let peer = Peer::new(config, RestingDevice { position: [0.0] }, object, Coordination::AveragePosition.strategy(GAINS, peers, TICK), held);
    Receiver { peer, ages: Ages::default() }
}

fn at(position: f64, velocity: f64) -> State<1> {
    State { position: [position], velocity: [velocity] }
}

fn sample(sender: u32, sequence: u64, state: State<1>) -> Sample<1> {
    Sample { session: 1, sender, sequence, sent: Instant::ZERO, state }
}

/// The mean of held states that all equal the own state is exactly the own state, for any number of peers.
#[test]
fn senders_without_weight_exert_no_force_at_all() {
    for peers in 2..12 {
        for own in [0.1, -1.0 / 3.0, 1e-9, 7.7] {
            let mut peer = receiver(peers, own);
            for other in 0..peers - 1 {
                peer.set_age(other, Age::GONE);
            }
            for tick in 0..3 {
                assert_eq!(peer.force(), 0.0, "{peers} peers, tick {tick}");
                peer.take_in(&sample(1, tick, at(99.0, -3.0)));
            }
        }
    }
}

/// The formula of the manual, computed by hand with w = 1/4, u = 1/2 and N = 3. All factors are powers of two, so every number is exact.
#[test]
fn what_is_held_is_the_mixture_of_three_states() {
    let mut peer = receiver(3, 1.0);
    peer.take_in(&sample(1, 0, at(4.0, 2.0)));
    peer.take_in(&sample(2, 0, at(-3.0, 0.0)));
    peer.set_age(0, Age { weight: 0.25, share: 1.0 });
    // Held states are (1 + (4 − 1)/4, 2/4) and (−3, 0).
    let target = peer.compute().target;
    assert_eq!((target.position, target.velocity), ([(1.75 - 3.0) / 2.0], [0.25]));
    peer.await_return(0, 5);
    peer.take_in(&sample(1, 4, at(8.0, 2.0)));
    assert!(!peer.ages.take_return(0), "sent before the silence");
    peer.take_in(&sample(1, 5, at(16.0, 4.0)));
    assert!(peer.ages.take_return(0) && !peer.ages.take_return(0));
    peer.set_age(0, Age { weight: 0.25, share: 0.5 });
    // Half of the way from (8, 2) to (16, 4) is (12, 3); a quarter of the way from (1, 0) to (12, 3) is (3.75, 0.75).
    let target = peer.compute().target;
    assert_eq!((target.position, target.velocity), ([(3.75 - 3.0) / 2.0], [0.375]));
}

/// Action of a sender at a tick.
#[derive(Clone, Copy, Debug)]
enum Event {
    Nothing,
    /// The sender sends this position, as a sender does that was never silent.
    Sends(f64),
    /// The sender returns at this position.
    Returns(f64),
    /// The weight of the sender begins to fall (`true`) or to rise (`false`).
    Falls(bool),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        6 => Just(Event::Nothing),
        1 => (-1.0..1.0).prop_map(Event::Sends),
        2 => (-1.0..1.0).prop_map(Event::Returns),
        3 => any::<bool>().prop_map(Event::Falls),
    ]
}

properties! {
    #![proptest_config(crate::cases(400))]

    /// The bound of the manual at every tick, for one of N − 1 senders that leaves, returns and jumps at random. `step` is h/fade.
    #[test]
    fn no_coming_or_going_makes_the_force_jump(
        peers in 2..5_usize, own in -1.0..1.0, events in vec(event(), 1..60), step in prop_oneof![Just(0.004), 0.001..0.5],
    ) {
        let mut peer = receiver(peers, own);
        let (mut age, mut falls, mut sequence) = (Age::GONE, true, 0);
        let (mut newest, mut before) = (State::REST, State::REST);
        peer.set_age(0, age);
        let mut last = peer.force();
        for event in events {
            let mut moved = State::<1>::REST;
            match event {
                Event::Nothing => {}
                Event::Falls(down) => falls = down,
                Event::Sends(position) => {
                    let state = at(position, -position);
                    peer.take_in(&sample(1, sequence, state));
                    moved = at(state.position[0] - newest.position[0], state.velocity[0] - newest.velocity[0]);
                    newest = state;
                }
                Event::Returns(position) => {
                    let state = at(position, -position);
                    peer.await_return(0, sequence);
                    peer.take_in(&sample(1, sequence, state));
                    prop_assert!(peer.ages.take_return(0));
                    before = at(
                        before.position[0] + age.share * (newest.position[0] - before.position[0]),
                        before.velocity[0] + age.share * (newest.velocity[0] - before.velocity[0]),
                    );
                    newest = state;
                    age.share = if age.weight > 0.0 { 0.0 } else { 1.0 };
                    falls = false;
                }
            }
            sequence += 1;
            age.weight = if falls { (age.weight - step).max(0.0) } else { (age.weight + step).min(1.0) };
            age.share = (age.share + step).min(1.0);
            peer.set_age(0, age);
            let now = peer.force();
            // Every distance is at most the distance to the farther of the two states.
            let bound = |newest: f64, before: f64, own: f64, moved: f64| {
                step * ((newest - own).abs().max((before - own).abs()) + (newest - before).abs()) + moved.abs()
            };
            let others = f64::from(u32::try_from(peers - 1).unwrap());
            let bound = (GAINS.stiffness * bound(newest.position[0], before.position[0], own, moved.position[0])
                + GAINS.damping * bound(newest.velocity[0], before.velocity[0], 0.0, moved.velocity[0])) / others;
            prop_assert!((now - last).abs() <= bound * (1.0 + 1e-9) + 1e-9, "{} N in a tick, at most {bound} N", now - last);
            last = now;
        }
    }

    /// After a silence and a full return, a sender counts as if it had never had an age, to the bit.
    #[test]
    fn whole_ages_change_no_bit(own in -1.0..1.0, states in vec((1..4_u32, -1.0..1.0), 1..30), aged in vec(0..3_usize, 1..4)) {
        let (Receiver { peer: mut plain, .. }, mut with_ages) = (receiver(4, own), receiver(4, own));
        for other in &aged {
            with_ages.set_age(*other, Age { weight: 0.3, share: 0.1 });
        }
        with_ages.force();
        for other in &aged {
            with_ages.set_age(*other, Age::WHOLE);
        }
        prop_assert_eq!(plain.compute(Instant::ZERO), with_ages.compute());
        for (sequence, (sender, position)) in states.into_iter().enumerate() {
            let sample = sample(sender, sequence as u64, at(position, position / 3.0));
            plain.handle_sample(&sample).unwrap();
            with_ages.take_in(&sample);
            prop_assert_eq!(plain.compute(Instant::ZERO), with_ages.compute());
        }
    }
}
