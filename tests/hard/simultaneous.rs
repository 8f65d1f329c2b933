//! Thousands of events at one nanosecond: their order is a rule, not an accident of how they were stored.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_peer::Contact;
use cohaptic_tests::{Draft, Log, first_difference, record, run};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Delay, Event, EventQueue, Fate, LinkConfig, Network, NetworkConfig, NodeId};

/// The instant at which everything happens.
const AT: Instant = Instant::from_nanos(1_000_000_007);

/// The link on which a packet that is sent `now` arrives at [`AT`].
fn just_in_time(now: Instant) -> LinkConfig {
    LinkConfig { delay: Delay::constant(AT - now), ..LinkConfig::default() }
}

/// Payload of a packet by its sender, receiver and sequence number.
fn payload((from, to, sequence): (u16, u16, u64)) -> u64 {
    u64::from(from) << 48 | u64::from(to) << 32 | sequence
}

/// Sixty-four nodes send each other three packets each, at different times over links that change, so that all 12,096 arrive at one nanosecond. They come in the
/// order of (sender, receiver, sequence), whichever path they took through the program and in whatever order they were sent.
#[test]
fn twelve_thousand_packets_at_one_nanosecond_come_by_sender_receiver_and_number() {
    let nodes = 64_u16;
    let names: Vec<String> = (0..nodes).map(|node| format!("n{node}")).collect();
    let pairs: Vec<(u16, u16)> = (0..nodes).flat_map(|from| (0..nodes).map(move |to| (from, to))).filter(|(from, to)| from != to).collect();
    for (general, stride) in [(false, 1), (true, 1), (false, 1009), (true, 2017)] {
        let mut network = Network::new(NetworkConfig { seed: 1, nodes: names.clone(), general }, |_, _| just_in_time(Instant::ZERO));
        for round in 0..3_u64 {
            // 4032 has no factor in common with the strides: every pair once, in another order.
            for turn in 0..pairs.len() {
                let (from, to) = pairs[turn * stride % pairs.len()];
                let now = Instant::from_nanos(round * 100_000_000 + turn as u64);
                network.set_link(now, NodeId(from), NodeId(to), just_in_time(now)).unwrap();
                network.handle_packet(now, NodeId(from), NodeId(to), Bytes::new(64), payload((from, to, round))).unwrap();
            }
        }
        assert_eq!((network.poll_timeout(), network.poll_event()), (Some(AT), None));
        network.handle_timeout(AT).unwrap();
        let came: Vec<(u16, u16, u64)> = std::iter::from_fn(|| network.poll_event())
            .map(|event| {
                let packet = (event.path.from.0, event.path.to.0, event.sequence);
                assert_eq!((event.fate, event.payload), (Fate::Delivered(AT), payload(packet)));
                packet
            })
            .collect();
        let expected: Vec<(u16, u16, u64)> = pairs.iter().flat_map(|(from, to)| (0..3).map(move |round| (*from, *to, round))).collect();
        assert!(came == expected, "general {general}, stride {stride}");
    }
}

/// An event with a rank among those of its instant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Ranked(Instant, u64);

impl Event for Ranked {
    type Key = Self;

    fn at(&self) -> Instant {
        self.0
    }

    fn key(&self) -> Self {
        *self
    }
}

/// Twenty thousand events at one instant among others, put in from both ends, taken in the order of their ranks.
#[test]
fn twenty_thousand_events_at_one_instant_come_by_rank() {
    let count = 20_000_u64;
    let mut queue = EventQueue::new();
    for rank in 0..count {
        let rank = if rank % 2 == 0 { rank / 2 } else { count - 1 - rank / 2 };
        queue.push(Ranked(AT, rank));
        queue.push(Ranked(Instant::from_nanos(rank % 1000), rank));
    }
    let mut taken = std::iter::from_fn(|| queue.pop_due(Instant::MAX)).collect::<Vec<_>>();
    assert_eq!(taken.len() as u64, 2 * count);
    assert!(taken.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(taken.drain(count as usize..).map(|event| event.1).eq(0..count));
}

/// Fifty peers whose ticks of 1, 2, 3 and 5 ms meet every 30 ms, all links of one length, so that hundreds of samples arrive at the nanosecond of a tick. At an
/// instant peers come in their places.
fn meeting(peers: usize) -> Draft {
    let mut draft = Draft { duration: 240, update: 30_000, link: "delay = \"30ms\"".to_owned(), ..Draft::calm(peers) };
    draft.damping = 0.5;
    for (place, peer) in draft.peers.iter_mut().enumerate() {
        peer.tick = [1000, 2000, 3000, 5000][place % 4];
        peer.contact = if place % 3 == 0 { Contact::Grasp } else { Contact::None };
        peer.position = Some([0.01 * libm::sin(place as f64), 0.0, 0.0]);
    }
    draft
}

#[test]
fn peers_whose_clocks_meet_tick_in_their_places_and_are_served_before() {
    let draft = meeting(50);
    let scene = draft.scene();
    let [least, general]: [Log; 2] = [Model::Least, Model::General].map(|model| run(&scene, model));
    assert_eq!(first_difference(&least, &general), None);
    // (instant, place) rises strictly.
    assert!(least.ticks.windows(2).all(|pair| (pair[0].at, pair[0].peer) < (pair[1].at, pair[1].peer)));
    for meeting in 0..8_u64 {
        let here = least.ticks.iter().filter(|tick| tick.at.as_nanos() == meeting * 30_000_000);
        assert!(here.map(|tick| tick.peer).eq(0..50), "at {} ms", 30 * meeting);
    }
    // 50·49 samples leave at each meeting, and arrive, in their order, at the next.
    let order = |from: usize, to: usize, sequence: u64| (from, to, sequence);
    for meeting in 1..=8_u64 {
        let arrived: Vec<_> = least
            .packets
            .iter()
            .filter(|row| row.at.as_nanos() == meeting * 30_000_000)
            .map(|row| order(row.path.from.index(), row.path.to.index(), row.sequence))
            .collect();
        let expected =
            (0..50).flat_map(|from| (0..50).map(move |to| (from, to))).filter(|(from, to)| from != to).map(|(from, to)| order(from, to, meeting - 1));
        assert!(arrived.into_iter().eq(expected), "at {} ms", 30 * meeting);
    }
}

#[test]
fn what_is_recorded_of_a_meeting_is_the_same_byte_for_byte() {
    let scene = meeting(30).scene();
    assert_eq!(record(&scene, Model::Least).first_difference(&record(&scene, Model::General)), None);
}

/// A thousand changes at one instant: the last of the file holds, and all of them before anything else happens then.
#[test]
fn a_thousand_changes_at_one_instant_are_made_in_their_order_before_the_tick() {
    let mut draft = Draft { duration: 20, ..Draft::calm(2) };
    draft.timeline =
        (0..1000).map(|number| format!("at = \"10ms\"\nlink = \"all\"\nset = {{ delay = \"{}us\" }}", (number * 7919) % 1000 + 1)).collect();
    let last = Duration::from_micros((999 * 7919) % 1000 + 1);
    let log = run(&draft.scene(), Model::Least);
    for row in &log.packets {
        let expected = if row.offered < Instant::from_nanos(10_000_000) { row.offered } else { row.offered + last };
        assert_eq!(row.fate, Fate::Delivered(expected));
    }
    assert_eq!(log.packets.len(), 2 * 20);
}
