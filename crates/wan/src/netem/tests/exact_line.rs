//! A line of words that uses nearly every option, over a link: the measured figures are those of the words.

use core::time::Duration;

use cohaptic_units::{Bytes, Instant};

use crate::fates::fate::{DropCause, Fate};
use crate::fates::record::PacketEvent;
use crate::line::name::LinkName;
use crate::link::Link;
use crate::netem::Netem;
use crate::stages::config::LinkConfig;

fn config(words: &str) -> LinkConfig {
    Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap()
}

/// Returns the fates of packets that come every millisecond, in the order of packets and copies.
fn run(words: &str, packets: u64) -> Vec<PacketEvent<u64>> {
    let mut link = Link::new(3, &LinkName::between("a", "b"), config(words));
    let mut events = Vec::new();
    for number in 0..packets {
        link.handle_packet(Instant::from_nanos(number * 1_000_000), Bytes::new(100), 0).unwrap();
        events.extend(core::iter::from_fn(|| link.poll_event()));
    }
    link.handle_timeout(Instant::MAX).unwrap();
    events.extend(core::iter::from_fn(|| link.poll_event()));
    events.sort_by_key(|event| (event.sequence, event.copy, event.fate.is_end()));
    events
}

fn near(what: &str, found: f64, expected: f64, error: f64) {
    assert!((found - expected).abs() < 4.5 * error, "{what}: {found}, expected {expected} ± {error}");
}

/// The kernel would lose nothing here (`loss 2% 25%`), and its delays would not be correlated. Tolerances are 4.5 standard errors, which chance exceeds once
/// in 150 000 measurements.
#[test]
fn every_figure_of_a_line_is_the_one_that_was_said() {
    let words = "delay 40ms 4ms 50% distribution normal loss 2% 25% duplicate 1% corrupt 0.5% reorder 5% gap 3";
    let offered = 200_000;
    let events = run(words, offered);
    let n = offered as f64;
    let of = |wanted: Fate| events.iter().filter(|event| event.fate == wanted).count() as f64;

    let copies = of(Fate::Duplicated);
    near("duplicate", copies / n, 0.01, (0.01_f64 * 0.99 / n).sqrt());
    // Packets and copies are lost with equal probability. A DAR(1) sequence has (1 + ρ)/(1 − ρ) times the variance of an independent one.
    let lost = of(Fate::Dropped(DropCause::Loss));
    near("loss", lost / (n + copies), 0.02, (0.02_f64 * 0.98 / n * (1.25 / 0.75)).sqrt());
    let passed = n + copies - lost;
    near("corrupt", of(Fate::Dropped(DropCause::Checksum)) / passed, 0.005, (0.005_f64 * 0.995 / passed).sqrt());

    // Damaged packets are delayed like all others, and are discarded on arrival.
    let travelled = events.iter().filter(|event| event.fate.is_end() && event.fate != Fate::Dropped(DropCause::Loss));
    let delays: Vec<f64> = travelled.map(|event| (event.at - event.offered).as_secs_f64() * 1e3).collect();
    assert_eq!(delays.len() as f64, passed);
    // A renewal process: 2 packets must wait, then a geometric number of 5 % follows. The mean distance is 22 packets, and the variance 0.95/0.05² = 380.
    let jumped = delays.iter().filter(|delay| **delay == 0.0).count() as f64;
    near("reorder", jumped / passed, 1.0 / 22.0, (380.0 / 22.0_f64.powi(3) / passed).sqrt());

    let delays: Vec<f64> = delays.into_iter().filter(|delay| *delay > 0.0).collect();
    let n = delays.len() as f64;
    let mean = delays.iter().sum::<f64>() / n;
    let variance = delays.iter().map(|delay| (delay - mean).powi(2)).sum::<f64>() / n;
    let covariance = delays.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>() / n;
    // For AR(1) with ρ = ½, the variance of the mean grows by (1 + ρ)/(1 − ρ), that of the variance by (1 + ρ²)/(1 − ρ²), and ρ has the variance (1 − ρ²)/n.
    near("delay", mean, 40.0, 4.0 * (3.0 / n).sqrt());
    near("jitter", variance.sqrt(), 4.0, 4.0 * (0.5 * (1.25 / 0.75) / n).sqrt());
    near("correlation", covariance / variance, 0.5, (0.75 / n).sqrt());
}

/// Delays are uniform over 90 to 110 ms. The mean is known to 5.77/√n ms, no delay lies outside, and the sample comes within 1 % of both ends.
#[test]
fn jitter_without_distribution_is_a_half_width() {
    let delays: Vec<f64> = run("delay 100ms 10ms", 20_000).iter().map(|event| (event.at - event.offered).as_secs_f64() * 1e3).collect();
    let (least, most) = delays.iter().fold((f64::MAX, f64::MIN), |(least, most), delay| (least.min(*delay), most.max(*delay)));
    assert!((90.0..90.1).contains(&least) && (109.9..=110.0).contains(&most), "{least} {most}");
    near("mean", delays.iter().sum::<f64>() / 20_000.0, 100.0, 5.7735 / 20_000_f64.sqrt());
}

/// A packet of 100 bytes with 25 bytes of overhead takes 1 ms at 1 Mbit/s, after the delay. Packets leave in order, at least 1 ms apart.
#[test]
fn the_rate_stands_behind_the_delay() {
    let events = run("delay 30ms 10ms rate 1mbit 25", 2000);
    let mut departures: Vec<Instant> = events.iter().map(|event| event.at).collect();
    departures.sort_unstable();
    assert!(departures.windows(2).all(|pair| pair[1] - pair[0] >= Duration::from_millis(1)));
    assert!(events.iter().all(|event| event.at - event.offered >= Duration::from_millis(21)));
}

#[test]
fn a_limit_counts_the_packets_under_way() {
    let events = run("delay 100ms limit 50", 1000);
    let dropped = events.iter().filter(|event| event.fate == Fate::Dropped(DropCause::Limit)).count();
    // In the first 50 ms, 50 packets enter, which leave from 100 ms on. The link is full half of the time.
    assert_eq!(dropped, 500);
}
