//! A million packets on their way at once, by day a quarter of them: constant, jittered, copied and lost, in a queue, over many links, in a scene.
//!
//! What is counted is exact at every moment: offered + duplicated = delivered + dropped + in flight. What comes out is in the order of (arrival, sequence), each
//! packet once. And memory is bounded for each packet in flight: a growing ring or slab is at most twice as large as what is in it, and while it is copied the
//! old one, of at most half that size, is there too: 3 places a packet, each no larger than the event that comes out of it, which holds all that it does.

use std::time::Duration;

use cohaptic_harness::{Model, Simulation, TickRow};
use cohaptic_tests::Draft;
use cohaptic_tests_common::quarter_by_day;
use cohaptic_units::{Bytes, Instant, Probability, Rate};
use cohaptic_wan::{
    Bottleneck, Chance, Delay, Distribution, Fate, Jitter, Link, LinkConfig, LinkName, Loss, Network, NetworkConfig, NodeId, PacketEvent,
};

use crate::hard::watch::OnTick;

const SIZE: Bytes = Bytes::new(64);

fn count() -> u64 {
    quarter_by_day(1_000_000)
}

fn nanos(nanos: u64) -> Instant {
    Instant::from_nanos(nanos)
}

fn link(config: LinkConfig) -> Link<u64> {
    Link::new(7, &LinkName::between("here", "there"), config)
}

/// 2 s ± 0.1 s: no delay is below 1 s (10 deviations), which is when the last packet is offered.
fn jittered() -> Delay {
    Delay::with_jitter(Duration::from_secs(2), Jitter::new(Duration::from_millis(100), Distribution::Normal)).unwrap()
}

/// Offers a million packets, one a microsecond, and looks at the counters on the way; gives the memory that they take \[B\].
fn offer_all(link: &mut Link<u64>) -> u64 {
    let measured = allocation_counter::measure(|| {
        for number in 0..count() {
            link.handle_packet(nanos(1000 * number), SIZE, number).unwrap();
        }
    });
    measured.bytes_max
}

/// All events, in order, drained by a driver that comes so much later than the link announces.
fn drain(link: &mut Link<u64>, late: Duration) -> Vec<PacketEvent<u64>> {
    let mut events = Vec::new();
    loop {
        while let Some(event) = link.poll_event() {
            events.push(event);
            if events.len() % 100_000 == 0 {
                let stats = link.stats();
                assert_eq!(stats.offered() + stats.duplicated(), stats.delivered() + stats.dropped_in_all() + stats.in_flight());
            }
        }
        let Some(at) = link.poll_timeout() else { return events };
        link.handle_timeout(at.saturating_add(late)).unwrap();
    }
}

#[test]
fn a_million_packets_of_one_delay_arrive_in_order_each_on_its_nanosecond() {
    let delay = Duration::from_millis(1500);
    let mut link = link(LinkConfig { delay: Delay::constant(delay), ..LinkConfig::default() });
    let memory = offer_all(&mut link);
    assert_eq!((link.stats().in_flight(), link.stats().delivered()), (count(), 0));
    assert!(memory <= 3 * count() * size_of::<PacketEvent<u64>>() as u64, "{} B a packet", memory / count());
    let events = drain(&mut link, Duration::ZERO);
    assert_eq!(events.len() as u64, count());
    for (number, event) in events.iter().enumerate() {
        let sent = nanos(1000 * number as u64);
        assert_eq!((event.sequence, event.payload, event.offered, event.fate), (number as u64, number as u64, sent, Fate::Delivered(sent + delay)));
    }
    assert_eq!((link.stats().in_flight(), link.stats().delivered(), link.stats().mean_delay()), (0, count(), Some(delay)));
}

/// The mean of n delays has a standard error of 100 ms/√n, of a million 0.1 ms: 5 of them, by chance once in 1.7 million seeds.
///
/// In the calendar a packet takes a place in the slab, and an instant with a number (16 B) in each of at most three vectors.
#[test]
fn a_million_packets_with_jitter_arrive_in_the_order_of_their_arrivals_each_once() {
    let mut link = link(LinkConfig { delay: jittered(), ..LinkConfig::default() });
    let memory = offer_all(&mut link);
    assert_eq!(link.stats().in_flight(), count());
    assert!(memory <= 3 * count() * (size_of::<PacketEvent<u64>>() as u64 + 3 * 16), "{} B a packet", memory / count());
    let events = drain(&mut link, Duration::ZERO);
    let mut seen = vec![false; count() as usize];
    for pair in events.windows(2) {
        assert!((pair[0].at, pair[0].sequence) < (pair[1].at, pair[1].sequence));
    }
    for event in &events {
        assert!(!std::mem::replace(&mut seen[event.sequence as usize], true));
        assert_eq!((event.fate, event.offered), (Fate::Delivered(event.at), nanos(1000 * event.sequence)));
    }
    assert_eq!((events.len() as u64, link.stats().in_flight()), (count(), 0));
    let mean = link.stats().mean_delay().unwrap().as_secs_f64();
    assert!((mean - 2.0).abs() < 5.0 * 0.1 / (count() as f64).sqrt(), "{mean}");
}

/// Every fate is decided by the packet's number, not by who looks when: drained every millisecond or once at the end of time, they are the same. The counts of
/// losses (p = 0.1) and copies (0.05 of those left, which may be lost no more) lie within 5 standard deviations √(n·p·(1−p)) of their means.
#[test]
fn a_million_packets_lost_copied_and_delayed_have_the_same_fates_however_they_are_drained() {
    let chance = |p: f64| Probability::new(p).unwrap();
    let config = LinkConfig {
        loss: Loss::Independent(chance(0.1)),
        duplication: Chance::independent(chance(0.05)),
        delay: jittered(),
        ..LinkConfig::default()
    };
    let [soon, late] = [Duration::from_millis(1), Duration::MAX].map(|late| {
        let mut link = link(config.clone());
        offer_all(&mut link);
        let stats = link.stats();
        assert_eq!(stats.offered() + stats.duplicated(), stats.dropped_in_all() + stats.in_flight());
        (drain(&mut link, late), link.stats())
    });
    assert_eq!(soon.1, late.1);
    assert!(soon.0 == late.0);
    let (events, stats) = soon;
    let (n, lost, copied) = (count() as f64, stats.dropped_in_all() as f64, stats.duplicated() as f64);
    assert!((lost - 0.1 * n).abs() < 5.0 * (n * 0.09).sqrt(), "{lost}");
    assert!((copied - 0.05 * (n - lost)).abs() < 5.0 * (n * 0.0475).sqrt(), "{copied}");
    assert_eq!((stats.in_flight(), stats.delivered()), (0, count() + stats.duplicated() - stats.dropped_in_all()));
    // Each packet ends once, and each copy that was made ends once.
    let mut ends = vec![0_u8; count() as usize];
    for event in &events {
        let bit = 1 << (event.copy + if event.fate == Fate::Duplicated { 2 } else { 0 });
        assert_eq!(ends[event.sequence as usize] & bit, 0, "{event:?}");
        ends[event.sequence as usize] |= bit;
    }
    // The packet itself, or it and the making and the end of its copy.
    assert!(ends.iter().all(|ends| *ends == 0b0001 || *ends == 0b1011), "a packet without an end");
}

/// 64 B at 512 Mbit/s are exactly 1 µs: packet n of a burst leaves n + 1 µs after it, and is there 3 ms later.
#[test]
fn a_million_packets_in_a_queue_leave_one_a_microsecond() {
    let bottleneck = Bottleneck::at_rate(Rate::bits_per_sec(512_000_000).unwrap());
    let mut link = link(LinkConfig { bottleneck: Some(bottleneck), delay: Delay::constant(Duration::from_millis(3)), ..LinkConfig::default() });
    for number in 0..count() {
        link.handle_packet(Instant::ZERO, SIZE, number).unwrap();
    }
    assert_eq!(link.stats().in_flight(), count());
    let events = drain(&mut link, Duration::ZERO);
    assert_eq!(events.len() as u64, count());
    for (number, event) in (0..).zip(&events) {
        assert_eq!((event.sequence, event.fate), (number, Fate::Delivered(nanos(1000 * (number + 1) + 3_000_000))));
    }
}

/// Of 32 nodes each sends 1009 packets to each other: 1 000 928 at once. What becomes of each is what becomes of it on a link of that name by itself, and they
/// come in the order of (arrival, sender, receiver, sequence); a tenth of them, by the direct and by the general path.
#[test]
fn a_million_packets_over_a_thousand_links_have_the_fates_of_single_links() {
    let (nodes, each) = (32_u16, quarter_by_day(1009));
    let config = LinkConfig { loss: Loss::Independent(Probability::new(0.01).unwrap()), delay: jittered(), ..LinkConfig::default() };
    let names: Vec<String> = (0..nodes).map(|node| format!("n{node}")).collect();
    let sent = |number: u64| nanos(number * 900_001);
    let through_network = |general: bool, each: u64| {
        let mut network = Network::new(NetworkConfig { seed: 7, nodes: names.clone(), general }, |_, _| config.clone());
        let mut fates = Vec::new();
        for number in 0..each {
            for from in 0..nodes {
                network.handle_broadcast(sent(number), NodeId(from), SIZE, 0_u64).unwrap();
            }
            while let Some(event) = network.poll_event() {
                fates.push((event.at, event.path.from.0, event.path.to.0, event.sequence, event.fate));
            }
        }
        network.handle_timeout(Instant::MAX).unwrap();
        let arrivals = fates.len();
        while let Some(event) = network.poll_event() {
            fates.push((event.at, event.path.from.0, event.path.to.0, event.sequence, event.fate));
        }
        assert!(fates[arrivals..].windows(2).all(|pair| key(&pair[0]) < key(&pair[1])));
        // What was dropped at once came out before; all others were in flight together.
        assert!(fates[..arrivals].iter().all(|fate| matches!(fate.4, Fate::Dropped(_))));
        fates
    };
    assert!(through_network(false, 101) == through_network(true, 101));
    let mut expected = Vec::new();
    for (from, to) in (0..nodes).flat_map(|from| (0..nodes).map(move |to| (from, to))).filter(|(from, to)| from != to) {
        let mut link = Link::new(7, &LinkName::between(&names[usize::from(from)], &names[usize::from(to)]), config.clone());
        for number in 0..each {
            link.handle_packet(sent(number), SIZE, 0_u64).unwrap();
        }
        link.handle_timeout(Instant::MAX).unwrap();
        while let Some(event) = link.poll_event() {
            expected.push((event.at, from, to, event.sequence, event.fate));
        }
    }
    let mut fates = through_network(false, each);
    fates.sort_by_key(key);
    expected.sort_by_key(key);
    assert_eq!(fates.len() as u64, 992 * each);
    assert!(fates == expected);
}

fn key(fate: &(Instant, u16, u16, u64, Fate)) -> (Instant, u16, u16, u64) {
    (fate.0, fate.1, fate.2, fate.3)
}

/// Samples of a kilohertz that take ten minutes: 600 000 on each way, and each copy holds where the other began for so long, then where it was ten minutes ago.
#[test]
fn a_scene_with_a_million_samples_on_their_way_acts_on_each_ten_minutes_later() {
    let (delay, ticks) = (600_000, 601_000_usize);
    let mut draft = Draft { duration: ticks as u64, link: "delay = \"10min\"".to_owned(), damping: 1.0, ..Draft::calm(2) };
    (draft.gains.stiffness, draft.gains.damping) = (0.01, 0.01);
    for (peer, x) in draft.peers.iter_mut().zip([0.25, -0.125]) {
        peer.position = Some([x, 0.0, 0.0]);
    }
    let mut states = vec![[(0.0, 0.0); 2]; ticks];
    let mut tick = 0;
    let Ok(summary) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        states[tick][row.peer] = (row.object.position[0], row.object.velocity[0]);
        let held = if tick < delay { ([0.25, -0.125][1 - row.peer], 0.0) } else { states[tick - delay][1 - row.peer] };
        assert_eq!((row.target.position[0], row.target.velocity[0]), held, "at {}", row.at);
        tick += row.peer;
    }));
    for link in &summary.links {
        // At 601 s itself, the end, the sample of 1 s is there too.
        assert_eq!((link.stats.offered(), link.stats.delivered(), link.stats.in_flight()), (601_000, 1001, 599_999));
    }
}
