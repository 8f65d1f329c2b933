//! Tests of the queue: limit, rate, reordering, and slots.

use crate::netem::kernel::Qdisc;
use crate::netem::kernel::tests::{Driver, Run, SIZE, at, qdisc, run};

const MILLISECOND: u64 = 1_000_000;

/// Returns the share of packets that arrive after a later packet (RFC 4737).
fn reordered_share(run: &Run) -> f64 {
    let mut latest = 0;
    let mut late = 0_u32;
    for (_, packet) in &run.delivered {
        late += u32::from(packet.item < latest);
        latest = latest.max(packet.item);
    }
    f64::from(late) / run.delivered.len() as f64
}

/// Published: the limit of 1000 packets includes packets in propagation, so that a delay of 100 ms lets through 10 000 packets/s at most.
#[test]
fn the_default_limit_caps_what_a_delay_lets_through() {
    let run = run("delay 100ms", 1, 40_000, 50_000);
    // Packets are offered for 2 s at 20 000 packets/s, and 1000 packets pass in each 100 ms.
    assert_eq!(run.delivered.len(), 20_000);
    assert_eq!(run.over_limit.len(), 20_000);
    assert_eq!(self::run("delay 100ms limit 2001", 1, 40_000, 50_000).over_limit.len(), 0);
    assert_eq!(self::run("limit 0", 1, 10, 50_000).over_limit.len(), 10);
}

/// Published: the RFC 4737 reordered share of independent jitter, at 1 kHz and at 125 Hz. 10⁵ packets have a standard error of some 0.0015, since neighbours
/// are not independent. The tolerance is half a digit and four standard errors.
#[test]
fn independent_jitter_reorders_absurdly() {
    let published = [
        ("1ms", MILLISECOND, 0.125, 0.007),
        ("2ms", MILLISECOND, 0.34, 0.011),
        ("5ms", MILLISECOND, 0.59, 0.011),
        ("10ms", MILLISECOND, 0.71, 0.011),
        ("20ms", MILLISECOND, 0.80, 0.011),
        ("5ms", 8 * MILLISECOND, 0.020, 0.006),
        ("10ms", 8 * MILLISECOND, 0.19, 0.011),
        ("20ms", 8 * MILLISECOND, 0.41, 0.011),
        ("1ms 0% distribution normal", MILLISECOND, 0.275, 0.007),
        ("10ms 0% distribution normal", MILLISECOND, 0.83, 0.011),
        ("10ms 0% distribution normal", 8 * MILLISECOND, 0.35, 0.011),
    ];
    for (jitter, spacing, share, tolerance) in published {
        let actual = reordered_share(&run(&format!("delay 200ms {jitter}"), 1, 100_000, spacing));
        assert!((actual - share).abs() < tolerance, "{jitter} at {spacing} ns: {actual}");
    }
}

#[test]
fn equal_times_keep_the_order_of_arrival() {
    let mut driver = Driver::new(qdisc("delay 1ms", 1));
    for number in 0..10 {
        driver.offer(at(0), number, SIZE, false);
    }
    let order: Vec<u64> = driver.finish().delivered.iter().map(|(_, packet)| packet.item).collect();
    assert_eq!(order, (0..10).collect::<Vec<_>>());
}

/// The departure is max(last departure, arrival + delay) + transmission time, with the delays that the same seed gives without a rate.
#[test]
fn the_line_stands_behind_the_delay_and_undoes_jitter() {
    let count = 10_000;
    let spacing = 3 * MILLISECOND / 2;
    let mut free = vec![0; usize::try_from(count).unwrap()];
    for (instant, packet) in run("delay 30ms 10ms seed 4", 1, count, spacing).delivered {
        free[usize::try_from(packet.item).unwrap()] = instant.as_nanos();
    }
    // A packet of 1000 bytes takes a millisecond at 8 Mbit/s.
    let lined = run("delay 30ms 10ms rate 8mbit seed 4", 1, count, spacing);
    assert_eq!(reordered_share(&lined), 0.0);
    let mut last = 0;
    for (instant, packet) in lined.delivered {
        last = free[usize::try_from(packet.item).unwrap()].max(last) + MILLISECOND;
        assert_eq!(instant.as_nanos(), last);
    }
}

/// The kernel compares with the latest time to leave only while a packet is held. A transmitter that has just become free serves the next packet at once.
#[test]
fn a_rate_limits_throughput_to_itself() {
    let run = run("rate 8mbit limit 100000", 1, 1000, 1000);
    let last = run.delivered.last().unwrap().0.as_nanos();
    assert_eq!(last, 1000 + 1000 * MILLISECOND);
}

#[test]
fn every_gap_th_packet_is_reordered_when_all_are_to_be() {
    let run = run("delay 10ms reorder 100% gap 5", 1, 1000, MILLISECOND);
    let at_once: Vec<u64> = run.delivered.iter().filter(|(_, packet)| packet.reordered).map(|(_, packet)| packet.item).collect();
    assert_eq!(at_once, (0..200).map(|k| 4 + 5 * k).collect::<Vec<_>>());
    for (instant, packet) in &run.delivered {
        let expected = (packet.item + 1) * MILLISECOND + if packet.reordered { 0 } else { 10 * MILLISECOND };
        assert_eq!(instant.as_nanos(), expected);
    }
}

/// The mean distance of reordered packets is gap − 1 + 1/p: gap − 1 packets are delayed, and each further packet with probability 1 − p.
#[test]
fn a_gap_makes_reordering_rarer_than_said() {
    let run = run("delay 10ms reorder 25% gap 5", 1, 100_000, MILLISECOND);
    let share = run.delivered.iter().filter(|(_, packet)| packet.reordered).count() as f64 / 1e5;
    // Renewals with mean 8 and deviation √12 have a standard error of √12/8^1.5/√10⁵ = 0.0005. The tolerance is five of these.
    assert!((share - 1.0 / 8.0).abs() < 0.0025, "{share}");
}

/// A copy that is about to leave counts as the last packet. The transmission does not begin before the copy, although the delay may be below zero.
#[test]
fn a_reordered_copy_holds_the_line() {
    let now = at(1000 * MILLISECOND);
    let mut seen = 0;
    for seed in 0..1000 {
        let mut qdisc: Qdisc<u64> = qdisc("delay 1us 100us duplicate 100% reorder 50% rate 8mbit", seed);
        qdisc.enqueue(now, SIZE, false, 0, &mut |_| {});
        let reordered = !qdisc.reordered.is_empty();
        let copy = qdisc.dequeue(now).is_some_and(|packet| reordered && packet.copy == 1);
        if copy && qdisc.len() == 1 {
            seen += 1;
            assert!(qdisc.next_at() >= now.checked_add(core::time::Duration::from_millis(1)));
        }
    }
    // A quarter of 1000, with five standard errors of 13.7.
    assert!((181..=319).contains(&seen), "{seen}");
}

#[test]
fn reordered_packets_pass_rate_and_slots() {
    let mut driver = Driver::new(qdisc("delay 10ms reorder 100% gap 2 rate 8bit slot 1s", 1));
    driver.offer(at(MILLISECOND), 0, SIZE, false);
    driver.offer(at(2 * MILLISECOND), 1, SIZE, false);
    let (instant, packet) = driver.run.delivered.first().unwrap();
    assert_eq!((instant.as_nanos(), packet.item, packet.reordered), (2 * MILLISECOND, 1, true));
}

/// The typical words in the kernel commit that introduced slots. Slots open at least 800 µs apart, and each lets out 42 packets at most.
#[test]
fn slots_let_packets_out_in_bunches() {
    let run = run("slot 800us 10ms bytes 64k packets 42 limit 100000", 1, 20_000, 10_000);
    let mut bunches: Vec<(u64, u32)> = Vec::new();
    for (instant, _) in &run.delivered {
        match bunches.last_mut() {
            Some((time, count)) if *time == instant.as_nanos() => *count += 1,
            _ => bunches.push((instant.as_nanos(), 1)),
        }
    }
    assert!(bunches.iter().all(|(_, count)| *count <= 42));
    // Once the queue is longer than a bunch, every bunch is full and the gaps are uniform: mean 5.4 ms, standard error 2.66/√n.
    let full: Vec<u64> = bunches.iter().filter(|(_, count)| *count == 42).map(|(time, _)| *time).collect();
    assert!(full.len() > 400);
    let gaps: Vec<f64> = full.windows(2).map(|pair| (pair[1] - pair[0]) as f64 / 1e6).collect();
    assert!(gaps.iter().all(|gap| (0.8..=10.0).contains(gap)));
    let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
    assert!((mean - 5.4).abs() < 5.0 * 2.66 / (gaps.len() as f64).sqrt(), "{mean}");
}

/// Published: the width of a slot times 32 random bits overflows 64 bits for widths above 2.1 s, and half of the slots then lie in the past.
#[test]
fn a_slot_range_wider_than_two_seconds_overflows() {
    let delays = |words: &str| -> Vec<u64> {
        (0..1000)
            .map(|seed| {
                let mut qdisc: Qdisc<u64> = qdisc(words, seed);
                let now = at(100_000 * MILLISECOND);
                qdisc.enqueue(now, SIZE, false, 0, &mut |_| {});
                if qdisc.dequeue(now).is_some() { 0 } else { qdisc.next_at().unwrap().as_nanos() - now.as_nanos() }
            })
            .collect()
    };
    let within = delays("slot 0 2s");
    assert!(within.iter().all(|delay| *delay < 2000 * MILLISECOND));
    assert!(within.iter().filter(|delay| **delay == 0).count() < 5);
    // For a slot of u·4 s the product is negative from u = 2³² · 2.147/4 on, in 1 − 0.537 of the cases. The tolerance is five standard errors of 0.016.
    let beyond = delays("slot 0 4s");
    let past = beyond.iter().filter(|delay| **delay == 0).count() as f64 / 1000.0;
    assert!((past - 0.463).abs() < 0.08, "{past}");
    assert!(beyond.iter().all(|delay| *delay < 2148 * MILLISECOND));
}

#[test]
fn slots_with_a_distribution_are_drawn_from_it() {
    let words = "slot distribution normal 5ms 1ms packets 1 limit 100000";
    let run = run(words, 1, 5000, 100_000);
    let times: Vec<f64> = run.delivered.iter().map(|(instant, _)| instant.as_nanos() as f64 / 1e6).collect();
    let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (mean, deviation) = (super::mean(&gaps), super::deviation(&gaps));
    // Standard errors are 0.014 and 0.01. The tolerances are five of these.
    assert!((mean - 5.0).abs() < 0.07 && (deviation - 1.0).abs() < 0.05, "{mean} ± {deviation}");
}

#[test]
fn slots_of_no_time_are_no_slots() {
    assert_eq!(run("slot 0 0 packets 1", 1, 100, 1000).delivered.len(), 100);
    let run = run("slot 0 0 packets 1 delay 1ms", 1, 100, 1000);
    assert!(run.delivered.iter().all(|(instant, packet)| instant.as_nanos() == (packet.item + 1) * 1000 + MILLISECOND));
}

/// A jitter above the delay gives times in the past: such a packet leaves at once, before packets that wait.
#[test]
fn a_delay_below_zero_leaves_at_once() {
    let run = run("delay 1ms 10ms", 1, 10_000, 100 * MILLISECOND);
    let at_once = run.delivered.iter().filter(|(instant, packet)| instant.as_nanos() == (packet.item + 1) * 100 * MILLISECOND).count();
    // The time is uniform on −9…11 ms: 45 % are below zero. The tolerance is five standard errors of 50.
    assert!((4250..=4750).contains(&at_once), "{at_once}");
    let mut first: Qdisc<u64> = qdisc("delay 1ms 10ms", 3);
    first.enqueue(at(0), SIZE, false, 0, &mut |_| {});
    assert!(first.next_at().is_some(), "a time before the beginning is the beginning");
}
