//! What a partition and its end do to the force that a hand feels through its copy.
//!
//! **Claim** (derived in `docs/claims.md`). From one tick to the next the coordination force of a copy changes by no more than
//!
//! ```text
//! |ΔFT| ≤ (Kᵢ·V + Bᵢ·a)·(h + G)
//! ```
//!
//! where V and a are the largest speed and acceleration of a copy so far, and G is the longest time between the sendings of two samples of one sender that replace one another at that tick
//! (0 if nothing new arrives). While a partition lasts nothing arrives from beyond it, so that it adds nothing; at its end G is how long it took and a period of sending. *Region*: every condition
//! of the links. With positions alone and damping above the bound of [`crate::claims::energy`], V is known before anything has moved: m·V²/2 is no more than what was stored and what hands put in.
//!
//! *Outside* lies that healing goes unnoticed: `healing-jump.toml` has a jump of a newton where whole links make none. Damage that the receiver takes
//! for a sample breaks this claim and that of [`crate::claims::energy`] too: `damage-passes.toml`.

use cohaptic_harness::Model;
use cohaptic_peer::{Contact, Gains};
use cohaptic_tests::{Draft, DraftHand, Log, Tick, links, run};
use cohaptic_tests_common::properties;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::energy::{Ledger, damped, pulls, springs, stiffness};
use crate::claims::paper::BOTH;
use crate::claims::{TICK, ages, cases};

/// For each tick and each peer, the longest time between the sendings of two samples that replace one another then \[s\].
fn gaps(log: &Log, peers: usize) -> Vec<Vec<f64>> {
    let of = |to: usize| {
        let held: Vec<Vec<u64>> = (0..peers).filter(|from| *from != to).map(|from| ages::held_since(log, from, to)).collect();
        let ticks = held[0].len();
        let gap = |tick: usize| held.iter().map(|sent| sent[tick] - sent[tick.max(1) - 1]).max().unwrap() as f64 * 1e-9;
        (0..ticks).map(gap).collect::<Vec<f64>>()
    };
    (0..peers).map(of).collect()
}

/// The largest speed and acceleration of a copy in the ticks up to each one. Between two ticks a force is constant, so the speed lies between those at both.
fn fastest(log: &Log, peers: usize) -> Vec<(f64, f64)> {
    let ticks: Vec<&[Tick]> = log.ticks.chunks_exact(peers).collect();
    let mut most = (0.0_f64, 0.0_f64);
    let at = |k: usize| {
        for (tick, before) in ticks[k].iter().zip(ticks[k.max(1) - 1]) {
            let (v, v0) = (tick.object.velocity[0], before.object.velocity[0]);
            most = (most.0.max(v.abs()), most.1.max((v - v0).abs() / TICK));
        }
        most
    };
    (0..ticks.len()).map(at).collect()
}

/// By how much the force jumps beyond the bound, at worst \[N\], with (Kᵢ, Bᵢ).
fn largest_excess(log: &Log, peers: usize, (stiffness, damping): (f64, f64)) -> f64 {
    let (gaps, fastest) = (gaps(log, peers), fastest(log, peers));
    let excess = (0..peers).flat_map(|peer| {
        let (ticks, gaps, fastest) = (log.of(peer), &gaps[peer], &fastest);
        let jump = move |k: usize| {
            let (before, now) = (ticks[k - 1].coordination_force[0], ticks[k].coordination_force[0]);
            let (speed, acceleration) = fastest[k];
            let size = stiffness * ticks[k].object.position[0].abs() + before.abs().max(now.abs());
            (now - before).abs() - (stiffness * speed + damping * acceleration) * (TICK + gaps[k]) - 1e-12 * size
        };
        (1..gaps.len()).map(jump).collect::<Vec<f64>>()
    });
    excess.fold(f64::MIN, f64::max)
}

/// Three peers of any gains over any network.
fn pushed() -> BoxedStrategy<Draft> {
    let peer = (-3.0..3.0, any::<bool>(), 0..8_u64, -0.05..0.05);
    let object = (0.1..1.0, 0.0..5.0, (10.0..800.0, 0.0..15.0), select(&BOTH), select(vec![1_u64, 4, 8]), any::<u32>());
    (object, vec(peer, 3), links::any_network(3))
        .prop_map(|((mass, damping, (stiffness, gain), strategy, every, seed), peers, links)| {
            let mut draft = Draft { duration: 500, seed, mass, damping, strategy, update: 1000 * every, links, ..Draft::calm(3) };
            draft.gains = Gains { stiffness, damping: gain };
            for (peer, (force, grasps, phase, position)) in draft.peers.iter_mut().zip(peers) {
                peer.contact = if grasps { Contact::Grasp } else { Contact::None };
                (peer.hand, peer.phase, peer.position) = (DraftHand::Force([force, 0.0, 0.0]), phase % every, Some([position, 0.0, 0.0]));
            }
            draft
        })
        .boxed()
}

properties! {
    #![proptest_config(cases(150))]

    /// Stable or not, whatever the links do.
    #[test]
    fn no_force_jumps_by_more_than_what_was_missed(draft in pushed()) {
        let gains = draft.gains.scaled(pulls(draft.strategy, 3));
        let log = run(&draft.scene(), Model::Least);
        prop_assume!(log.summary.ticks == 500);
        let excess = largest_excess(&log, 3, (gains.stiffness, gains.damping));
        prop_assert!(excess <= 0.0, "{excess} N more than can be");
    }

    /// With local damping above the bound the speed is known before.
    #[test]
    fn with_damping_above_the_bound_the_largest_jump_is_known_before(mut draft in springs(), more in 0.0..0.5) {
        let age = damped(&mut draft, more);
        let log = run(&draft.scene(), Model::Least);
        let peers = draft.peers.len();
        let stiffness = stiffness(&draft.scene());
        let begin = Ledger::of(&draft.scene(), &log, age).stored[0];
        let mass = if draft.split_mass { draft.mass / peers as f64 } else { draft.mass };
        // What is left of a device's damping for its hand: a quarter if it touches (crate::claims::energy), all if not. F·v − c·v² ≤ F²/4c, the smaller c for all.
        let power: f64 = draft.peers.iter().map(|peer| largest(peer.hand).powi(2) / peer.device.damping).sum();
        let gaps = gaps(&log, peers);
        for (peer, gaps) in gaps.iter().enumerate() {
            for (k, pair) in log.of(peer).windows(2).enumerate() {
                let speed = (2.0 * (begin + power * TICK * (k + 1) as f64) / mass).sqrt();
                let (jump, most) = ((pair[1].coordination_force[0] - pair[0].coordination_force[0]).abs(), stiffness * speed * (TICK + gaps[k + 1]));
                prop_assert!(jump <= most * (1.0 + 1e-9) + 1e-12, "{jump} N, at most {most}");
            }
        }
    }
}

/// The largest force of a hand \[N\].
fn largest(hand: DraftHand) -> f64 {
    match hand {
        DraftHand::Force(force) => force[0].abs(),
        DraftHand::Sine { amplitude, .. } => amplitude[0].abs(),
        DraftHand::None | DraftHand::Arm { .. } => 0.0,
    }
}

/// The bound is no bound of everything: told that samples replace one another after a single period, it sees the jump at the end of a partition.
#[test]
fn the_bound_would_see_a_jump() {
    let mut draft = Draft { duration: 1200, link: "outage = [{ from = \"200ms\", to = \"1s\" }]".to_owned(), ..Draft::calm(2) };
    for peer in &mut draft.peers {
        (peer.contact, peer.device.damping, peer.hand) = (Contact::Grasp, 20.0, DraftHand::Force([1.0, 0.0, 0.0]));
    }
    let whole = Draft { link: String::new(), ..draft.clone() };
    let (log, other) = (run(&draft.scene(), Model::Least), run(&whole.scene(), Model::Least));
    assert!(largest_excess(&log, 2, (1000.0, 5.0)) <= 0.0);
    let mixed = Log { packets: other.packets, ..log };
    assert!(largest_excess(&mixed, 2, (1000.0, 5.0)) > 0.5);
}
