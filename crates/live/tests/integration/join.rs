//! Joined peers in virtual time: the peer of a session at another computer moves as the peer that the session computes itself.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_harness::TickRow;
use cohaptic_harness::live::LiveScene;
use cohaptic_live::join::{JoinedConfig, JoinedPeer};
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Label, MAX_DATAGRAM, Place, Refusal, Seat, SessionKey};
use cohaptic_peer::{State, wire};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::support::{Counting, address, key};

/// Scene of two peers of 0.225 kg with KT 500, BT 5 and a device of 0.1 kg and 5 N·s/m. The link delivers between two ticks.
const SCENE: &str = "scene = { title = \"two\", duration = \"3s\", seed = 7 }\nobject = { mass = 0.45 }\n\
    coordination = { strategy = \"average-position\", stiffness = 500.0, damping = 5.0, update = \"8ms\" }\n\
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, silence = { fade = \"1ns\" } }\n\
    peers = [{ name = \"left\", hand = { force = 1.5 } }, { name = \"right\" }]\nlink = { delay = \"24.5ms\" }\n";

pub(crate) fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse_live(SCENE, Path::new("two.toml"), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn config(key: Option<SessionKey>) -> JoinedConfig {
    JoinedConfig { key, scene: 7, label: Label::new("test").unwrap(), stale_after: Duration::from_secs(1) }
}

pub(crate) fn peer(overrides: &[&str], key: Option<SessionKey>, device: Option<Box<dyn Device>>) -> JoinedPeer {
    JoinedPeer::new(scene(overrides), 0, config(key), device).unwrap()
}

pub(crate) fn at(micros: u64) -> Instant {
    Instant::from_nanos(micros * 1000)
}

/// Does what is due until `now`, and returns the datagrams sent.
pub(crate) fn pass(peer: &mut JoinedPeer, now: Instant, observer: &mut impl FnMut(&TickRow<'_>)) -> Vec<Vec<u8>> {
    let mut sent = Vec::new();
    while peer.poll_timeout() <= now {
        peer.handle_timeout(now.min(peer.poll_timeout().max(Instant::ZERO)), &mut Counting::default(), &mut |_, row| observer(row)).unwrap();
        sent.extend(std::iter::from_fn(|| peer.poll_transmit()).map(|outgoing| outgoing.bytes().to_vec()));
    }
    sent
}

/// The numbers were computed by two other programs from the equations of the model.
#[test]
fn a_peer_alone_moves_as_the_equations_say() {
    let slow = ["peer.coupling.stiffness=1000", "peer.coupling.damping=2", "peer.device.exchange-every=2", "peer.device.exchange-age=1"];
    let cases: [(&[&str], [f64; 4]); 2] = [
        (&[], [0.00418909868044695, -0.0126283653899512, 0.003717446243695, -0.0121602475770235]),
        (&slow, [0.00524952463767579, -0.0111540648355197, 0.00377446409899885, -0.00545479030280096]),
    ];
    for (overrides, expected) in cases {
        let mut peer = peer(overrides, None, None);
        pass(&mut peer, at(99_000), &mut |_| ());
        let status = peer.status(at(99_000));
        assert_eq!(status.ticks, 100);
        let found = [status.device.position[0], status.device.velocity[0], status.object.position[0], status.object.velocity[0]];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} in place of {expected}");
        }
    }
}

/// States and forces of a row: device, copy, target, FC and FT along the axis.
type Row = [f64; 8];

fn numbers(row: &TickRow<'_>) -> Row {
    let state = |state: &cohaptic_harness::StateRow<'_>| [state.position[0], state.velocity[0]];
    let ([xh, vh], [xo, vo], [xd, vd]) = (state(&row.device), state(&row.object), state(&row.target));
    [xh, vh, xo, vo, xd, vd, row.coupling_force[0], row.coordination_force[0]]
}

/// Observer that keeps the rows of both peers.
#[derive(Default)]
struct Rows(BTreeMap<(usize, Instant), Row>);

impl cohaptic_harness::Observer for Rows {
    type Error = std::convert::Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Self::Error> {
        self.0.insert((row.peer, row.at), numbers(row));
        Ok(())
    }
}

/// Runs a session whose peer `left` joins with a key, in virtual time. Returns the rows of both peers.
fn joined(overrides: &[&str], millis: u64) -> Rows {
    let elsewhere: Vec<&str> = overrides.iter().copied().chain(["peers.left.kind=udp"]).collect();
    let theirs = scene(&elsewhere);
    let mut live = LiveScene::new(&theirs, |_| None);
    let seats = vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(1) }];
    let admission = AdmissionConfig { kind: theirs.sample_kind(), ..AdmissionConfig::new(7, 1, 2, Duration::from_millis(8), seats) };
    let mut door = AdmissionControl::new(admission.with_key(Some(key())), &mut Counting::default()).unwrap();
    let mut left = peer(overrides, Some(key()), None);
    let (mut rows, mut own) = (Rows::default(), BTreeMap::new());
    for half in 0..=2 * millis {
        let now = at(500 * half);
        // A welcome makes tick 0 due at the same instant, so datagrams are passed twice.
        for _ in 0..2 {
            for datagram in pass(&mut left, now, &mut |row| {
                own.insert((row.peer, row.at), numbers(row));
            }) {
                match door.handle_datagram(now, address(1), &datagram) {
                    Admission::Sample { sample, .. } => drop(live.handle_sample(now, 0, sample.bytes(), &mut rows).unwrap().unwrap()),
                    Admission::Reply { bytes, .. } => left.handle_datagram(now, &bytes),
                    Admission::Refused(cause) => panic!("{cause}"),
                }
            }
        }
        while live.poll_timeout().is_some_and(|due| due <= now) {
            live.handle_timeout(now, &mut rows).unwrap();
        }
        let mut sealed = [0; MAX_DATAGRAM];
        while let Some(transmit) = live.poll_transmit() {
            let (_, len) = door.seal(now, Place(0), &transmit.datagram, &mut sealed).unwrap();
            left.handle_datagram(transmit.at, &sealed[..len]);
        }
    }
    rows.0.extend(own);
    rows
}

#[test]
fn a_joined_peer_moves_as_the_peer_of_the_session_over_the_same_link() {
    let slow = ["peers.left.device.exchange-every=2", "peers.left.device.exchange-age=1", "peer.coupling.stiffness=1000"];
    for overrides in [&[][..], &slow, &["link.loss=20%"], &["coordination.strategy=wave", "coordination.stiffness=0"]] {
        let mut expected = Rows::default();
        let reference = scene(overrides);
        let mut live = LiveScene::new(&reference, |_| None);
        live.handle_timeout(at(1_999_500), &mut expected).unwrap();
        let found = joined(overrides, 2000);
        assert!(expected.0.len() == 4000, "{}", expected.0.len());
        for (key, expected) in &expected.0 {
            let found = found.0.get(key).unwrap_or_else(|| panic!("no {key:?}"));
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{overrides:?} {key:?}: {found} in place of {expected}");
            }
        }
    }
}

/// Device at a fixed position that can be there or not, the force on its hand, and its stopper.
struct There(std::sync::Arc<std::sync::Mutex<(bool, f64)>>, Stopper);

impl Device for There {
    fn description(&self) -> Description {
        Description { name: "there".to_owned(), motions: 3, force: 20.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        self.1.clone()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        self.0.lock().unwrap().0.then_some(Reading { position: [0.01, 0.0, 0.0], velocity: [0.0; 3] })
    }

    fn hold(&mut self, _now: Instant, _span: Duration, force: GatedForce) {
        self.0.lock().unwrap().1 = force.newtons()[0];
    }
}

#[test]
fn a_silent_session_and_a_device_that_is_not_there_end_the_force_at_once() {
    let shared = std::sync::Arc::new(std::sync::Mutex::new((true, 0.0)));
    let quick = ["peers.left.kind=falcon", "peers.left.silence.fade=100ms"];
    let mut peer = peer(&quick, None, Some(Box::new(There(shared.clone(), Stopper::default()))));
    let mut seconds = |until: u64, there: bool| {
        shared.lock().unwrap().0 = there;
        let sent = pass(&mut peer, at(until * 1000), &mut |_| ()).len();
        (sent, shared.lock().unwrap().1)
    };
    // The force rises from zero over the fade: at tick 0 there is none, and in the middle there is half of KC times the distance.
    assert!(seconds(0, true).1.abs() < 1e-12);
    let (sent, force) = seconds(500, true);
    assert!(sent > 60 && force.abs() > 0.1, "{sent} {force}");
    assert_eq!(seconds(501, false).1, 0.0, "a device that cannot be read");
    assert_eq!(seconds(600, false).0, 0, "nobody hears of a device that is not there");
    assert!(seconds(999, true).1.abs() > 0.1);
    // Nothing new has come for a second since tick 0.
    assert_eq!(seconds(1000, true).1, 0.0);
    let (sent, force) = seconds(2000, true);
    assert_eq!((sent, force), (125, 0.0), "it goes on sending, so that the session finds it again");
    let sample = wire::Sample { session: 7, sender: 1, sequence: 0, sent: Instant::ZERO, state: State { position: [0.0], velocity: [0.0] } };
    let mut datagram = [0; wire::MAX_LEN];
    let len = sample.encode(1, &mut datagram);
    peer.handle_datagram(at(2_000_500), &datagram[..len]);
    let status = |peer: &JoinedPeer, millis: u64| peer.status(at(millis * 1000)).is_session_there;
    assert!(!status(&peer, 2000));
    pass(&mut peer, at(2_050_000), &mut |_| ());
    assert!(status(&peer, 2050) && shared.lock().unwrap().1.abs() > 1e-3, "the session is back, and the force rises");
    assert_eq!(peer.status(at(2_050_000)).silences, 1);
}

/// FC is the weight times KC·(xH − xO) + BC·(vH − vO), with 3500 N/m and 5 N·s/m.
#[test]
fn the_coupling_rises_over_the_fade_and_is_zero_without_device_or_session() {
    let expect = |peer: &mut JoinedPeer, millis: u64, expected: f64| {
        let mut weight = f64::NAN;
        pass(peer, at(millis * 1000), &mut |row| {
            let ([xh, vh, xo, vo, ..], force) = (numbers(row), row.coupling_force[0]);
            weight = force / (3500.0 * (xh - xo) + 5.0 * (vh - vo));
        });
        assert!((weight - expected).abs() < 1e-9, "{weight} in place of {expected} at {millis} ms");
    };
    let shared = std::sync::Arc::new(std::sync::Mutex::new((true, 0.0)));
    let there = |is_there: bool| shared.lock().unwrap().0 = is_there;
    let quick = ["peers.left.kind=falcon", "peers.left.silence.fade=100ms"];
    let mut held = peer(&quick, None, Some(Box::new(There(shared.clone(), Stopper::default()))));
    for (millis, weight) in [(0, 0.0), (50, 0.5), (100, 1.0), (150, 1.0)] {
        expect(&mut held, millis, weight);
    }
    there(false);
    expect(&mut held, 151, 0.0);
    expect(&mut held, 299, 0.0);
    there(true);
    for (millis, weight) in [(300, 0.0), (350, 0.5), (999, 1.0), (1000, 0.0)] {
        expect(&mut held, millis, weight);
    }
    let mut simulated = peer(&[], None, None);
    expect(&mut simulated, 999, 1.0);
    expect(&mut simulated, 1000, 0.0);
}

/// Device that has moved by a micrometre more at each reading.
struct Moving(u32);

impl Device for Moving {
    fn description(&self) -> Description {
        Description { name: "moving".to_owned(), motions: 3, force: 20.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        Stopper::default()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        self.0 += 1;
        Some(Reading { position: [f64::from(self.0) * 1e-6, 0.0, 0.0], velocity: [0.0; 3] })
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {}
}

/// Readings of an Inverse3 are an exchange old by themselves. As in a session, a joined peer uses a reading at once, and at exchanges alone.
#[test]
fn readings_of_an_inverse3_are_not_delayed_once_more() {
    let coupling = "peer.coupling={ stiffness = 1000.0, damping = 0.0 }";
    for (kind, every, delay) in [("inverse3", 1, 0), ("inverse3", 4, 0), ("falcon", 1, 0), ("falcon", 4, 4)] {
        let age = u8::from(kind == "inverse3" || delay > 0);
        let device = format!("peers.left.device={{ mass = 0.1, exchange-every = {every}, exchange-age = {age} }}");
        let kind_key = format!("peers.left.kind={kind}");
        let mut peer = peer(&[coupling, &kind_key, &device, "peers.left.silence.fade=1ns"], None, Some(Box::new(Moving(0))));
        let mut tick = 0;
        pass(&mut peer, at(40_000), &mut |row| {
            // The reading of tick k is k + 1 micrometres. At tick 0 the coupling begins to rise.
            let exchange = f64::from(tick / every * every) - f64::from(delay);
            let expected = 1000.0 * ((exchange + 1.0).max(0.0) * 1e-6 - row.object.position[0]);
            let found = row.coupling_force[0];
            assert!(tick == 0 || (found - expected).abs() < 1e-9, "{kind} {every}: {found} in place of {expected} at tick {tick}");
            tick += 1;
        });
        assert_eq!(tick, 41);
    }
}

#[test]
fn a_stop_and_a_panic_end_the_force_for_good() {
    let begun = || {
        let (shared, stopper) = (std::sync::Arc::new(std::sync::Mutex::new((true, 0.0))), Stopper::default());
        let device = There(shared.clone(), stopper.clone());
        let mut peer = peer(&["peers.left.kind=falcon", "peers.left.silence.fade=100ms"], None, Some(Box::new(device)));
        pass(&mut peer, at(500_000), &mut |_| ());
        assert!(shared.lock().unwrap().1.abs() > 0.1 && !stopper.is_stopped());
        (peer, shared, stopper)
    };
    let (mut stopped, shared, stopper) = begun();
    stopped.stop();
    assert_eq!((shared.lock().unwrap().1, stopper.is_stopped()), (0.0, true));
    pass(&mut stopped, at(600_000), &mut |_| ());
    assert_eq!(shared.lock().unwrap().1, 0.0);
    // A thread of a driver sees the stopper; the joined peer is dropped on the way.
    let (mut panics, _, stopper) = begun();
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || pass(&mut panics, at(600_000), &mut |_| panic!("in a tick"))));
    assert!(panicked.is_err() && stopper.is_stopped());
}

/// A hello that is sent twice is welcomed twice, and a session that is started again counts its samples from 0.
#[test]
fn a_second_welcome_keeps_tick_0_and_samples_count_anew_after_a_restart_of_the_session() {
    let mut left = peer(&[], None, None);
    let sample = |sequence: u64, position: f64| {
        let state = State { position: [position], velocity: [0.0] };
        crate::support::encode(&wire::Sample { session: 7, sender: 1, sequence, sent: Instant::ZERO, state })
    };
    let target = |left: &mut JoinedPeer, millis: u64| {
        let mut target = f64::NAN;
        pass(left, at(millis * 1000), &mut |row| target = row.target.position[0]);
        target
    };
    pass(&mut left, at(0), &mut |_| ());
    left.handle_datagram(at(500), &sample(1000, 0.01));
    assert_eq!(target(&mut left, 2), 0.01);
    // The session is silent for a second, and begins anew.
    target(&mut left, 1500);
    left.handle_datagram(at(1_500_500), &sample(0, 0.02));
    assert_eq!(target(&mut left, 1502), 0.02);
    left.handle_datagram(at(1_502_500), &sample(1, 0.03));
    assert_eq!((target(&mut left, 1504), left.senders()[1].taken, left.senders()[1].lost()), (0.03, 3, 0));

    let seats = vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(1) }];
    let other = AdmissionConfig::new(7, 1, 2, Duration::from_millis(8), seats).with_key(Some(key()));
    let mut door = AdmissionControl::new(other, &mut Counting::default()).unwrap();
    let mut keyed = peer(&[], Some(key()), None);
    let hellos = pass(&mut keyed, at(0), &mut |_| ());
    for micros in [30_000, 40_000] {
        let Admission::Reply { bytes, .. } = door.handle_datagram(at(micros), address(1), &hellos[0]) else { panic!("no welcome") };
        keyed.handle_datagram(at(micros), &bytes);
    }
    assert_eq!(keyed.began(), Some(at(30_000)));
}

/// A tick that is made late is made with the samples that had come when the tick was due.
#[test]
fn a_late_tick_takes_the_samples_of_its_instant() {
    let mut left = peer(&[], None, None);
    let state = State { position: [0.01], velocity: [0.0] };
    let sample = crate::support::encode(&wire::Sample { session: 7, sender: 1, sequence: 0, sent: Instant::ZERO, state });
    pass(&mut left, at(1000), &mut |_| ());
    left.handle_datagram(at(2500), &sample);
    let mut targets = Vec::new();
    for _ in 0..3 {
        left.handle_timeout(at(4700), &mut Counting::default(), &mut |_, row| targets.push(row.target.position[0])).unwrap();
    }
    assert_eq!(targets, [0.0, 0.01, 0.01]);
}

/// Device with a reading.
struct Reads(Reading);

impl Device for Reads {
    fn description(&self) -> Description {
        Description { name: "reads".to_owned(), motions: 3, force: 20.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        Stopper::default()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        Some(self.0)
    }

    fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {}
}

#[test]
fn a_reading_counts_along_the_axes_of_the_scene_if_it_is_finite() {
    let status = |position: [f64; 3]| {
        let device = Reads(Reading { position, velocity: [0.0; 3] });
        let mut peer = peer(&["peers.left.kind=falcon"], None, Some(Box::new(device)));
        pass(&mut peer, at(10_000), &mut |_| ());
        let status = peer.status(at(10_000));
        (status.is_device_there, status.device.position)
    };
    assert_eq!(status([0.01, 0.02, 0.03]), (true, [0.01, 0.0, 0.0]));
    assert_eq!(status([0.01, f64::NAN, 0.0]), (true, [0.01, 0.0, 0.0]));
    assert_eq!(status([f64::NAN, 0.0, 0.0]), (false, [0.0; 3]));
}

/// The other peer is elsewhere, too: before its first sample and after its silence it has no pull, and its pull rises and falls over its fade.
#[test]
fn the_pull_of_another_peer_elsewhere_fades_as_in_a_session() {
    let mut left = peer(&["peers.right.kind=udp", "peers.right.silence.fade=100ms"], None, None);
    // The mean of the other peers is own + w·(p − own), where p is the position held for the other peer.
    let weight = |left: &mut JoinedPeer, millis: u64, held: f64| {
        let mut weight = f64::NAN;
        pass(left, at(millis * 1000), &mut |row| {
            let own = row.object.position[0];
            weight = (row.target.position[0] - own) / (held - own);
        });
        weight
    };
    let sample = |sequence: u64, position: f64| {
        let state = State { position: [position], velocity: [0.0] };
        crate::support::encode(&wire::Sample { session: 7, sender: 1, sequence, sent: Instant::ZERO, state })
    };
    let expect = |left: &mut JoinedPeer, millis: u64, held: f64, expected: f64| {
        let found = weight(left, millis, held);
        assert!((found - expected).abs() < 1e-9, "{found} in place of {expected} at {millis} ms");
    };
    expect(&mut left, 100, 0.01, 0.0);
    left.handle_datagram(at(100_500), &sample(0, 0.01));
    expect(&mut left, 101, 0.01, 0.0);
    expect(&mut left, 126, 0.01, 0.25);
    for number in 1..100 {
        left.handle_datagram(at(126_500 + 8000 * number), &sample(number, 0.01));
    }
    expect(&mut left, 930, 0.01, 1.0);
    // The last sample came at 918.5 ms. The pull falls from a second after that arrival on, which is between two ticks.
    expect(&mut left, 1918, 0.01, 1.0);
    expect(&mut left, 1919, 0.01, 0.995);
    expect(&mut left, 1968, 0.01, 0.505);
    // The other peer is back at another position before its pull has fallen to zero. The pull rises from 0.495, and the held position goes the way from the
    // position before to the new position over the fade.
    left.handle_datagram(at(1_968_500), &sample(0, 0.03));
    expect(&mut left, 1969, 0.01, 0.495);
    expect(&mut left, 1994, 0.015, 0.745);
    expect(&mut left, 2069, 0.03, 1.0);
    expect(&mut left, 3018, 0.03, 0.505);
    expect(&mut left, 3069, 0.03, 0.0);
}

/// Two programs ask for the same seat, with a key and without. The second one learns of the first one, and gives up after a time in which a vanished program
/// would have lost the seat. If the first one vanishes, the second one takes the seat before.
#[test]
fn a_peer_without_a_seat_learns_so_and_waits_for_a_vanished_holder() {
    for (key, end) in [(Some(key()), u64::MAX), (None, u64::MAX), (Some(key()), 1000), (None, 1000)] {
        let elsewhere = scene(&["peers.left.kind=udp", "scene.duration=10s"]);
        let mut live = LiveScene::new(&elsewhere, |_| None);
        let seats = vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(1) }];
        let admission = AdmissionConfig::new(7, 1, 2, Duration::from_millis(8), seats).with_key(key.clone());
        let mut door = AdmissionControl::new(admission, &mut Counting::default()).unwrap();
        let mut lefts = [peer(&[], key.clone(), None), peer(&[], key.clone(), None)];
        let mut entropy = [Counting::default(), Counting::default()];
        let (mut taken_from, mut gives_up, mut takes_part) = (None, None, None);
        for millis in 0..4000 {
            let now = at(1000 * millis);
            for (port, left) in lefts.iter_mut().enumerate() {
                // The second program begins after the first one, and the first one ends.
                if if port == 0 { millis >= end } else { millis < 100 } {
                    continue;
                }
                let from = address(1 + u16::try_from(port).unwrap());
                while left.poll_timeout() <= now {
                    left.handle_timeout(now, &mut entropy[port], &mut |_, _| ()).unwrap();
                    while let Some(datagram) = left.poll_transmit() {
                        match door.handle_datagram(now, from, datagram.bytes()) {
                            Admission::Sample { sample, .. } => {
                                live.handle_sample(now, 0, sample.bytes(), &mut Rows::default()).unwrap().unwrap();
                            }
                            Admission::Reply { bytes, .. } => left.handle_datagram(now, &bytes),
                            Admission::Refused(Refusal::SeatTaken) => {
                                left.handle_datagram(now, door.notice(datagram.bytes()).unwrap().bytes());
                            }
                            Admission::Refused(cause) => panic!("{cause}"),
                        }
                    }
                }
            }
            while live.poll_timeout().is_some_and(|due| due <= now) {
                live.handle_timeout(now, &mut Rows::default()).unwrap();
            }
            let mut sealed = [0; MAX_DATAGRAM];
            while let Some(transmit) = live.poll_transmit() {
                if let Some((to, len)) = door.seal(now, Place(0), &transmit.datagram, &mut sealed) {
                    lefts[usize::from(to.port()) - 1].handle_datagram(now, &sealed[..len]);
                }
            }
            assert!(!lefts[0].status(now).is_seat_taken && lefts[0].seat_taken().is_none());
            let second = lefts[1].status(now);
            taken_from = taken_from.or_else(|| second.is_seat_taken.then_some(millis));
            takes_part = takes_part.or_else(|| second.age.map(|_| millis));
            gives_up = gives_up.or_else(|| lefts[1].seat_taken().map(|_| millis));
            assert!(second.age.is_none() || !second.is_seat_taken, "{millis}: the seat is the second program's");
        }
        // The clock of the second program begins at 100 ms, and the first sample of every row of 8 ms is refused.
        assert!(taken_from.is_some_and(|millis| (100..120).contains(&millis)), "{taken_from:?}");
        if end == u64::MAX {
            assert!(gives_up.is_some_and(|millis| (2100..2130).contains(&millis)) && takes_part.is_none(), "{gives_up:?}, {takes_part:?}");
            let text = lefts[1].seat_taken().unwrap().to_string();
            assert_eq!(text, "the seat of left is taken: for 2s the session has refused the samples from here, because another program has the seat");
        } else {
            // The last sample of the first program came before 1 s, so that its seat is free before 2 s, and a sample needs 24.5 ms.
            assert!(takes_part.is_some_and(|millis| (1990..2040).contains(&millis)) && gives_up.is_none(), "{takes_part:?}, {gives_up:?}");
        }
    }
}
