//! Queues of a link, against queueing theory and against the papers on active queue management.

use std::time::Duration;

use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{
    AccessLine, Bottleneck, CoDel, Discipline, DropCause, Fate, FqCoDel, Link, LinkConfig, LinkName, Network, NetworkConfig, NodeId, Path, QueueLimit,
};
use rand_distr::{Distribution as _, Exp1};

use crate::laws::NORMAL_9995;
use crate::random_links::{Payload, rate};

const MILLI: u64 = 1_000_000;

/// A nanosecond a byte.
const BYTE_A_NANOSECOND: u64 = 8_000_000_000;

/// Arrivals and services \[ns\] of M/M/1, rounded to nanoseconds, and the waits that a link gives.
fn waits(seed: u64, load: f64, count: u64) -> (Vec<(u64, u64)>, Vec<u64>) {
    const SERVICE: f64 = 100_000.0;
    let bottleneck = Some(Bottleneck::at_rate(rate(BYTE_A_NANOSECOND)));
    let mut link = Link::new(seed, &LinkName::between("a", "b"), LinkConfig { bottleneck, ..LinkConfig::default() });
    let stream = Stream::new(seed, b"arrivals and services");
    let mut exact = 0.0;
    let mut offered = Vec::new();
    for number in 0..count {
        let mut draws = stream.packet(number).draws(Purpose::Jitter);
        let [gap, service]: [f64; 2] = [Exp1.sample(&mut draws), Exp1.sample(&mut draws)];
        exact += gap * SERVICE / load;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "minutes")]
        offered.push((exact as u64, (service * SERVICE).round() as u64));
        let (now, size) = offered[offered.len() - 1];
        link.handle_packet(Instant::from_nanos(now), Bytes::new(size), 0_u64).unwrap();
    }
    link.handle_timeout(Instant::MAX).unwrap();
    let events = std::iter::from_fn(|| link.poll_event());
    let waits = events.map(|event| u64::try_from((event.at - event.offered).as_nanos()).unwrap() - event.size.get()).collect();
    (offered, waits)
}

/// W(n+1) = max(0, W(n) + S(n) − (a(n+1) − a(n))), for every packet, to the nanosecond (Lindley 1952).
#[test]
fn every_wait_is_that_of_lindleys_recursion() {
    let (offered, waits) = waits(61, 0.9, 100_000);
    let mut wait = 0;
    assert_eq!(waits.len(), offered.len());
    assert_eq!(waits[0], 0);
    for (pair, seen) in offered.windows(2).zip(&waits[1..]) {
        let [(before, service), (now, _)] = pair else { unreachable!("pairs") };
        wait = (wait + service).saturating_sub(now - before);
        assert_eq!(wait, *seen);
    }
}

/// M/M/1: the mean wait in units of the mean service is ρ/(1−ρ), and P(W = 0) = 1−ρ. Standard errors from regenerative cycles, as in `laws`.
#[test]
fn exponential_services_wait_as_the_m_m_1_queue_says() {
    const COUNT: u64 = 300_000;
    for (seed, load) in [(62, 0.4), (63, 0.7)] {
        let (_, waits) = waits(seed, load, COUNT);
        // A service of less than half a nanosecond, one in 200 000, leaves no trace of its own.
        let mut cycles: Vec<(f64, f64)> = Vec::new();
        for wait in waits {
            if wait == 0 {
                cycles.push((0.0, 0.0));
            }
            let cycle = cycles.last_mut().unwrap();
            *cycle = (cycle.0 + wait as f64 / 1e5, cycle.1 + 1.0);
        }
        let packets = COUNT as f64;
        let check = |name: &str, expected: f64, of_cycle: &dyn Fn(&(f64, f64)) -> f64| {
            let mean = cycles.iter().map(of_cycle).sum::<f64>() / packets;
            let error = cycles.iter().map(|cycle| (of_cycle(cycle) - mean * cycle.1).powi(2)).sum::<f64>().sqrt() / packets;
            assert!((mean - expected).abs() < NORMAL_9995 * error, "{name} at load {load}: {mean} ± {error}, expected {expected}");
            assert!(error < 0.03 * expected);
        };
        check("mean wait", load / (1.0 - load), &|cycle| cycle.0);
        check("share that finds the line idle", 1.0 - load, &|_| 1.0);
    }
}

/// Twice as much as the line carries, for ever: the wait only grows, so CoDel begins to drop an interval after the first wait above its target and
/// then at the instants t(n+1) = t(n) + interval/√n (RFC 8289, section 4.2), each at the next packet that leaves the queue.
#[test]
fn under_constant_overload_codel_drops_at_interval_over_root_n() {
    let discipline = Discipline::CoDel(CoDel { mtu: Bytes::new(100), ..CoDel::default() });
    let bottleneck = Some(Bottleneck { discipline, ..Bottleneck::at_rate(rate(800_000)) });
    let mut link = Link::new(64, &LinkName::between("a", "b"), LinkConfig { bottleneck, ..LinkConfig::default() });
    // 100 bytes take a millisecond; two are offered in one.
    (0..8_000).for_each(|number| link.handle_packet(Instant::from_nanos(number * MILLI / 2), Bytes::new(100), 0_u64).unwrap());
    let drops: Vec<u64> = std::iter::from_fn(|| link.poll_event())
        .filter(|event| event.fate == Fate::Dropped(DropCause::CoDel))
        .map(|event| event.at.as_nanos())
        .collect();
    // The n-th packet (from 0) leaves the queue at n ms after n/2 ms of waiting: the 10th is the first to have waited 5 ms, with more than one behind it.
    assert_eq!(drops[0], 110 * MILLI);
    let mut due = 110e6;
    for (count, drop) in (1..).zip(&drops[1..]) {
        due += 1e8 / f64::from(count).sqrt();
        let late = *drop as f64 - due;
        // The control law counts in nanoseconds, rounded.
        assert!((-100.0..1e6 + 100.0).contains(&late), "drop {count} at {drop} ns, due at {due}");
    }
    assert!(drops.len() > 350, "{} drops", drops.len());
}

/// Random packets through CoDel and ECN: whoever is capable is marked at the instants at which another would be dropped.
#[test]
fn under_constant_overload_codel_marks_what_is_capable() {
    let discipline = Discipline::CoDel(CoDel { mtu: Bytes::new(100), ecn: true, ..CoDel::default() });
    let bottleneck = Some(Bottleneck { discipline, ..Bottleneck::at_rate(rate(800_000)) });
    let mut link = Link::new(65, &LinkName::between("a", "b"), LinkConfig { bottleneck, ..LinkConfig::default() });
    let info = cohaptic_wan::PacketInfo { size: Bytes::new(100), ecn: Ecn::Capable0 };
    (0..4_000).for_each(|number| link.handle_packet(Instant::from_nanos(number * 500_000), info, 0_u64).unwrap());
    link.handle_timeout(Instant::MAX).unwrap();
    assert_eq!((link.stats().dropped_in_all(), link.stats().delivered()), (0, 4_000));
    let marked: Vec<u64> = std::iter::from_fn(|| link.poll_event()).filter(|event| event.marked).map(|event| event.at.as_nanos()).collect();
    // Marked when it leaves the queue, it arrives a millisecond later.
    assert_eq!(marked[0], 111_000_000);
    let mut due = Duration::from_millis(111).as_nanos() as f64;
    for (count, marked) in (1..).zip(&marked[1..100]) {
        due += 1e8 / f64::from(count).sqrt();
        assert!((-100.0..1e6 + 100.0).contains(&(*marked as f64 - due)), "mark {count} at {marked} ns, due at {due}");
    }
}

/// A line of 12 Mbit/s, on which 1500 bytes take a millisecond.
fn twelve_megabit(limit: u64, discipline: Discipline) -> LinkConfig {
    let limit = Some(QueueLimit::Packets(limit));
    LinkConfig { bottleneck: Some(Bottleneck { limit, discipline, ..Bottleneck::at_rate(rate(12_000_000)) }), ..LinkConfig::default() }
}

/// Sends packets over a link whose payloads are flows, and returns what became of them.
fn over_flows(config: LinkConfig, offered: &[(u64, Payload, u64)]) -> Vec<cohaptic_wan::PacketEvent<Payload>> {
    let mut link = Link::new(66, &LinkName::between("a", "b"), config).with_flows(|flow| u32::try_from(*flow).unwrap());
    let mut offered = offered.to_vec();
    offered.sort_by_key(|(at, ..)| *at);
    for (at, flow, size) in offered {
        link.handle_packet(Instant::from_nanos(at), Bytes::new(size), flow).unwrap();
    }
    link.handle_timeout(Instant::MAX).unwrap();
    std::iter::from_fn(|| link.poll_event()).collect()
}

/// Eight flows send twice as much as the line carries, and a ninth sends a packet of 100 bytes every 50 ms. Its packets wait for the packet on the line, at
/// most a millisecond, though 100 others wait; behind tail drop they wait for the whole queue.
#[test]
fn a_lone_packet_beside_backlogged_flows_waits_for_the_packet_on_the_line_only() {
    let backlog = (0..2_000_u64).map(|number| (number * MILLI / 2, number % 8, 1500));
    let lone = (1..20_u64).map(|number| (number * 50 * MILLI + 123_457, 8, 100));
    let offered: Vec<(u64, Payload, u64)> = backlog.chain(lone).collect();
    let waits = |discipline| -> Vec<u64> {
        let events = over_flows(twelve_megabit(100, discipline), &offered);
        let own = 100 * 8_000 / 12;
        events
            .iter()
            .filter(|event| event.payload == 8)
            .map(|event| if let Fate::Delivered(at) = event.fate { at.as_nanos() - event.offered.as_nanos() - own } else { u64::MAX })
            .collect()
    };
    let fair = waits(Discipline::FqCoDel(FqCoDel::default()));
    assert!(fair.len() == 19 && fair.iter().all(|wait| *wait <= MILLI), "{fair:?}");
    assert!(waits(Discipline::TailDrop)[3..].iter().all(|wait| *wait > 90 * MILLI));
}

/// A flow of 300-byte packets and a flow of 1500-byte packets share the line by bytes, not by packets, also if the small packets come five times as often.
#[test]
fn flows_share_the_line_by_bytes() {
    let small = (0..5_000_u64).map(|number| (number * MILLI / 5, 1, 300));
    let large = (0..1_000_u64).map(|number| (number * MILLI, 2, 1500));
    let offered: Vec<(u64, Payload, u64)> = small.chain(large).collect();
    let events = over_flows(twelve_megabit(10_240, Discipline::FqCoDel(FqCoDel::default())), &offered);
    let of = |flow| -> u64 {
        let arrived = |event: &&cohaptic_wan::PacketEvent<Payload>| matches!(event.fate, Fate::Delivered(at) if at.as_nanos() < 1_000 * MILLI);
        events.iter().filter(|event| event.payload == flow).filter(arrived).map(|event| event.size.get()).sum()
    };
    // 12 Mbit/s carry 1,500,000 bytes in this second. The flows differ by some turns.
    assert!(of(1).abs_diff(of(2)) <= 4 * 1514, "{} {}", of(1), of(2));
    assert!(of(1) + of(2) > 1_490_000);
}

/// A full queue drops half of the longest flow from its head, at most 64 packets. A flow with few packets loses none.
#[test]
fn overflow_drops_from_the_longest_queue() {
    let drops = |fat: u64, limit: u64| -> Vec<(Payload, u64)> {
        let offered: Vec<(u64, Payload, u64)> = (0..3).map(|number| (number, 1, 1500)).chain((0..fat).map(|number| (10 + number, 2, 1500))).collect();
        over_flows(twelve_megabit(limit, Discipline::FqCoDel(FqCoDel::default())), &offered)
            .iter()
            .filter(|event| event.fate == Fate::Dropped(DropCause::QueueFull))
            .map(|event| (event.payload, event.sequence))
            .collect()
    };
    // The first packet is on the line, two of flow 1 wait, and the 49th of flow 2 is one too many: 24.5 packets are half.
    let half: Vec<(Payload, u64)> = (3..28).map(|sequence| (2, sequence)).collect();
    assert_eq!(drops(49, 50), half);
    let most: Vec<(Payload, u64)> = (3..67).map(|sequence| (2, sequence)).collect();
    assert_eq!(drops(499, 500), most);
}

/// PIE by the text of RFC 8033, with a timer that goes off every 15 ms, over packets that wait in a list.
mod pie {
    use cohaptic_tests_common::properties;
    use cohaptic_wan::random::{Purpose, Stream};
    use cohaptic_wan::{PacketInfo, Pie};
    use proptest::prelude::*;

    use super::*;

    #[derive(Default)]
    struct Model {
        drop_prob: f64,
        current_qdelay: f64,
        qdelay_old: f64,
        burst_allowance: f64,
        accu_prob: f64,
    }

    impl Model {
        fn on_timer(&mut self, pie: &Pie) {
            let reference = pie.target.as_secs_f64();
            let mut p = 0.125 * (self.current_qdelay - reference) + 1.25 * (self.current_qdelay - self.qdelay_old);
            if self.drop_prob < 0.000_001 {
                p /= 2048.0;
            } else if self.drop_prob < 0.000_01 {
                p /= 512.0;
            } else if self.drop_prob < 0.0001 {
                p /= 128.0;
            } else if self.drop_prob < 0.001 {
                p /= 32.0;
            } else if self.drop_prob < 0.01 {
                p /= 8.0;
            } else if self.drop_prob < 0.1 {
                p /= 2.0;
            } else if p > 0.02 {
                p = 0.02;
            }
            self.drop_prob += p;
            if self.current_qdelay == 0.0 && self.qdelay_old == 0.0 {
                self.drop_prob *= 0.98;
            }
            self.drop_prob = self.drop_prob.clamp(0.0, 1.0);
            self.burst_allowance = (self.burst_allowance - 0.015).max(0.0);
            // Sums of 15 ms in binary fractions leave a rest that is no time.
            if self.burst_allowance < 1e-9 {
                self.burst_allowance = 0.0;
            }
            if self.drop_prob == 0.0 && self.current_qdelay < reference / 2.0 && self.qdelay_old < reference / 2.0 {
                self.burst_allowance = pie.burst.as_secs_f64();
            }
            self.qdelay_old = self.current_qdelay;
        }

        fn drop_early(&mut self, pie: &Pie, queued: u64, unit: f64) -> bool {
            if self.burst_allowance > 0.0 || (self.drop_prob < 0.2 && self.qdelay_old < pie.target.as_secs_f64() / 2.0) || queued <= 2 * pie.mtu.get()
            {
                return false;
            }
            self.accu_prob = if self.drop_prob == 0.0 { 0.0 } else { self.accu_prob + self.drop_prob };
            if self.accu_prob < 0.85 {
                return false;
            }
            let hit = self.accu_prob >= 8.5 || unit < self.drop_prob;
            if hit {
                self.accu_prob = 0.0;
            }
            hit
        }
    }

    type Offered = (u64, u64, bool);

    /// The fate of each packet: the instant of its arrival and `true` if marked, or the cause of its drop.
    type Fates = Vec<Result<(u64, bool), DropCause>>;

    /// A byte takes a microsecond.
    fn by_model(pie: &Pie, limit: u64, offered: &[Offered]) -> Fates {
        let mut fates: Fates = vec![Err(DropCause::EndOfLog); offered.len()];
        let mut model = Model { burst_allowance: pie.burst.as_secs_f64(), ..Model::default() };
        let (mut queue, mut marked, mut free) = (std::collections::VecDeque::new(), vec![false; offered.len()], None);
        let mut timer = 15 * MILLI;
        let mut number = 0;
        loop {
            let arrival = offered.get(number).map_or(u64::MAX, |(at, ..)| *at);
            let departure = free.unwrap_or(u64::MAX);
            let now = timer.min(arrival).min(departure);
            if arrival == u64::MAX && departure == u64::MAX {
                return fates;
            }
            if timer == now {
                model.on_timer(pie);
                timer += 15 * MILLI;
                continue;
            }
            if departure == now {
                free = None;
            } else {
                let (_, _, ecn_capable) = offered[number];
                let queued: u64 = queue.iter().map(|place: &usize| offered[*place].1).sum();
                let unit = Stream::new(67, b"a->b").packet(number as u64).draws(Purpose::Queue).next_unit();
                if free.is_some() && queue.len() as u64 >= limit {
                    fates[number] = Err(DropCause::QueueFull);
                    model.accu_prob = 0.0;
                } else {
                    let hit = free.is_some() && model.drop_early(pie, queued, unit);
                    marked[number] = hit && pie.ecn && ecn_capable && model.drop_prob <= 0.1;
                    if hit && !marked[number] {
                        fates[number] = Err(DropCause::Pie);
                    } else {
                        queue.push_back(number);
                    }
                }
                number += 1;
            }
            if free.is_none()
                && let Some(place) = queue.pop_front()
            {
                model.current_qdelay = if queue.is_empty() { 0.0 } else { Duration::from_nanos(now - offered[place].0).as_secs_f64() };
                free = Some(now + offered[place].1 * 1_000);
                fates[place] = Ok((now + offered[place].1 * 1_000, marked[place]));
            }
        }
    }

    fn by_link(pie: &Pie, limit: u64, offered: &[Offered]) -> Fates {
        let limit = Some(QueueLimit::Packets(limit));
        let bottleneck = Some(Bottleneck { limit, discipline: Discipline::Pie(*pie), ..Bottleneck::at_rate(rate(8_000_000)) });
        let mut link = Link::new(67, &LinkName::between("a", "b"), LinkConfig { bottleneck, ..LinkConfig::default() });
        for (at, size, ecn_capable) in offered {
            let info = PacketInfo { size: Bytes::new(*size), ecn: if *ecn_capable { Ecn::Capable0 } else { Ecn::NotCapable } };
            link.handle_packet(Instant::from_nanos(*at), info, 0_u64).unwrap();
        }
        link.handle_timeout(Instant::MAX).unwrap();
        let mut fates: Fates = vec![Err(DropCause::EndOfLog); offered.len()];
        while let Some(event) = link.poll_event() {
            fates[usize::try_from(event.sequence).unwrap()] = match event.fate {
                Fate::Delivered(at) => Ok((at.as_nanos(), event.marked)),
                Fate::Dropped(cause) => Err(cause),
                Fate::Duplicated => unreachable!("nothing copies"),
            };
        }
        fates
    }

    /// Bursts and pauses, from an idle line to twice what it carries.
    fn offered() -> BoxedStrategy<Vec<Offered>> {
        let phase = (1..600usize, 300_000..2_500_000_u64, 0..400_000_000_u64);
        (prop::collection::vec(phase, 1..6), any::<u64>())
            .prop_map(|(phases, seed)| {
                let mut state = seed;
                let mut random = |below: u64| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (state >> 33) % below
                };
                let mut at = 0;
                let mut offered = Vec::new();
                for (packets, gap, pause) in phases {
                    for _ in 0..packets {
                        at += random(gap);
                        offered.push((at, 200 + random(1_300), random(2) == 0));
                    }
                    at += pause;
                }
                offered
            })
            .boxed()
    }

    properties! {
        #![proptest_config(crate::random_links::cases(96))]

        #[test]
        fn by_the_text_of_the_rfc(
            offered in offered(),
            target in 1..40_u64,
            burst in prop_oneof![Just(0_u64), Just(150), 0..100_u64],
            limit in prop_oneof![Just(1_000_000_u64), 1..40_u64],
            ecn in any::<bool>(),
        ) {
            let pie = Pie { target: Duration::from_millis(target), burst: Duration::from_millis(burst), mtu: Bytes::new(1500), ecn };
            prop_assert_eq!(by_link(&pie, limit, &offered), by_model(&pie, limit, &offered));
        }
    }

    /// Under a constant overload of a quarter PIE settles where it drops a fifth, with a delay near its target.
    #[test]
    fn under_constant_overload_the_delay_settles_at_the_target() {
        // 1000 bytes take a millisecond, and come every 0.8 ms.
        let offered: Vec<Offered> = (0..100_000_u64).map(|number| (number * 800_000, 1_000, false)).collect();
        let fates = by_link(&Pie::default(), 1_000_000, &offered);
        let late: Vec<_> = fates.iter().enumerate().skip(50_000).collect();
        let dropped = late.iter().filter(|(_, fate)| **fate == Err(DropCause::Pie)).count() as f64 / late.len() as f64;
        let delays: Vec<f64> = late.iter().filter_map(|(place, fate)| fate.ok().map(|(at, _)| (at - offered[*place].0) as f64 / 1e6)).collect();
        let mean = delays.iter().sum::<f64>() / delays.len() as f64;
        // Traffic beyond the rate is dropped, and a packet takes a millisecond on the line after its wait.
        assert!((dropped - 0.2).abs() < 0.001, "{dropped}");
        assert!((mean - 16.0).abs() < 1.0, "{mean}");
    }
}

/// On an uplink shared by two receivers, each pair of sender and receiver is a flow; behind a network that knows better, each payload.
#[test]
fn the_flows_of_a_network_are_its_pairs_or_what_it_is_told() {
    let wait = |flows: Option<fn(Path, &Payload) -> u32>, to: u16| {
        let nodes = ["a", "b", "c"].map(str::to_owned).to_vec();
        let network = Network::new(NetworkConfig { seed: 1, nodes, general: false }, |_, _| LinkConfig::default());
        let line = twelve_megabit(100, Discipline::FqCoDel(FqCoDel::default()));
        let mut network = network.with_access_line(AccessLine::Uplink(NodeId(0)), line).unwrap();
        if let Some(flows) = flows {
            network = network.with_flows(flows);
        }
        for payload in 0..20 {
            network.handle_packet(Instant::ZERO, NodeId(0), NodeId(1), Bytes::new(1500), payload / 20).unwrap();
        }
        network.handle_packet(Instant::ZERO, NodeId(0), NodeId(to), Bytes::new(1500), 7).unwrap();
        network.handle_timeout(Instant::MAX).unwrap();
        let lone = std::iter::from_fn(|| network.poll_event()).find(|event| event.payload == 7).unwrap();
        lone.at.as_nanos() / MILLI
    };
    // A quantum of 1514 bytes lets the first flow send two packets. The lone packet is the third on the line or, in the same flow as the others, the last.
    assert_eq!([wait(None, 2), wait(None, 1)], [3, 21]);
    assert_eq!([wait(Some(|_, payload| u32::try_from(*payload).unwrap()), 1), wait(Some(|_, _| 3), 2)], [3, 21]);
}
