//! No energy from nowhere: position coordination with local damping above K·T, under every condition of the links.
//!
//! **Claim** (the bound on local damping; derived in `docs/claims.md`). Let forces depend on positions alone (BT = BC = 0), all peers tick together, and no sample
//! that is in force at a tick be older than T less one tick. If b of every copy is at least Kᵢ·T (Kᵢ = KT with AP, for every N; (N − 1)·KT with PD), and,
//! where a device touches, at least Kᵢ·T + β with β = KC·h·c/(2c − KC·h), c ≤ bH, then what is stored never exceeds what was stored at first by more
//! than the hands have put in:
//!
//! ```text
//! E(k) + Σᵢ (b − Kᵢ·T − βᵢ)·Σ d²/h + Σᵢ (bH − c)·Σ dH²/h ≤ E(0) + Σ Fh·dH
//! ```
//!
//! with E the kinetic energy, and ½·Kᵢⱼ and ½·KC times the squared distances; d and dH are what a copy and a device move in a tick.

use cohaptic_harness::Model;
use cohaptic_peer::coordination::Pull;
use cohaptic_peer::{Contact, Coordination, Direction, Gains, Hand};
use cohaptic_proofs::{Effort, Links, Patterns, WorstVerdict, worst_case};
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, Verdict, analyse};
use cohaptic_tests::{Draft, DraftHand, Log, Tick, links, run};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::paper::BOTH;
use crate::claims::{TICK, ages, cases};

/// Of a device's damping, what the coupling may use; the rest bounds what a hand can put in.
const SHARE: f64 = 0.75;

/// How many times KT and BT hold one copy to all others together: once to their mean, or once to each of the others.
pub(crate) fn pulls(strategy: Coordination, peers: usize) -> f64 {
    match strategy.pull() {
        Pull::Mean => 1.0,
        Pull::Sum => (peers - 1) as f64,
    }
}

/// Kᵢ: what holds one copy to all others together [N/m].
pub(crate) fn stiffness(scene: &Scene) -> f64 {
    pulls(scene.coordination.strategy, scene.peers.len()) * scene.coordination.gains.stiffness
}

/// The bound on the damping of every copy, with `age` the largest at a tick \[s\].
pub(crate) fn least_damping(scene: &Scene, age: f64) -> f64 {
    let coupling = scene.peers.iter().filter(|peer| peer.contact != Contact::None).map(|peer| {
        let (pull, damping) = (peer.coupling.stiffness * TICK, SHARE * peer.device.damping);
        pull * damping / (2.0 * damping - pull)
    });
    stiffness(scene) * (age + TICK) + coupling.fold(0.0, f64::max)
}

/// What is stored, and what must not exceed it.
pub(crate) struct Ledger {
    /// E at each tick \[J\].
    pub(crate) stored: Vec<f64>,
    /// E(0), and what the hands have put in by then \[J\].
    pub(crate) supplied: Vec<f64>,
    /// What the excess of damping over the bound must have taken by then \[J\].
    pub(crate) taken: Vec<f64>,
    /// How far all this may be from exact numbers \[J\].
    pub(crate) rounding: f64,
}

impl Ledger {
    /// Of a run with the bound for ages up to `age`.
    pub(crate) fn of(scene: &Scene, log: &Log, age: f64) -> Self {
        let peers = scene.peers.len();
        let ticks: Vec<&[Tick]> = log.ticks.chunks_exact(peers).collect();
        let mass = scene.copy_mass();
        let pair = stiffness(scene) / (peers - 1) as f64;
        let excess = scene.object.damping - least_damping(scene, age);
        let (mut supplied, mut taken, mut exchanged) = (0.0, 0.0, 0.0);
        let mut ledger = Self { stored: Vec::new(), supplied: Vec::new(), taken: Vec::new(), rounding: 0.0 };
        for (k, now) in ticks.iter().enumerate() {
            let mut stored = 0.0;
            for (peer, tick) in scene.peers.iter().zip(*now) {
                let (device, object) = (tick.device, tick.object);
                stored += 0.5 * (mass * object.velocity[0].powi(2) + peer.device.mass * device.velocity[0].powi(2));
                let stretch = device.position[0] - object.position[0];
                let stretch = match peer.contact {
                    Contact::None => 0.0,
                    Contact::Grasp => stretch,
                    Contact::Push(Direction { positive, .. }) => {
                        if positive {
                            stretch.max(0.0)
                        } else {
                            stretch.min(0.0)
                        }
                    }
                };
                stored += 0.5 * peer.coupling.stiffness * stretch * stretch;
                stored += now.iter().map(|other| 0.25 * pair * (object.position[0] - other.object.position[0]).powi(2)).sum::<f64>();
            }
            let begin = *ledger.stored.first().unwrap_or(&stored);
            ledger.stored.push(stored);
            ledger.supplied.push(begin + supplied);
            ledger.taken.push(taken);
            exchanged += stored;
            let Some(next) = ticks.get(k + 1) else { break };
            for (peer, (tick, next)) in scene.peers.iter().zip(now.iter().zip(*next)) {
                let (moved, object) = (next.device.position[0] - tick.device.position[0], next.object.position[0] - tick.object.position[0]);
                let work = force(peer.hand.as_ref(), tick.at) * moved;
                supplied += work;
                let used = if peer.contact == Contact::None { 0.0 } else { SHARE };
                taken += (excess * object * object + (1.0 - used) * peer.device.damping * moved * moved) / TICK;
                exchanged += work.abs()
                    + tick.coordination_force[0].abs() * (object.abs() + tick.object.position[0].abs() * 1e-4)
                    + tick.coupling_force[0].abs() * (object.abs() + moved.abs() + tick.device.position[0].abs() * 1e-4);
            }
        }
        // Step maps are exact to 1e-11 of what they exchange (crates/peer/src/plant.rs), positions to 2^-53 < 1e-4·1e-11 of themselves.
        ledger.rounding = 1e-11 * exchanged;
        ledger
    }

    /// The largest energy from nowhere \[J\]: above zero, by more than rounding, where the claim fails.
    pub(crate) fn excess(&self) -> f64 {
        let all = self.stored.iter().zip(&self.supplied).zip(&self.taken);
        all.map(|((stored, supplied), taken)| stored + taken - supplied).fold(f64::MIN, f64::max) - self.rounding
    }
}

/// The force of a hand \[N\].
fn force(hand: Option<&Hand>, at: Instant) -> f64 {
    match hand {
        Some(Hand::Force(signal)) => signal.value::<1>(at)[0],
        Some(Hand::Arm { .. } | Hand::Operator { .. }) | None => 0.0,
    }
}

/// Copies held by positions alone, over any network; the damping is still to be chosen.
pub(crate) fn springs() -> BoxedStrategy<Draft> {
    let contact = select(vec![
        Contact::None,
        Contact::Grasp,
        Contact::Push(Direction { axis: 0, positive: true }),
        Contact::Push(Direction { axis: 0, positive: false }),
    ]);
    let hand = prop_oneof![
        Just(DraftHand::None),
        (-3.0..3.0).prop_map(|force| DraftHand::Force([force, 0.0, 0.0])),
        (0.1..3.0, 0.2..30.0, -3.0..3.0).prop_map(|(a, frequency, phase)| DraftHand::Sine { amplitude: [a, 0.0, 0.0], frequency, phase }),
    ];
    // The device's damping in parts of what its coupling asks for at least.
    let peer = (contact, hand, (100.0..4000.0, 0.8..4.0, 0.02..0.3), (-0.05..0.05, -0.5..0.5), 0..8_u64);
    let object = (0.05..2.0, any::<bool>(), 10.0..2000.0, select(&BOTH), select(vec![1_u64, 2, 4, 8]), any::<u32>());
    (2..=4_usize)
        .prop_flat_map(move |count| {
            (object.clone(), vec(peer.clone(), count), links::any_network(count)).prop_map(move |(object, peers, links)| {
                let (mass, split_mass, stiffness, strategy, every, seed) = object;
                let gains = Gains { stiffness, damping: 0.0 };
                let mut draft = Draft { duration: 500, seed, mass, split_mass, strategy, gains, update: 1000 * every, links, ..Draft::calm(count) };
                for (peer, (contact, hand, (coupling, parts, mass), (position, velocity), phase)) in draft.peers.iter_mut().zip(peers) {
                    (peer.contact, peer.hand, peer.phase) = (contact, hand, phase % every);
                    peer.coupling = Gains { stiffness: coupling, damping: 0.0 };
                    peer.device.mass = mass;
                    peer.device.damping = coupling * TICK * parts;
                    (peer.position, peer.velocity) = (Some([position, 0.0, 0.0]), Some([velocity, 0.0, 0.0]));
                }
                draft
            })
        })
        .boxed()
}

/// Gives the copies the damping of the bound for what the links do, and `more` of it; answers with the largest age. What becomes of a packet does not depend on where the copies are.
pub(crate) fn damped(draft: &mut Draft, more: f64) -> f64 {
    let age = ages::oldest(&run(&draft.scene(), Model::Least), draft.peers.len());
    draft.damping = (1.0 + more) * least_damping(&draft.scene(), age);
    age
}

properties! {
    #![proptest_config(cases(200))]

    /// The claim at the bound, and above it.
    #[test]
    fn no_energy_comes_from_nowhere(mut draft in springs(), more in prop_oneof![Just(0.0), 0.0..1.0]) {
        let age = damped(&mut draft, more);
        let log = run(&draft.scene(), Model::Least);
        prop_assert_eq!(ages::oldest(&log, draft.peers.len()), age);
        let ledger = Ledger::of(&draft.scene(), &log, age);
        prop_assert!(ledger.excess() <= 0.0, "{:e} J from nowhere, of {:e} J", ledger.excess(), ledger.stored[0]);
        // The tolerance decides nothing: it is far below what moves.
        prop_assert!(ledger.rounding < 1e-6 * ledger.stored.iter().copied().fold(0.0, f64::max));
    }
}

/// Two heavy copies that send at each tick over a constant delay: the case in which nothing of the bound is lost.
pub(crate) fn heavy() -> Draft {
    let mut draft = Draft { mass: 40.0, duration: 20_000, link: "delay = \"20ms\"".to_owned(), ..Draft::calm(2) };
    draft.gains = Gains { stiffness: 100.0, damping: 0.0 };
    draft.peers[0].position = Some([0.01, 0.0, 0.0]);
    draft
}

/// The bound cannot be lowered: K·T = 100 N/m · 21 ms = 2.1 N·s/m. The copies swing apart with ω² = 2·K/m, ω·T = 0.066, and the delayed force takes the part
/// sin(ω·T)/(ω·T) = 0.9993 of the bound from the damping. So 1 % below it there is energy from nowhere, in the simulation and by the analysis.
#[test]
fn one_percent_below_the_bound_energy_comes_from_nowhere() {
    let mut draft = heavy();
    let age = damped(&mut draft, 0.0);
    assert!((draft.damping - 2.1).abs() < 1e-12, "{}", draft.damping);
    let verdict = |draft: &Draft| analyse(&draft.scene(), Method::Reduced).unwrap().verdict();
    assert_eq!(verdict(&draft), Verdict::Stable);
    draft.damping *= 0.99;
    assert_eq!(verdict(&draft), Verdict::Unstable);
    let ledger = Ledger::of(&draft.scene(), &run(&draft.scene(), Model::Least), age);
    // `taken` is negative here: what would be missing. The swing itself must have grown.
    let last_second = ledger.stored[19_000..].iter().copied().fold(0.0, f64::max);
    assert!(last_second > ledger.stored[0] * 1.001 + ledger.rounding, "{last_second} J of {} J", ledger.stored[0]);
}

/// The T of the bound counts the tick over which a force is held. With an ideal network that sends at every tick nothing held is old, and still copies
/// without damping gain energy at every tick: the force of a spring that is sampled and held.
#[test]
fn the_tick_itself_is_part_of_the_age() {
    let mut draft = Draft { link: String::new(), damping: 0.0, duration: 2000, ..heavy() };
    draft.mass = 1.0;
    let log = run(&draft.scene(), Model::Least);
    assert_eq!(ages::oldest(&log, 2), 0.0);
    assert!(log.ticks.len() == 4000);
    let ledger = Ledger::of(&draft.scene(), &log, -TICK);
    // Squared distances grow by ω²h²/2·… a tick: q/2 = ω²h²/2 = 2e-4 each, of 2000.
    let growth = ledger.stored.last().unwrap() / ledger.stored[0];
    assert!(growth > 1.3, "{growth}");
    assert_eq!(analyse(&draft.scene(), Method::Reduced).unwrap().verdict(), Verdict::Unstable);
    draft.damping = 1.001 * least_damping(&draft.scene(), 0.0);
    assert_eq!(analyse(&draft.scene(), Method::Reduced).unwrap().verdict(), Verdict::Stable);
}

properties! {
    #![proptest_config(cases(40))]

    /// The same by the analysis, with nothing simulated, for any number of peers with AP: no pattern of at most so many losses in a row makes a disturbance grow,
    /// however it is repeated.
    #[test]
    fn no_pattern_of_losses_makes_a_disturbance_grow(
        peers in 2..=40_usize,
        (stiffness, mass, every, frames) in (10.0..2000.0, 0.05..5.0, select(vec![2_u64, 4, 8]), 0..3_u64),
        losses in 0..3_u32,
        strategy in select(&BOTH),
    ) {
        let mut draft = Draft { mass, split_mass: false, strategy, update: 1000 * every, ..Draft::calm(peers) };
        draft.gains = Gains { stiffness, damping: 0.0 };
        draft.link = format!("delay = \"{}ms\"", frames * every);
        // The oldest is used last a tick before the next one comes.
        let age = (frames + u64::from(losses) + 1) * every - 1;
        draft.damping = least_damping(&draft.scene(), age as f64 * TICK);
        let patterns = Patterns { losses_in_a_row: losses, delay: None, links: Links::Together };
        let found = worst_case(&draft.scene(), &patterns, &Effort { products: 2000, ..Effort::default() }).unwrap();
        prop_assert!(found.verdict() != WorstVerdict::Unstable, "{found:?}");
    }
}
