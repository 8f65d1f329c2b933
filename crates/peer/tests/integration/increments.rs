//! A server adds the displacements of its clients, each once, in whatever order the network delivers datagrams and however many get lost.

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_peer::coordination::{BuiltInStrategy, LawParameters, LawSettings, LawValue, SessionParameters};
use cohaptic_peer::operator::Seen;
use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{
    Age, Ages, Clock, Contact, Coordination, CopyConfig, Device, DeviceConfig, Exchange, Gains, Hand, Held, Integrator, ObjectCopy, Peer, PeerConfig,
    Reception, RestingDevice, Signal, SimulatedDevice, State,
};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

const SESSION: u64 = 7;
const TICK: Duration = Duration::from_millis(1);
const COUPLING: Gains = Gains { stiffness: 1024.0, damping: 4.0 };
/// Places of the server and of its two clients.
const SERVER: u32 = 1;
const CLIENTS: [u32; 2] = [0, 2];
/// Initial position of each client at the server \[m\], indexed by client.
const INITIAL: [f64; 2] = [0.25, -0.5];

/// Returns a peer of the session with a device, with the words of `returns` and `sends` at these places.
fn peer<D: Device<1>>(place: u32, device: D, returns: usize, sends: usize) -> Peer<1, D, BuiltInStrategy<1>> {
    let mut settings = LawSettings::default();
    let own = settings.of_mut(Coordination::ClientServer);
    own.set(0, LawValue::Place(SERVER as usize));
    own.set(1, LawValue::Word(returns));
    own.set(2, LawValue::Word(sends));
    let at = |x: f64| State { position: [x], velocity: [0.0] };
    let initial = [at(INITIAL[0]), at(0.0), at(INITIAL[1])];
    let session = SessionParameters {
        law: LawParameters { gains: COUPLING, peers: 3, tick: TICK, oldest: None, middle: None, own: *settings.of(Coordination::ClientServer) },
        place: place as usize,
        samples_every: 1,
        initial: initial.to_vec(),
        couplings: vec![(Contact::Grasp, COUPLING); 3],
    };
    let config = PeerConfig {
        session: SESSION,
        place,
        axes: 1,
        contact: if place == SERVER { Contact::None } else { Contact::Grasp },
        coupling: COUPLING,
        tick: TICK,
        compute_delay: false,
        exchange: Exchange::EACH_TICK,
        own_damping: 0.0,
        enclosure: None,
    };
    let object = ObjectCopy::new(CopyConfig { mass: 1.0, damping: 0.0 }, State::REST, Integrator::Exact, &Clock::regular(TICK));
    let held = Held::new((0..3).filter(|other| *other != place as usize).map(|other| initial[other]));
    Peer::new(config, device, object, Coordination::ClientServer.in_session(&session), held)
}

fn server() -> Peer<1, RestingDevice<1>, BuiltInStrategy<1>> {
    peer(SERVER, RestingDevice { position: [0.0] }, 0, 1)
}

/// Returns the displacement in a sample of a client \[m\]. Multiples of 2⁻¹⁰, so that sums are exact in any order.
fn displacement(client: usize, sequence: u64) -> f64 {
    let number = (sequence * 37 + 11 * client as u64) % 101;
    (number as f64 - 50.0) / 1024.0
}

/// Returns the velocity in a sample of a client [m/s].
fn velocity(client: usize, sequence: u64) -> f64 {
    (sequence % 16) as f64 / 8.0 - client as f64
}

/// Returns a sample with a displacement. The position in the sample is a wrong one, which nobody must use.
fn datagram(client: usize, sequence: u64) -> ([u8; MAX_LEN], usize) {
    let state = State { position: [1e3], velocity: [velocity(client, sequence)] };
    let sample = Sample { session: SESSION, sender: CLIENTS[client], sequence, sent: Instant::ZERO, state };
    let mut bytes = [0; MAX_LEN];
    let extra = Extra { receiver: SERVER, numbers: [displacement(client, sequence)], ..Extra::NONE };
    let len = sample.encode_as(SampleKind::Increment, &extra, 1, &mut bytes);
    (bytes, len)
}

properties! {
    #![proptest_config(crate::cases(500))]

    /// Arrivals at random are loss, repetition and reordering at once. The model knows which numbers have arrived, and nothing of windows.
    #[test]
    fn a_position_is_the_sum_of_all_that_arrived(
        arrivals in vec((0..2_usize, prop_oneof![4 => 0..40_u64, 1 => 60_000..60_040_u64]), 0..120),
        ticks in vec(any::<bool>(), 120),
        fades in any::<bool>(),
    ) {
        let mut peer = server();
        // Ages of senders who are present change nothing.
        let mut ages = Ages::default();
        if fades {
            (0..2).for_each(|client| ages.set(&mut peer, client, Age::WHOLE));
        }
        let mut arrived: [BTreeMap<u64, f64>; 2] = [BTreeMap::new(), BTreeMap::new()];
        for ((client, sequence), tick) in arrivals.into_iter().zip(ticks) {
            let expected = match (arrived[client].contains_key(&sequence), arrived[client].keys().any(|other| *other > sequence)) {
                (true, _) => Reception::Stale,
                (false, true) => Reception::Added,
                (false, false) => Reception::Newest,
            };
            arrived[client].insert(sequence, displacement(client, sequence));
            let (bytes, len) = datagram(client, sequence);
            let received = if fades {
                let (sample, extra) = Sample::decode_as(&bytes[..len], SampleKind::Increment, 1).unwrap();
                ages.handle_extended(&mut peer, &sample, &extra)
            } else {
                peer.handle_datagram(&bytes[..len])
            };
            prop_assert_eq!(received, Ok(expected));
            if tick {
                ages.apply(&mut peer);
                let mut force = 0.0;
                for client in 0..2 {
                    let position = INITIAL[client] + arrived[client].values().sum::<f64>();
                    prop_assert_eq!(peer.seen(Seen::Peer(CLIENTS[client] as usize)), Some([position]));
                    let newest = arrived[client].keys().next_back().map_or(0.0, |newest| velocity(client, *newest));
                    force -= COUPLING.stiffness * position + COUPLING.damping * newest;
                }
                // The object never moves here, so that the coupling forces of both clients show the positions and velocities in use.
                prop_assert_eq!(peer.compute(Instant::ZERO).coordination, [force]);
            }
        }
    }

    /// The displacements from a client add up to the motion of its device in every order of arrival; a lost displacement stays missing.
    #[test]
    fn all_displacements_together_are_the_motion(lost in vec(any::<bool>(), 60), order in Just((0..60_usize).collect::<Vec<_>>()).prop_shuffle()) {
        let hand = Hand::Force(Signal::Constant([0.7, 0.0, 0.0]));
        let start = State { position: [INITIAL[0] + 0.1], velocity: [0.0] };
        let device = SimulatedDevice::new(DeviceConfig { mass: 0.1, damping: 1.0 }, Some(&hand), start, Integrator::Exact, &Clock::regular(TICK));
        let (mut client, mut server) = (peer(0, device, 2, 1), server());
        let (mut sent, mut positions) = (Vec::new(), vec![INITIAL[0]]);
        for tick in 0..60 {
            let mut bytes = [0; MAX_LEN];
            positions.push(client.device().state().position[0]);
            let sample = client.next_sample(Instant::ZERO);
            // The server is the first of the two others of client 0.
            let extra = Extra { receiver: SERVER, numbers: client.extra(0), ..Extra::NONE };
            client.all_sent();
            let len = sample.encode_as(SampleKind::Increment, &extra, 1, &mut bytes);
            sent.push(bytes[..len].to_vec());
            let now = Instant::from_nanos(tick * 1_000_000);
            // The server returns no force, so that the device feels its hand alone.
            prop_assert_eq!(client.compute(now).coupling, [0.0]);
            client.advance(now, TICK);
        }
        for number in order.iter().filter(|number| !lost[**number]) {
            server.handle_datagram(&sent[*number]).unwrap();
        }
        let missing: f64 = (0..60).filter(|number| lost[*number]).map(|number| positions[number + 1] - positions[number]).sum();
        let expected = positions[60] - missing;
        let found = server.seen(Seen::Peer(0)).unwrap()[0];
        prop_assert!((found - expected).abs() < 1e-14, "{} is not {}", found, expected);
    }
}

/// A device that jumps anywhere within a metre at each tick. Cubes have bits of many magnitudes, so that most displacements have to be rounded.
struct Jumping(u64);

impl Device<1> for Jumping {
    fn state(&self) -> State<1> {
        let even = (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
        State { position: [even * even * even], velocity: [0.0] }
    }

    fn advance(&mut self, _now: Instant, _span: Duration, _coupling_force: [f64; 1]) {
        // Knuth's multiplier for 64 bits.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    }
}

/// A displacement is rounded, and so is the sum at the server. After any number of samples both roundings together are those of the latest sample.
#[test]
fn errors_of_rounding_do_not_add_up() {
    let (mut client, mut server) = (peer(0, Jumping(1), 2, 1), server());
    for tick in 0..20_000 {
        let sample = client.next_sample(Instant::ZERO);
        let extra = Extra { receiver: SERVER, numbers: client.extra(0), ..Extra::NONE };
        client.all_sent();
        assert_eq!(server.handle_extended(&sample, &extra), Ok(Reception::Newest));
        let apart = server.seen(Seen::Peer(0)).unwrap()[0] - client.device().state().position[0];
        assert!(apart.abs() <= f64::EPSILON, "tick {tick}: {apart:e} m");
        client.device_mut().advance(Instant::ZERO, TICK, [0.0]);
    }
}

/// A client that fades in or out is between the object and its sum, also if the latest displacement was late.
#[test]
fn a_client_that_fades_is_drawn_to_its_sum() {
    let (mut peer, mut ages) = (server(), Ages::default());
    let take = |peer: &mut Peer<1, RestingDevice<1>, BuiltInStrategy<1>>, ages: &mut Ages<1>, sequence| {
        let (bytes, len) = datagram(0, sequence);
        let (sample, extra) = Sample::decode_as(&bytes[..len], SampleKind::Increment, 1).unwrap();
        ages.handle_extended(peer, &sample, &extra).unwrap()
    };
    let force = |peer: &mut Peer<1, RestingDevice<1>, BuiltInStrategy<1>>, ages: &mut Ages<1>| {
        ages.apply(peer);
        peer.compute(Instant::ZERO).coordination[0]
    };
    // The other client stays at its initial position, and the object at zero.
    let of = |position: f64, velocity: f64| -COUPLING.stiffness * (position + INITIAL[1]) - COUPLING.damping * velocity;
    ages.set(&mut peer, 0, Age { weight: 0.5, share: 1.0 });
    assert_eq!(take(&mut peer, &mut ages, 3), Reception::Newest);
    let newest = INITIAL[0] + displacement(0, 3);
    assert_eq!(force(&mut peer, &mut ages), of(0.5 * newest, 0.5 * velocity(0, 3)));
    assert_eq!(take(&mut peer, &mut ages, 2), Reception::Added);
    let sum = newest + displacement(0, 2);
    assert_eq!(force(&mut peer, &mut ages), of(0.5 * sum, 0.5 * velocity(0, 3)));
    // The client is gone, moves unheard of, and returns: the share counts from the place that acted before.
    ages.set(&mut peer, 0, Age::GONE);
    assert_eq!(force(&mut peer, &mut ages), of(0.0, 0.0));
    ages.await_return(&mut peer, 0, 8);
    assert_eq!(take(&mut peer, &mut ages, 5), Reception::Newest);
    assert!(!ages.take_return(0));
    assert_eq!(take(&mut peer, &mut ages, 8), Reception::Newest);
    assert!(ages.take_return(0));
    let before = sum + displacement(0, 5);
    let after = before + displacement(0, 8);
    ages.set(&mut peer, 0, Age { weight: 1.0, share: 0.25 });
    assert_eq!(force(&mut peer, &mut ages), of(0.75 * before + 0.25 * after, 0.75 * velocity(0, 5) + 0.25 * velocity(0, 8)));
    ages.set(&mut peer, 0, Age::WHOLE);
    assert_eq!(force(&mut peer, &mut ages), of(after, velocity(0, 8)));
}

/// A state that is set from outside begins a new sum.
#[test]
fn a_held_state_begins_a_new_sum() {
    let mut peer = server();
    let take = |peer: &mut Peer<1, RestingDevice<1>, BuiltInStrategy<1>>, sequence| {
        let (bytes, len) = datagram(0, sequence);
        peer.handle_datagram(&bytes[..len]).unwrap()
    };
    assert_eq!(take(&mut peer, 9), Reception::Newest);
    peer.hold(0, Instant::ZERO, State { position: [2.0], velocity: [0.0] });
    assert_eq!(peer.seen(Seen::Peer(0)), Some([2.0]));
    assert_eq!(take(&mut peer, 9), Reception::Newest);
    assert_eq!(peer.seen(Seen::Peer(0)), Some([2.0 + displacement(0, 9)]));
}

/// With `returns = "none"` a client sees the object and feels nothing; with states instead of displacements, samples are of kind 3.
#[test]
fn a_client_without_a_force_sees_the_object() {
    let mut client = peer(0, RestingDevice { position: [INITIAL[0]] }, 2, 0);
    assert_eq!((client.kind(), server().kind()), (SampleKind::Force, SampleKind::Increment));
    let object = State { position: [0.75], velocity: [0.5] };
    let sample = Sample { session: SESSION, sender: SERVER, sequence: 0, sent: Instant::ZERO, state: object };
    // A force from a server of another kind would not be felt either.
    let extra = Extra { receiver: 0, numbers: [3.0], ..Extra::NONE };
    assert_eq!(client.handle_extended(&sample, &extra), Ok(Reception::Newest));
    assert_eq!(client.compute(Instant::ZERO).coupling, [0.0]);
    assert_eq!((*client.object().state(), client.seen(Seen::Own)), (object, Some([0.75])));
}
