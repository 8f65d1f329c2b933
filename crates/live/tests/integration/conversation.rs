//! A client and a door in virtual time, over a network that loses, duplicates and reorders datagrams.

use cohaptic_live::client::{Client, ClientConfig, Heard, SessionInfo};
use cohaptic_live::{Admission, AdmissionControl, MAX_DATAGRAM, SystemEntropy};
use cohaptic_peer::wire;
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::prelude::*;
use std::time::Duration;

use crate::support::{Counting, SEAT, SESSION, address, at, cases, config, key, sample};

/// Fate of the datagrams of one tick of 8 ms, in one direction.
#[derive(Clone, Copy, Debug)]
enum Way {
    Lost,
    Passed,
    Doubled,
    /// Delivered 24 ms later.
    Late,
}

fn way() -> impl Strategy<Value = Way> {
    prop_oneof![3 => Just(Way::Lost), 4 => Just(Way::Passed), 1 => Just(Way::Doubled), 2 => Just(Way::Late)]
}

/// Datagrams under way in one direction, with the instants of their delivery.
#[derive(Default)]
struct OnTheWay(Vec<(Instant, Vec<u8>)>);

impl OnTheWay {
    fn push(&mut self, now: Instant, way: Way, datagram: &[u8]) {
        let later = now.saturating_add(Duration::from_millis(24));
        match way {
            Way::Lost => {}
            Way::Passed => self.0.push((now, datagram.to_vec())),
            Way::Doubled => self.0.extend([(now, datagram.to_vec()), (now, datagram.to_vec())]),
            Way::Late => self.0.push((later, datagram.to_vec())),
        }
    }

    /// Removes and returns the datagrams delivered by the instant `now`.
    fn arrived(&mut self, now: Instant) -> Vec<Vec<u8>> {
        let (arrived, rest) = std::mem::take(&mut self.0).into_iter().partition(|(at, _)| *at <= now);
        self.0 = rest;
        arrived.into_iter().map(|(_, datagram)| datagram).collect()
    }
}

/// Returns a client at `SEAT`.
fn client(with_key: bool) -> Client {
    let info = SessionInfo { axes: 1, peers: 3, tick: Duration::from_millis(1), update: Duration::from_millis(8) };
    let config = if with_key {
        ClientConfig::Keyed { session: SESSION, place: SEAT, key: key() }
    } else {
        ClientConfig::Keyless { session: SESSION, place: SEAT, info }
    };
    Client::new(config, at(0))
}

/// Returns a door with random nonces, so that no two doors of a test give the same nonces.
fn door(with_key: bool) -> AdmissionControl {
    AdmissionControl::new(config().with_key(with_key.then(key)), &mut SystemEntropy).unwrap()
}

/// Plays a session that is restarted in the middle. Returns, for each half, the sequence numbers that the door admitted and the sequence numbers that the
/// client heard as new.
fn play(with_key: bool, ways: &[(Way, Way)]) -> ([Vec<u64>; 2], [Vec<u64>; 2]) {
    let (mut client, mut entropy) = (client(with_key), Counting::default());
    let (mut up, mut down) = (OnTheWay::default(), OnTheWay::default());
    let (mut admitted, mut heard) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let mut out = [0; MAX_DATAGRAM];
    // The door's numbers begin high in the first half and at 0 in the second half: the client must accept numbers that go back.
    let (mut number, mut answer) = (0, 1_000_000);
    let middle = ways.len() / 2;
    let mut door_now = door(with_key);
    for (tick, &(way_up, way_down)) in ways.iter().enumerate() {
        let now = at(8 * u64::try_from(tick).unwrap());
        let half = usize::from(tick >= middle);
        if tick == middle {
            door_now = door(with_key);
            answer = 0;
        }
        if let Some(hello) = client.poll_hello(now, &mut entropy).unwrap() {
            up.push(now, way_up, &hello);
        }
        if let Some(len) = client.seal(&sample(SEAT.0, number), &mut out) {
            up.push(now, way_up, &out[..len]);
            number += 1;
        }
        for datagram in up.arrived(now) {
            match door_now.handle_datagram(now, address(1), &datagram) {
                Admission::Sample { sample, .. } => admitted[half].push(wire::Sample::<1>::decode(sample.bytes(), 1).unwrap().sequence),
                Admission::Reply { bytes, .. } => down.push(now, way_down, &bytes),
                Admission::Refused(_) => {}
            }
        }
        if let Some((to, len)) = door_now.seal(now, SEAT, &sample(0, answer), &mut out) {
            assert_eq!(to, address(1));
            down.push(now, way_down, &out[..len]);
        }
        answer += 1;
        for datagram in down.arrived(now) {
            if let Heard::Newest(sample) = client.handle_datagram(now, &datagram) {
                assert_eq!(sample.sender, 0);
                heard[half].push(sample.sequence);
            }
        }
    }
    assert_eq!(client.info().is_some(), !with_key || client.joinings() > 0);
    (admitted, heard)
}

properties! {
    #![proptest_config(cases(48))]

    /// Each half has 2.4 s of a bad network, which loses three of ten ticks and delays two of ten, and then 1.28 s of a network that loses nothing. Between
    /// the halves the session is restarted. A client that has no welcome repeats its hello every 250 ms, and a client that hears nothing new says hello after
    /// a second. So at the end of either half the client must have joined, whatever was lost.
    #[test]
    fn it_joins_and_comes_back_over_a_bad_way(with_key: bool, bad in prop::collection::vec((way(), way()), 2 * 300)) {
        let good = [(Way::Passed, Way::Passed); 160];
        let ways: Vec<_> = [&bad[..300], &good[..], &bad[300..], &good[..]].concat();
        let (admitted, heard) = play(with_key, &ways);
        for half in 0..2 {
            prop_assert!(!admitted[half].is_empty() && !heard[half].is_empty(), "{admitted:?} {heard:?}");
            // No sample is admitted twice.
            let mut numbers = admitted[half].clone();
            numbers.sort_unstable();
            prop_assert!(numbers.windows(2).all(|pair| pair[0] != pair[1]), "{numbers:?}");
        }
        // The good network at the end delivers everything: at least the samples of the last 100 ms.
        prop_assert!(heard[1].len() >= 12 && heard[1].iter().rev().take(12).is_sorted_by(|after, before| after > before));
    }
}

#[test]
fn on_a_good_way_nothing_is_lost_and_hellos_end() {
    let (admitted, heard) = play(true, &[(Way::Passed, Way::Passed); 500]);
    // Hello and welcome pass in the first tick, and a sample in each tick from the second tick on.
    assert_eq!(admitted[0].len(), 249);
    assert_eq!(heard[0], (1_000_001..1_000_250).collect::<Vec<_>>());
    // The last new sample of the first half came in tick 249. A second later, in tick 249 + 125, the client says hello, and from the next tick on the client
    // takes part again.
    assert_eq!(admitted[1].len(), 500 - 375);
    assert_eq!(heard[1], (375 - 250..250).collect::<Vec<_>>());
}

#[test]
fn a_client_waits_and_asks_by_the_clock_it_is_given() {
    let (mut client, mut entropy) = (client(true), Counting::default());
    assert_eq!(client.poll_timeout(), at(0));
    let first = client.poll_hello(at(0), &mut entropy).unwrap().unwrap();
    assert_eq!(client.poll_timeout(), at(250));
    assert_eq!(client.poll_hello(at(249), &mut entropy), Ok(None));
    assert_eq!(client.poll_hello(at(250), &mut entropy), Ok(Some(first)), "the same hello, so that a late welcome is good");
    let mut out = [0; MAX_DATAGRAM];
    assert_eq!(client.seal(&sample(1, 0), &mut out), None, "not before it is welcome");
    let mut door = door(true);
    let Admission::Reply { bytes, .. } = door.handle_datagram(at(260), address(1), &first) else { panic!("no welcome") };
    assert_eq!(client.handle_datagram(at(260), &bytes), Heard::Welcome);
    assert_eq!(client.handle_datagram(at(261), &bytes), Heard::Ignored, "one welcome is enough");
    assert_eq!((client.poll_timeout(), client.joinings()), (at(1260), 1));
    assert_eq!(client.poll_hello(at(1259), &mut entropy), Ok(None));
    assert_ne!(client.poll_hello(at(1260), &mut entropy).unwrap().unwrap(), first, "a new joining has a new nonce");
}
