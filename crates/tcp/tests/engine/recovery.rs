//! Repair of lost segments: time and number of retransmissions.

use std::time::Duration;

use cohaptic_tcp::{CongestionControl, Flags, TcpConfig};
use cohaptic_units::Instant;
use cohaptic_wan::{LinkConfig, Loss, Pattern};

use crate::world::{Program, World, link, millis};

/// Returns by how much the last octet of the server's data is later than in a run without a loss, and the world after the run. `lost` are the numbers of the
/// data segments, from 0, whose first transmission is lost.
fn delay_by(config: &TcpConfig, lost: &[usize], octets: u64) -> (Duration, World) {
    let run = |lost: Vec<usize>| {
        let (mut count, mut highest) = (0, 0);
        let mut world = World::new("delay 50ms", 1)
            .config(config)
            .programs(Program::default(), Program::writes(octets))
            .dropping(move |side, segment| {
                let end = segment.sequence.wrapping_sub(99_000);
                if side == 0 || segment.payload.is_empty() || end <= highest {
                    return false;
                }
                (count, highest) = (count + 1, end);
                lost.contains(&(count - 1))
            })
            .connect();
        world.run_to_the_last_octet(Duration::from_secs(600));
        world
    };
    let clean = run(Vec::new()).programs[0].last_read_at.unwrap();
    let world = run(lost.to_vec());
    let at = world.programs[0].last_read_at.unwrap();
    (at.saturating_duration_since(clean), world)
}

/// With selective acknowledgements one round trip repairs any number of losses of one window.
#[test]
fn sack_repairs_a_window_in_one_round_trip() {
    for lost in [vec![70], vec![70, 72, 74], (70..80).collect(), (70..110).step_by(2).collect()] {
        let (delay, world) = delay_by(&TcpConfig::default(), &lost, 150 * 1448);
        let info = world.ends[1].as_ref().unwrap().info();
        assert_eq!((info.timeouts, info.recoveries, info.retransmissions), (0, 1, lost.len() as u64), "{lost:?}");
        assert!(delay <= Duration::from_millis(200), "{lost:?} took {delay:?} longer");
    }
}

/// NewReno repairs one loss per round trip (RFC 6582).
#[test]
fn newreno_repairs_one_loss_a_round_trip() {
    let config = TcpConfig { initial_window: 40, ..TcpConfig::textbook() };
    let took: Vec<_> = (1..=6)
        .map(|count: usize| {
            let lost: Vec<_> = (0..count).map(|k| 2 * k).collect();
            let (delay, world) = delay_by(&config, &lost, 40 * 1460);
            let info = world.ends[1].as_ref().unwrap().info();
            assert_eq!((info.timeouts, info.recoveries, info.retransmissions), (0, 1, count as u64), "{count} lost");
            delay
        })
        .collect();
    let expected: Vec<_> = (1..=6).map(|count| Duration::from_millis(100 * count)).collect();
    assert_eq!(took, expected);
}

/// The whole flight is lost, so that no acknowledgement tells of the loss and only the retransmission timer repairs it.
#[test]
fn a_whole_flight_that_is_lost_costs_a_timeout() {
    let (delay, world) = delay_by(&TcpConfig::textbook(), &[0, 1, 2], 3 * 1460);
    assert_eq!(world.ends[1].as_ref().unwrap().info().timeouts, 1);
    // The timeout of 1 s, then one segment, whose acknowledgement is delayed, then two.
    assert_eq!(delay, Duration::from_millis(1000 + 40 + 100));
}

/// The last segment is lost: a tail loss probe repairs it before the timer does (RFC 8985).
#[test]
fn a_lost_tail_is_probed() {
    let (delay, world) = delay_by(&TcpConfig::default(), &[9], 10 * 1448);
    assert_eq!(world.ends[1].as_ref().unwrap().info().timeouts, 0);
    // Two round trips and 200 ms after the acknowledgement of the rest at the latest.
    assert!(delay <= Duration::from_millis(100 + 400), "{delay:?}");
}

fn throughput(config: &TcpConfig, every: u64, words: &str, megabytes: u64) -> f64 {
    let lossy =
        LinkConfig { loss: Loss::Pattern(Pattern::of_packets(core::iter::once(every - 1..every).collect(), Some(every)).unwrap()), ..link(words) };
    let mut world =
        World::with_links([link(words), lossy], 1).config(config).programs(Program::default(), Program::writes(megabytes * 1_000_000)).connect();
    (world.is_encoded, world.is_checked) = (false, false);
    // What comes before the sawtooth does not count.
    while world.programs[0].read < megabytes * 400_000 {
        world.step();
    }
    let (from, read) = (world.now, world.programs[0].read);
    world.run_to_the_last_octet(Duration::from_secs(10_000));
    (world.programs[0].read - read) as f64 * 8.0 / (world.now - from).as_secs_f64()
}

/// Mathis, Semke, Mahdavi & Ott, 1997: MSS/R·√(3n/2) where every n-th packet is lost.
#[test]
fn reno_has_the_throughput_of_the_square_root_law() {
    let config = TcpConfig { congestion: CongestionControl::Reno, ..TcpConfig::default() };
    for (every, words, round_trip) in [(400, "delay 50ms", 0.1), (1600, "delay 10ms", 0.02)] {
        let seen = throughput(&config, every, words, every / 20);
        let expected = 1448.0 * 8.0 / round_trip * (1.5 * every as f64).sqrt();
        assert!((0.9..1.1).contains(&(seen / expected)), "every {every}: {seen:.0} bit/s, expected {expected:.0}");
    }
}

/// RFC 9438, section 5.2: the average window is (3.7/1.2)^¼·(R/p)^¾ segments where CUBIC is ahead of Reno. Linux rounds the distance from the plateau down to
/// whole segments, so that the window is up to a segment ahead of the curve: a fifth more at a window of 56 segments.
#[test]
fn cubic_has_the_throughput_of_its_response_function() {
    let (every, round_trip) = (1000, 0.2);
    let seen = throughput(&TcpConfig::default(), every, "delay 100ms", 60);
    let window = (0.4f64 * 3.7 / 1.2).powf(0.25) * (round_trip * every as f64).powf(0.75);
    let expected = window * 1448.0 * 8.0 / round_trip;
    assert!((1.0..1.3).contains(&(seen / expected)), "{seen:.0} bit/s, expected {expected:.0}");
}

#[test]
fn jitter_without_loss_costs_no_window() {
    // Jitter may look like a queue that grows, and end slow start early, on Linux as here.
    let config = TcpConfig { hystart: false, ..TcpConfig::default() };
    for seed in 0..20 {
        let mut world = World::new("delay 20ms 5ms", seed).config(&config).programs(Program::default(), Program::writes(1_000_000)).connect();
        world.run_to_the_last_octet(Duration::from_secs(60));
        let info = world.ends[1].as_ref().unwrap().info();
        assert_eq!(info.timeouts, 0);
        assert!(world.programs[0].last_read_at < Some(millis(500)), "seed {seed}: {world:?}");
    }
}

#[test]
fn a_mark_halves_the_window_and_loses_nothing() {
    let config = TcpConfig { ecn: true, ..TcpConfig::default() };
    let mut world = World::new("delay 50ms", 1).config(&config).programs(Program::default(), Program::writes(500_000)).logged().connect();
    world.run_until(millis(480));
    let mut is_first = true;
    world.marks = Box::new(move |_, _| std::mem::take(&mut is_first));
    world.run_to_the_last_octet(Duration::from_secs(60));
    let info = world.ends[1].as_ref().unwrap().info();
    assert_eq!((info.retransmissions, info.recoveries), (0, 0));
    assert!(info.slow_start_threshold < 1000, "the window was not reduced: {info:?}");
    assert!(!world.left(0, |segment| segment.flags.has(Flags::ECE) && !segment.flags.has(Flags::SYN)).is_empty());
    assert_eq!(world.left(1, |segment| segment.flags.has(Flags::CWR)).len(), 1);
}

#[test]
fn every_octet_arrives_over_bad_links() {
    let words = [
        "delay 10ms loss 10%",
        "delay 20ms 10ms loss 3%",
        "delay 50ms loss 5% rate 1mbit",
        "delay 5ms 4ms duplicate 10% loss 2%",
        "delay 30ms reorder 25%",
    ];
    let configs = [
        TcpConfig::default(),
        TcpConfig::textbook(),
        TcpConfig { rack: false, ..TcpConfig::default() },
        TcpConfig { sack: false, ..TcpConfig::default() },
        TcpConfig { timestamps: false, receive_buffer: Some(20_000), ..TcpConfig::default() },
    ];
    for words in words {
        for (seed, config) in (0..4).flat_map(|seed| configs.iter().map(move |config| (seed, config))) {
            let mut world =
                World::new(words, seed).config(config).programs(Program::writes(60_000).and_shuts(), Program::writes(90_000).and_shuts()).connect();
            // The programs check every octet.
            world.run_to_the_last_octet(Duration::from_secs(3600));
            world.run_until(world.now.saturating_add(Duration::from_secs(3600)));
            assert!(world.programs.iter().all(|program| program.end_at.is_some() && program.error.is_none()), "{words}, {seed}: {world:?}");
            assert!(world.ends.iter().flatten().all(cohaptic_tcp::Connection::is_finished), "{words}, {seed}: {world:?}");
            assert!(world.now < Instant::MAX);
        }
    }
}
