//! A client and a door in virtual time, over a way that loses, doubles and reorders.

use cohaptic_live::client::{Client, ClientConfig, Heard, SessionInfo};
use cohaptic_live::{Admission, AdmissionControl, MAX_DATAGRAM, SystemEntropy};
use cohaptic_peer::wire;
use cohaptic_units::Instant;
use proptest::prelude::*;
use std::time::Duration;

use crate::support::{Counting, SEAT, SESSION, address, at, cases, config, key, sample};

/// What happens to the datagrams of one tick of 8 ms, on each way.
#[derive(Clone, Copy, Debug)]
enum Way {
    Lost,
    Passed,
    Doubled,
    /// It comes 24 ms later.
    Late,
}

fn way() -> impl Strategy<Value = Way> {
    prop_oneof![3 => Just(Way::Lost), 4 => Just(Way::Passed), 1 => Just(Way::Doubled), 2 => Just(Way::Late)]
}

/// Datagrams on one way, with the instants at which they come.
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

    fn arrived(&mut self, now: Instant) -> Vec<Vec<u8>> {
        let (arrived, rest) = std::mem::take(&mut self.0).into_iter().partition(|(at, _)| *at <= now);
        self.0 = rest;
        arrived.into_iter().map(|(_, datagram)| datagram).collect()
    }
}

fn client(with_key: bool) -> Client {
    let info = SessionInfo { axes: 1, peers: 3, tick: Duration::from_millis(1), update: Duration::from_millis(8) };
    let config = if with_key {
        ClientConfig::Keyed { session: SESSION, place: SEAT, key: key() }
    } else {
        ClientConfig::Keyless { session: SESSION, place: SEAT, info }
    };
    Client::new(config, at(0))
}

fn door(with_key: bool) -> AdmissionControl {
    AdmissionControl::new(config().with_key(with_key.then(key)), &mut SystemEntropy).unwrap()
}

/// Plays a session, begun anew in the middle, and gives what was let in and heard as new in each half.
fn play(with_key: bool, ways: &[(Way, Way)]) -> ([Vec<u64>; 2], [Vec<u64>; 2]) {
    let (mut client, mut entropy) = (client(with_key), Counting::default());
    let (mut up, mut down) = (OnTheWay::default(), OnTheWay::default());
    let (mut admitted, mut heard) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let mut out = [0; MAX_DATAGRAM];
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

proptest! {
    #![proptest_config(cases(48))]

    /// 2.4 s on a way that loses three of ten and delays two of ten, 1.28 s on one that loses nothing; then the session is started again, and both
    /// once more. Whatever was lost: a client that is not welcome asks every 250 ms, and one that hears nothing new asks after a second, so at the
    /// end of either half it must be there.
    #[test]
    fn it_joins_and_comes_back_over_a_bad_way(with_key: bool, bad in prop::collection::vec((way(), way()), 2 * 300)) {
        let good = [(Way::Passed, Way::Passed); 160];
        let ways: Vec<_> = [&bad[..300], &good[..], &bad[300..], &good[..]].concat();
        let (admitted, heard) = play(with_key, &ways);
        for half in 0..2 {
            prop_assert!(!admitted[half].is_empty() && !heard[half].is_empty(), "{admitted:?} {heard:?}");
            // Nothing is let in twice.
            let mut numbers = admitted[half].clone();
            numbers.sort_unstable();
            prop_assert!(numbers.windows(2).all(|pair| pair[0] != pair[1]), "{numbers:?}");
        }
        // On the good way at the end everything passes: at least what is sent in the last 100 ms.
        prop_assert!(heard[1].len() >= 12 && heard[1].iter().rev().take(12).is_sorted_by(|after, before| after > before));
    }
}

#[test]
fn on_a_good_way_nothing_is_lost_and_hellos_end() {
    let (admitted, heard) = play(true, &[(Way::Passed, Way::Passed); 500]);
    // Hello and welcome in the first tick, and a sample in each from the second on.
    assert_eq!(admitted[0].len(), 249);
    assert_eq!(heard[0], (1_000_001..1_000_250).collect::<Vec<_>>());
    // The last one was new in tick 249; a second later, in tick 249 + 125, it says hello, and from the next on it is there.
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
