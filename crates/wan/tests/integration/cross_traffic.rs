//! Cross-traffic at the bottleneck: waits against the queue M/D/1, the packets' own draws, counters, and drivers of every habit.
#![expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "instants, rates and counts of tests are small and positive")]

use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{
    Bottleneck, CoDel, CrossCounts, CrossRecording, CrossTraffic, Delay, Discipline, Distribution, DropCause, DualPi2, Fate, FqCoDel, Jitter, Link,
    LinkConfig, LinkName, Loss, Network, NetworkConfig, NodeId, PacketInfo, Pie, Poisson, QueueLimit,
};
use proptest::prelude::*;
use rand_distr::{Distribution as _, Exp1};

use crate::any_link::{all_events, any_link, any_model, micros, packets};
use crate::laws::NORMAL_9995;
use crate::random_links::{BYTE_A_MICROSECOND, SEED, cases, probability, rate};

/// Probability that a packet of M/D/1 waits for at most `x` transmission times, with the load `rho` (Erlang 1909):
/// P(W ≤ x) = (1 − ρ)·Σⱼ₌₀^⌊x⌋ (ρ(j − x))ʲ·e^(−ρ(j − x))/j!.
///
/// The terms alternate and reach 10⁶ at ρ = 0.8 and x = 16, so that doubles leave about 10⁻¹⁰ of the sum: more than the five digits of the tests need.
fn waits_at_most(rho: f64, x: f64) -> f64 {
    let mut sum = 0.0;
    let mut j = 0.0;
    while j <= x {
        let base = rho * (j - x);
        // (−b)ʲ·e^b/j! as a product, so that no factor overflows.
        let term = (1..=j as u32).fold((-base).exp(), |term, factor| term * base / f64::from(factor));
        sum += term;
        j += 1.0;
    }
    (1.0 - rho) * sum
}

/// Load, mean wait, and quantiles of the wait, each with its level; waits in times of a packet.
type Waits = (f64, f64, [(f64, f64); 3]);

/// Load, mean wait and quantiles of the wait, in transmission times.
const M_D_1: [Waits; 2] =
    [(0.5, 0.5, [(0.95, 2.0506), (0.99, 3.3363), (0.999, 5.1684)]), (0.8, 2.0, [(0.95, 6.6203), (0.99, 10.3559), (0.999, 15.7003)])];

/// The quantiles have the given four decimals. The mean is ρ/(2(1 − ρ)), also as the integral of the tail.
#[test]
fn the_closed_form_has_the_digits() {
    for (rho, mean, quantiles) in M_D_1 {
        for (p, quantile) in quantiles {
            assert!(waits_at_most(rho, quantile - 0.000_05) < p && p < waits_at_most(rho, quantile + 0.000_05), "{rho}, {p}");
        }
        assert!((rho / (2.0 * (1.0 - rho)) - mean).abs() < 1e-12);
        let tail: f64 = (0..30_000).map(|step| (1.0 - waits_at_most(rho, (f64::from(step) + 0.5) * 1e-3)) * 1e-3).sum();
        assert!((tail - mean).abs() < 1e-3, "{tail}");
    }
}

/// Probes of zero bytes take no time on the line, so they disturb nothing, and Poisson probes see the averages over time (Wolff 1982): the wait of a probe has
/// the law of the wait of a cross packet. Waits of one link are correlated, so the errors come from 160 independent links of 20 s, after a second for the
/// beginning with an empty queue. Student's 0.9995 quantile for 159 degrees is 3.36.
#[test]
fn probes_wait_as_the_m_d_1_queue_says() {
    const LINKS: u64 = 160;
    let line = 12_000_000;
    for (rho, mean, quantiles) in M_D_1 {
        let traffic = CrossTraffic::poisson(Poisson { rate: rate((rho * line as f64) as u64), size: Bytes::new(1500) }).unwrap();
        let config = LinkConfig { bottleneck: Some(Bottleneck::at_rate(rate(line))), cross_traffic: Some(traffic), ..LinkConfig::default() };
        let of_links: Vec<[f64; 4]> = (0..LINKS)
            .map(|seed| {
                let mut link = Link::new(seed, &LinkName::between("a", "b"), config.clone());
                let stream = Stream::new(seed, b"probes");
                let mut now = 1e9;
                let mut number = 0;
                while now < 21e9 {
                    link.handle_packet(Instant::from_nanos(now as u64), Bytes::ZERO, 0_u64).unwrap();
                    let gap: f64 = Exp1.sample(&mut stream.packet(number).draws(Purpose::Jitter));
                    (now, number) = (now + gap * 4e6, number + 1);
                }
                link.handle_timeout(Instant::MAX).unwrap();
                let mut sums = [0.0; 4];
                while let Some(event) = link.poll_event() {
                    let wait = (event.at - event.offered).as_secs_f64() * 1e3;
                    sums[0] += wait;
                    for (sum, (_, quantile)) in sums[1..].iter_mut().zip(quantiles) {
                        *sum += f64::from(u8::from(wait <= quantile));
                    }
                }
                sums.map(|sum| sum / number as f64)
            })
            .collect();
        for (place, (name, expected)) in [("mean", mean)].into_iter().chain(quantiles.map(|(p, _)| ("share", p))).enumerate() {
            let values = || of_links.iter().map(|values| values[place]);
            let found = values().sum::<f64>() / LINKS as f64;
            let error = (values().map(|value| (value - found).powi(2)).sum::<f64>() / ((LINKS - 1) * LINKS) as f64).sqrt();
            assert!((found - expected).abs() < 3.36 * error, "load {rho}, {name} {expected}: {found} ± {error}");
            // The error is small enough for the test to see a wrong law: 1.5 % of the mean, and 11 % of the share beyond a quantile.
            let scale = if place == 0 { 0.015 * expected } else { 0.11 * (1.0 - expected) };
            assert!(error < scale, "load {rho}, {name} {expected}: error {error}");
        }
    }
}

fn recorded(rows: &str) -> Option<CrossTraffic> {
    Some(CrossTraffic::recorded(CrossRecording::parse(&format!("t,bytes\n{rows}")).unwrap()))
}

/// Returns the end of each packet \[µs\], `None` for a dropped packet, and the counts. Packets of ten bytes at the given microseconds, over a byte a
/// microsecond.
fn ends(bottleneck: Bottleneck, rows: &str, offered: &[u64]) -> (Vec<(u64, bool)>, CrossCounts) {
    let config = LinkConfig { bottleneck: Some(bottleneck), cross_traffic: recorded(rows), ..LinkConfig::default() };
    let mut link = Link::new(1, &LinkName::between("a", "b"), config);
    for now in offered {
        link.handle_packet(Instant::from_nanos(now * 1_000), Bytes::new(10), 0_u64).unwrap();
    }
    link.handle_timeout(Instant::MAX).unwrap();
    let events = std::iter::from_fn(|| link.poll_event());
    let ends = events.map(|event| (event.at.as_nanos() / 1_000, matches!(event.fate, Fate::Delivered(_)))).collect();
    (ends, link.stats().cross_traffic())
}

fn line(limit: Option<QueueLimit>, discipline: Discipline) -> Bottleneck {
    Bottleneck { limit, discipline, ..Bottleneck::at_rate(rate(BYTE_A_MICROSECOND)) }
}

/// Cross packets of 100 µs come at 0, 10 and 20 µs, and one of 5 µs at 330 µs. A packet offered at 15 µs waits for two of them, one at 300 µs for nobody, and one
/// at 334 µs for 1 µs. A cross packet after the latest packet of the link is not counted.
#[test]
fn a_packet_waits_for_what_came_before_it() {
    let rows = "0,100\n0.000010,100\n0.000020,100\n0.000330,5\n0.000400,100\n";
    let (seen, counts) = ends(line(None, Discipline::TailDrop), rows, &[15, 310, 334]);
    assert_eq!(seen, [(210, true), (320, true), (345, true)]);
    assert_eq!(counts, CrossCounts { offered: 4, dropped: 0, bytes: 305 });
    // At one instant a departure comes first, then the cross packet, then the packet of the link.
    let (seen, _) = ends(line(Some(QueueLimit::Packets(0)), Discipline::TailDrop), "0,100\n0.000100,20\n", &[100, 120]);
    assert_eq!(seen, [(100, false), (130, true)]);
}

/// The queue has one place. Cross packets of 100 µs at 0 and 10 µs: the second waits, and the packet at 15 µs finds no room. With drops at the head the cross
/// packet gives way, and a cross packet at 20 µs then takes the place of the packet, at its own instant.
#[test]
fn cross_packets_keep_the_limit_and_the_discipline() {
    let one = Some(QueueLimit::Packets(1));
    let rows = "0,100\n0.000010,100\n0.000020,100\n";
    assert_eq!(ends(line(one, Discipline::TailDrop), rows, &[15]), (vec![(15, false)], CrossCounts { offered: 2, dropped: 0, bytes: 200 }));
    assert_eq!(ends(line(one, Discipline::HeadDrop), rows, &[15]), (vec![(20, false)], CrossCounts { offered: 2, dropped: 1, bytes: 200 }));
    // CoDel: packets that wait for more than 5 µs for 20 µs are dropped, cross packets and others alike.
    let codel = Discipline::CoDel(CoDel { target: micros(5), interval: micros(20), mtu: Bytes::new(1), ecn: true });
    let many: String = (0..40).map(|n| format!("{:.6},20\n", f64::from(n) * 5e-6)).collect();
    let offered: Vec<u64> = (2..30).map(|n| 10 * n + 1).chain([2_000]).collect();
    let (seen, counts) = ends(line(None, codel), &many, &offered);
    assert!(counts.offered == 40 && counts.dropped > 3, "{counts:?}");
    assert!(seen.iter().any(|(_, delivered)| !delivered) && seen[28] == (2_010, true), "{seen:?}");
}

/// Cross packets are one flow, whatever the number of queues: behind those of 100 µs at 0, 10 and 20 µs, a packet of the link waits for the packet on the line
/// and for the rest of the quantum alone. A cross packet that finds no room pushes out the packet of the link if that is the longer queue.
#[test]
fn cross_packets_have_a_queue_of_their_own() {
    for flows in [1, 2, 1024] {
        let fq_codel = |quantum: u32| {
            Discipline::FqCoDel(FqCoDel { quantum: quantum.try_into().unwrap(), flows: flows.try_into().unwrap(), ..FqCoDel::default() })
        };
        let rows = "0,100\n0.000010,100\n0.000020,100\n";
        let counts = |offered, dropped, bytes| CrossCounts { offered, dropped, bytes };
        assert_eq!(ends(line(None, fq_codel(100)), rows, &[15]), (vec![(110, true)], counts(2, 0, 200)));
        assert_eq!(ends(line(None, fq_codel(200)), rows, &[15]), (vec![(210, true)], counts(2, 0, 200)));
        let one = Some(QueueLimit::Packets(1));
        assert_eq!(ends(line(one, fq_codel(100)), rows, &[15]), (vec![(110, true)], counts(2, 1, 200)));
        assert_eq!(ends(line(one, fq_codel(100)), "0,100\n0.000020,5\n", &[15]), (vec![(20, false)], counts(1, 0, 100)));
    }
}

/// A driver that comes when a link asks for a wake and one that comes long after see the same, also if it catches up with the cross packets between two packets, and
/// a link asks for a wake at the instant of each of its events: queues with a flow of their own for cross packets drop packets at any instant, PIE counts every
/// packet that is sent, and DualPI2 drops packets as they leave their queue.
#[test]
fn drivers_of_every_habit_see_the_same() {
    let millis = Duration::from_millis;
    let codel = CoDel { target: millis(5), interval: millis(30), mtu: Bytes::new(20), ecn: false };
    let fq_codel = Discipline::FqCoDel(FqCoDel { codel, quantum: 30.try_into().unwrap(), ..FqCoDel::default() });
    let pie = Discipline::Pie(Pie { target: millis(5), burst: Duration::ZERO, mtu: Bytes::new(20), ecn: false });
    let dualpi2 = Discipline::DualPi2(DualPi2 { target: millis(5), ..DualPi2::default() });
    for (discipline, limit, cause) in [(fq_codel, 3, DropCause::CoDel), (pie, 8, DropCause::Pie), (dualpi2, 8, DropCause::DualPi2)] {
        // A byte takes 100 µs. Packets of the link alone need the whole line, and cross packets a quarter of it.
        let traffic = CrossTraffic::poisson(Poisson { rate: rate(20_000), size: Bytes::new(40) }).unwrap();
        let bottleneck = Some(Bottleneck { limit: Some(QueueLimit::Packets(limit)), discipline, ..Bottleneck::at_rate(rate(80_000)) });
        let config = LinkConfig { bottleneck, cross_traffic: Some(traffic), ..LinkConfig::default() };
        let events = |is_punctual: bool, catches_up: bool| {
            let mut link = Link::new(3, &LinkName::between("a", "b"), config.clone());
            let mut events = Vec::new();
            for number in 0..20_000_u64 {
                // Every hundredth packet comes after a silence, in which the queue drains.
                let now = Instant::from_nanos(number * 6_000_000 + number / 100 * 900_000_000);
                if catches_up && number % 3 == 0 {
                    let between = now.as_nanos().saturating_sub(number % 7 * 1_000_000);
                    link.catch_up(Instant::from_nanos(between)).unwrap();
                }
                while let Some(at) = link.poll_timeout().filter(|at| is_punctual && *at < now) {
                    link.handle_timeout(at).unwrap();
                    events.extend(std::iter::from_fn(|| link.poll_event()).map(|event| (at, event.record)));
                }
                link.handle_packet(now, Bytes::new(60 + number % 3), 0_u64).unwrap();
                if is_punctual {
                    events.extend(std::iter::from_fn(|| link.poll_event()).map(|event| (now, event.record)));
                }
            }
            assert!(events.iter().all(|(polled, event)| *polled == event.at));
            link.handle_timeout(Instant::MAX).unwrap();
            let rest = std::iter::from_fn(|| link.poll_event()).map(|event| event.record);
            (events.into_iter().map(|(_, event)| event).chain(rest).collect::<Vec<_>>(), link.stats().cross_traffic())
        };
        let (punctual, counts) = events(true, false);
        for dropped in [DropCause::QueueFull, cause] {
            let count = punctual.iter().filter(|event| event.fate == Fate::Dropped(dropped)).count();
            assert!(count > 5, "{discipline:?}: {count} drops for {dropped:?}");
        }
        for (is_punctual, catches_up) in [(false, false), (false, true)] {
            let (found, found_counts) = events(is_punctual, catches_up);
            assert!(found == punctual && found_counts == counts, "{discipline:?}, {catches_up}");
        }
    }
}

/// Loss and jitter of a packet are those of the link without cross-traffic: the same packets are lost, and a packet that arrives takes the same delay after its
/// departure.
#[test]
fn cross_traffic_changes_no_draw_of_the_link() {
    let delay = Delay::with_jitter(Duration::from_millis(40), Jitter::new(Duration::from_millis(5), Distribution::Gamma)).unwrap();
    let of = |cross_traffic| {
        let bottleneck = Some(Bottleneck::at_rate(rate(12_000_000)));
        let config =
            LinkConfig { loss: Loss::Independent(probability(0.2)), delay: delay.clone(), bottleneck, cross_traffic, ..LinkConfig::default() };
        let offered: Vec<(Duration, PacketInfo)> = (0..3_000).map(|_| (Duration::from_millis(1), Bytes::ZERO.into())).collect();
        all_events(config, &offered)
    };
    // A cross packet every 4 ms keeps the line busy for 1 ms of the four, after three of four packets have passed.
    let rows: String = (0..750).map(|n| format!("{},1500\n", f64::from(4 * n + 1) / 1e3 + 0.000_5)).collect();
    let mut alone = of(None);
    let mut beside = of(recorded(&rows));
    for events in [&mut alone, &mut beside] {
        events.sort_by_key(|event| event.sequence);
    }
    let mut waited = 0;
    for (alone, beside) in alone.iter().zip(&beside) {
        if alone.fate == Fate::Dropped(DropCause::Loss) {
            assert_eq!(alone.fate, beside.fate);
            continue;
        }
        let wait = beside.at - alone.at;
        waited += u32::from(!wait.is_zero());
        // Packet 4n + 1 (at 4n + 2 ms) comes half a millisecond before the line is free.
        let expected = if alone.sequence % 4 == 1 { 500_000 } else { 0 };
        assert_eq!(wait, Duration::from_nanos(expected), "packet {}", alone.sequence);
    }
    assert!(waited > 500);
    let lost = alone.iter().filter(|event| event.fate == Fate::Dropped(DropCause::Loss)).count() as f64;
    assert!((lost - 600.0).abs() < NORMAL_9995 * 480_f64.sqrt(), "{lost}");
}

/// Nobody wakes a link for cross packets: with nothing of its own inside, a link asks for no wake, and beside a queue of a thousand cross packets a packet
/// costs one wake.
#[test]
fn cross_packets_wake_nobody() {
    let rows: String = (0..1_000).map(|_| "0,100\n").collect();
    let config = LinkConfig { bottleneck: Some(line(None, Discipline::TailDrop)), cross_traffic: recorded(&rows), ..LinkConfig::default() };
    let mut link = Link::new(1, &LinkName::between("a", "b"), config);
    link.handle_timeout(Instant::from_nanos(50)).unwrap();
    assert_eq!(link.poll_timeout(), None);
    link.handle_packet(Instant::from_nanos(50), Bytes::new(10), 0_u64).unwrap();
    let mut wakes = 0;
    while let Some(at) = link.poll_timeout() {
        link.handle_timeout(at).unwrap();
        wakes += 1;
        if let Some(event) = link.poll_event() {
            assert_eq!(event.at, Instant::from_nanos(100_010_000));
        }
    }
    assert_eq!(wakes, 1);
}

properties! {
    #![proptest_config(cases(200))]

    /// Links of every kind, changed links and links of a network give the same events and counts, wherever a driver catches up between two packets.
    #[test]
    fn catching_up_changes_nothing(model in any_model(), changed in any_model(), offered in packets(), parts in 1..4u32, change in 0..60u64) {
        let (mut alone, mut subject) = (any_link(model.clone()), any_link(model.clone()));
        let nodes = ["left", "right"].map(String::from).to_vec();
        let mut network = Network::new(NetworkConfig { seed: SEED, nodes, general: false }, |_, _| model.clone());
        let mut now = Instant::ZERO;
        for ((gap, info), payload) in offered.into_iter().zip(0..) {
            for part in 1..=parts {
                let between = now + gap * part / parts;
                subject.catch_up(between).unwrap();
                network.catch_up(between, NodeId(0), NodeId(1)).unwrap();
            }
            now += gap;
            alone.handle_packet(now, info, payload).unwrap();
            subject.handle_packet(now, info, payload).unwrap();
            network.handle_packet(now, NodeId(0), NodeId(1), info, payload).unwrap();
            if payload == change {
                alone.set_model(now, changed.clone()).unwrap();
                subject.set_model(now, changed.clone()).unwrap();
                network.set_link(now, NodeId(0), NodeId(1), changed.clone()).unwrap();
            }
        }
        for link in [&mut alone, &mut subject] {
            link.handle_timeout(Instant::MAX).unwrap();
        }
        network.handle_timeout(Instant::MAX).unwrap();
        let expected: Vec<_> = std::iter::from_fn(|| alone.poll_event()).map(|event| event.record).collect();
        prop_assert_eq!(&expected, &std::iter::from_fn(|| subject.poll_event()).map(|event| event.record).collect::<Vec<_>>());
        prop_assert_eq!(alone.stats(), subject.stats());
        // Copies have other numbers in a network.
        let of_network = std::iter::from_fn(|| network.poll_event()).map(|event| (event.sequence, event.copy > 0, event.at, event.fate));
        let expected = expected.iter().map(|record| (record.sequence, record.copy > 0, record.at, record.fate));
        prop_assert_eq!(expected.collect::<Vec<_>>(), of_network.collect::<Vec<_>>());
        prop_assert_eq!(network.link_stats(NodeId(0), NodeId(1)).unwrap().cross_traffic(), alone.stats().cross_traffic());
    }
}
