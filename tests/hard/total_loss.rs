//! 100 % loss, then healing: what each peer holds meanwhile, what it holds after, and that every sample is counted.
//!
//! With two peers the mean is the one other, without rounding: so what a copy is pulled to is, bit for bit, a state that the other had, and which one follows
//! from the times. A sample sent at s is in force from the first tick at or after s + d on, if it was not sent while everything is lost.

use cohaptic_harness::Model;
use cohaptic_tests::{Body, Draft, Log, run};
use cohaptic_wan::{DropCause, Fate};

const DELAY: u64 = 5;
/// All is lost that is sent from then on \[ms\].
const LOST: u64 = 100;
/// All gets through again that is sent from then on \[ms\].
const HEALED: u64 = 400;

/// Two copies that swing about each other, with a sample every 2 ms; links that lose all from `LOST` to `HEALED`.
fn scene(loss: &str, healing: &str) -> Draft {
    let mut draft = Draft { duration: 1000, update: 2000, damping: 0.2, ..Draft::calm(2) };
    draft.link = format!("delay = \"{DELAY}ms\"");
    draft.gains.stiffness = 100.0;
    for (peer, (x, v)) in draft.peers.iter_mut().zip([(0.03, -0.2), (-0.01, 0.7)]) {
        (peer.position, peer.velocity) = (Some([x, 0.0, 0.0]), Some([v, 0.0, 0.0]));
    }
    let change = |at: u64, keys: &str| format!("at = \"{at}ms\"\nlink = \"all\"\nset = {{ {keys} }}");
    draft.timeline = vec![change(LOST, loss), change(HEALED, healing)];
    draft
}

/// When the sample was sent that is in force at a tick; `None`: none yet, and the initial state is held.
fn in_force(tick: u64, lost: impl Fn(u64) -> bool) -> Option<u64> {
    (0..=tick.checked_sub(DELAY)?).rev().find(|sent| sent % 2 == 0 && !lost(*sent))
}

fn holds_what_it_must(log: &Log, lost: impl Fn(u64) -> bool + Copy) {
    let peers = [log.of(0), log.of(1)];
    for (peer, other) in [(0, 1), (1, 0)] {
        for (tick, row) in peers[peer].iter().enumerate() {
            let held = peers[other][in_force(tick as u64, lost).unwrap_or(0) as usize].object;
            assert_eq!(row.target, held, "peer {peer} at {}", row.at);
        }
    }
}

#[test]
fn while_all_is_lost_each_holds_the_last_sample_and_then_what_is_sent_after() {
    let lost = |sent: u64| (LOST..HEALED).contains(&sent);
    let log = run(&scene("loss = 1", "loss = 0").scene(), Model::Least);
    holds_what_it_must(&log, lost);
    // The last of before, sent at 98 ms, is held from 103 ms to 404 ms; the first of after, sent at 400 ms, is in force at 405 ms.
    assert_eq!((in_force(103, lost), in_force(404, lost), in_force(405, lost)), (Some(98), Some(98), Some(400)));
    let all_that_while: Vec<Body> =
        log.of(0).iter().filter(|row| (103..405).contains(&(row.at.as_nanos() / 1_000_000))).map(|row| row.target).collect();
    assert_eq!((all_that_while.len(), all_that_while.windows(2).all(|pair| pair[0] == pair[1])), (302, true));
    for link in &log.summary.links {
        // Sent at 0, 2, … 998 ms: 150 of them while all is lost; those of 996 and 998 ms are on their way at the end.
        let stats = &link.stats;
        assert_eq!((stats.offered(), stats.dropped(DropCause::Loss), stats.dropped_in_all()), (500, 150, 150));
        assert_eq!((stats.delivered(), stats.in_flight()), (348, 2));
    }
    let dropped = log.packets.iter().filter(|packet| packet.fate == Fate::Dropped(DropCause::Loss));
    assert!(dropped.clone().all(|packet| packet.at == packet.offered && lost(packet.offered.as_nanos() / 1_000_000)));
    assert_eq!(dropped.count(), 300);
}

/// Loss by chance with certainty, by an outage, by a pattern and by a chain that never leaves its bad state: four stages, one motion.
#[test]
fn every_way_to_lose_all_is_the_same_motion() {
    let log = run(&scene("loss = 1", "loss = 0").scene(), Model::Least);
    let chain = "loss = { gilbert-elliott = { p = 1, r = 0, h = 0, k = 0 } }";
    let outage = format!("outage = [{{ from = \"{LOST}ms\", to = \"{HEALED}ms\" }}]");
    for (loss, healing) in [(outage.as_str(), "outage = []"), (chain, "loss = 0"), ("loss = { packets = [0], every = 1 }", "loss = 0")] {
        for model in [Model::Least, Model::General] {
            let other = run(&scene(loss, healing).scene(), model);
            assert_eq!(log.ticks, other.ticks, "{loss}");
            let counts = |log: &Log| log.summary.links.iter().map(|link| (link.stats.dropped_in_all(), link.stats.delivered())).collect::<Vec<_>>();
            assert_eq!(counts(&log), counts(&other), "{loss}");
        }
    }
}

/// Lost from the first packet to the last, each copy is tied to the state (x₀ʲ, v₀ʲ) in which the other began: d = x − x₀ʲ obeys a map that needs no network,
/// d⁺ = d + h·v + h²/2·a, v⁺ = v + h·a with a = −(K·d + B·(v − v₀ʲ))/m. A tick rounds fewer than 20 times; the mode is damped (each tick takes B·h/m = 3 % off), so
/// roundings of the last 300 ticks, 6000·u of the largest position 0.1 m and velocity 0.7 m/s over a time of 0.1 s, are more than what is left of all of them.
#[test]
fn with_everything_lost_for_ever_each_swings_about_where_the_other_began() {
    let mut draft = scene("loss = 1", "loss = 1");
    (draft.link, draft.damping) = ("loss = 1".to_owned(), 0.0);
    let log = run(&draft.scene(), Model::Least);
    holds_what_it_must(&log, |_| true);
    for (peer, (other, speed), start) in [(0, (-0.01, 0.7), (0.03, -0.2)), (1, (0.03, -0.2), (-0.01, 0.7))] {
        let (mut d, mut v) = (start.0 - other, start.1);
        let (h, m) = (1e-3, draft.mass / 2.0);
        for row in log.of(peer) {
            let bound = 6000.0 * crate::hard::ROUNDING * (0.1 + 0.7 * 0.1);
            assert!((row.object.position[0] - other - d).abs() <= bound, "peer {peer} at {}: {} for {}", row.at, row.object.position[0], other + d);
            let a = -(draft.gains.stiffness * d + draft.gains.damping * (v - speed)) / m;
            (d, v) = (d + h * v + h * h / 2.0 * a, v + h * a);
        }
    }
    assert!(log.summary.links.iter().all(|link| (link.stats.delivered(), link.stats.dropped(DropCause::Loss)) == (0, 500)));
}
