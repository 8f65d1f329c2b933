//! Queues of a link, against queueing theory and against the papers on active queue management.

use std::time::Duration;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Bottleneck, CoDel, Discipline, DropCause, Fate, Link, LinkConfig, LinkName};
use rand_distr::{Distribution as _, Exp1};

use crate::laws::NORMAL_9995;
use crate::random_links::rate;

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
        link.handle_packet(Instant::from_nanos(now), Bytes::new(size), ()).unwrap();
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
    const MILLI: u64 = 1_000_000;
    let discipline = Discipline::CoDel(CoDel { mtu: Bytes::new(100), ..CoDel::default() });
    let bottleneck = Some(Bottleneck { discipline, ..Bottleneck::at_rate(rate(800_000)) });
    let mut link = Link::new(64, &LinkName::between("a", "b"), LinkConfig { bottleneck, ..LinkConfig::default() });
    // 100 bytes take a millisecond; two are offered in one.
    (0..8_000).for_each(|number| link.handle_packet(Instant::from_nanos(number * MILLI / 2), Bytes::new(100), ()).unwrap());
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
    let info = cohaptic_wan::PacketInfo { size: Bytes::new(100), ecn_capable: true };
    (0..4_000).for_each(|number| link.handle_packet(Instant::from_nanos(number * 500_000), info, ()).unwrap());
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
