//! An hour at 1 kHz and a day at coarse ticks: time does not drift, whatever the clocks.
//!
//! A tick, a departure and an arrival are whole nanoseconds that follow from their number by a formula. So the tolerance is none. Only a hand that is a sine is a
//! real function of time; how far its phase may be off follows from the roundings in 2π·f·t. By day an hour of ticks is a quarter of one.

use std::time::Duration;

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_peer::Signal;
use cohaptic_tests::{Draft, DraftPeer};
use cohaptic_tests_common::quarter_by_day;
use cohaptic_units::{Hertz, Instant};
use cohaptic_wan::Fate;

use crate::hard::ROUNDING;
use crate::hard::watch::{OnPacket, OnTick};

/// Seconds of an hour, and by day of a quarter of an hour.
fn hour() -> u64 {
    quarter_by_day(3600)
}

/// Peers that tick every `tick` µs by clocks of that offset \[ns\] and drift [parts per 10⁹], for `seconds`, with a sample every 1000 ticks.
fn scene(tick: u64, seconds: u64, clocks: &[(u64, i32)]) -> Draft {
    let mut draft = Draft { duration: 1000 * seconds, update: 1000 * tick, link: "delay = \"24ms\"".to_owned(), ..Draft::calm(clocks.len()) };
    // Copies that move by themselves: this is about time.
    (draft.gains.stiffness, draft.gains.damping) = (0.0, 0.0);
    for (peer, (offset, drift)) in draft.peers.iter_mut().zip(clocks) {
        *peer = DraftPeer { tick, offset: *offset, drift: *drift, ..peer.clone() };
    }
    draft
}

/// Runs the scene and asserts that tick k of each peer is at offset + ⌊k·Tc/(1 + δ)⌋ and that all ticks before the end are there.
///
/// With δ = d/10⁹ that floor is the whole number t with t·(10⁹ + d) ≤ k·Tc·10⁹ < (t + 1)·(10⁹ + d): two products and no division, unlike what is tested.
fn ticks_are_on_time(draft: &Draft) {
    let end = u128::from(draft.duration) * 1_000_000;
    let floor = |peer: &DraftPeer, k: u128, t: u128| {
        let (speed, local) = ((1_000_000_000 + i128::from(peer.drift)).unsigned_abs(), k * u128::from(peer.tick) * 1000 * 1_000_000_000);
        t * speed <= local && local < (t + 1) * speed
    };
    let mut counts = vec![(0_u128, 0_u128); draft.peers.len()];
    let summary = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &cohaptic_harness::TickRow<'_>| {
        let (peer, (k, last)) = (&draft.peers[row.peer], &mut counts[row.peer]);
        let t = u128::from(row.at.as_nanos() - peer.offset);
        assert!(floor(peer, *k, t), "tick {k} of peer {} is at {}", row.peer, row.at);
        (*k, *last) = (*k + 1, t);
    }));
    let Ok(summary) = summary;
    for (peer, (k, last)) in draft.peers.iter().zip(&counts) {
        // Tick k, the first that was not there, is not before the end.
        let (speed, local) = ((1_000_000_000 + i128::from(peer.drift)).unsigned_abs(), k * u128::from(peer.tick) * 1000 * 1_000_000_000);
        assert!(local / speed + u128::from(peer.offset) >= end && *last < end, "{k} ticks of {}", peer.name);
    }
    assert_eq!(u128::from(summary.ticks), counts.iter().map(|(k, _)| *k).max().unwrap());
    assert_eq!(summary.duration.as_nanos(), end);
}

#[test]
fn an_hour_of_ticks_at_a_kilohertz_is_on_the_nanosecond() {
    ticks_are_on_time(&scene(1000, hour(), &[(0, 0), (300_000, 20_000), (999_999, -123_457)]));
}

#[test]
fn an_hour_of_clocks_ten_percent_off_is_on_the_nanosecond() {
    ticks_are_on_time(&scene(1000, hour(), &[(1, 100_000_000), (0, -100_000_000)]));
}

#[test]
fn a_day_at_coarse_ticks_is_on_the_nanosecond() {
    ticks_are_on_time(&scene(1_000_000, 86_400, &[(0, 0), (0, 0)]));
    ticks_are_on_time(&scene(100_000, 86_400, &[(0, 0), (7, 1), (12_345_678, -99_999_999)]));
}

/// An hour without an event queue: tick k at k ms, packet n of each link sent at 8·n ms and there 24 ms later.
#[test]
fn an_hour_in_lockstep_sends_and_arrives_on_the_nanosecond() {
    let draft = Draft { update: 8000, ..scene(1000, hour(), &[(0, 0); 3]) };
    let mut arrived = [0_u64; 9];
    let mut ticks = [0_u64; 3];
    let summary = Simulation::new(&draft.scene(), Model::Least).run(&mut (
        OnTick(|row: &cohaptic_harness::TickRow<'_>| {
            assert_eq!(row.at.as_nanos(), ticks[row.peer] * 1_000_000);
            ticks[row.peer] += 1;
        }),
        OnPacket(|row: &cohaptic_harness::PacketRow| {
            let count = &mut arrived[3 * row.path.from.index() + row.path.to.index()];
            assert_eq!((row.sequence, row.offered.as_nanos()), (*count, *count * 8_000_000));
            assert_eq!(row.fate, Fate::Delivered(row.offered + Duration::from_millis(24)));
            *count += 1;
        }),
    ));
    let Ok(summary) = summary;
    let (all, offered) = (1000 * hour(), 125 * hour());
    assert_eq!((ticks, summary.ticks), ([all; 3], all));
    // Sent at 0, 8, … ms, the last one 8 ms before the end; the last that is there by the end left 24 ms before it.
    for link in &summary.links {
        assert_eq!((link.stats.offered(), link.stats.delivered(), link.stats.in_flight()), (offered, offered - 2, 2));
        assert_eq!((arrived[3 * link.from + link.to], link.stats.mean_delay()), (offered - 2, Some(Duration::from_millis(24))));
    }
}

/// The same hour by an event queue, with nobody looking: the loop counts as it does in lockstep.
#[test]
fn an_hour_by_either_model_ends_in_the_same_state() {
    let mut draft = scene(1000, hour(), &[(0, 0), (0, 0)]);
    draft.velocity = [0.01, 0.0, 0.0];
    let scene = draft.scene();
    let [least, general] = [Model::Least, Model::General].map(|model| {
        let Ok(summary) = Simulation::new(&scene, model).run(&mut NoObserver);
        summary
    });
    assert_eq!(least, general);
}

/// sin(2π·f·t) with f = 5/4 Hz at t = k ms: k·5/4000 turns, whose fraction (5k mod 4000)/4000 is exact.
///
/// Bound: 2π is rounded once as a constant, 2π·f, t and their product once each, so the phase φ is off by at most 4u·φ·(1 + 4u), and a sine by no more than its
/// argument. Both sines and the two products on the way to the expected value add less than 6u.
#[test]
fn the_phase_of_a_hand_does_not_drift_beyond_its_rounding() {
    let hand = Signal::Sine { amplitude: [1.0, 0.0, 0.0], frequency: Hertz(1.25), phase: 0.0 };
    let turn = std::f64::consts::TAU;
    // All milliseconds of a minute, and of the minutes before an hour and a day have passed.
    for k in [0..60_000_u32, 3_540_000..3_600_000, 86_340_000..86_400_000].into_iter().flatten() {
        let [value] = hand.value::<1>(Instant::from_nanos(u64::from(k) * 1_000_000));
        let expected = libm::sin(turn * (f64::from(5 * (k % 800)) / 4000.0));
        let phase = turn * 1.25 * f64::from(k) * 1e-3;
        let bound = ROUNDING * (4.1 * phase + 6.0);
        assert!((value - expected).abs() <= bound, "{k} ms: {value} is not within {bound:e} of {expected}");
    }
}
