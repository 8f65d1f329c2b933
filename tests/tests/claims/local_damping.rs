//! What the network injects with `local-damping`, under every condition of the links.
//!
//! **Claim** (derived in `docs/claims.md`). Let all peers tick together and no sample in force at a tick be older than T less one tick. With β ≥ KT·T the coordination
//! forces and the damping β together inject no more than the springs stored at first, whatever devices, hands and the object's own damping do:
//!
//! ```text
//! W(k) = Σᵢ Σ (−F·d − what β took) ≤ U = Σ_{i<j} ½·KT/(N−1)·(xᵢ − xⱼ)² at the beginning
//! ```
//!
//! with F the spring's force held over a tick, and d what a copy moves in it. Of what all damping takes in a tick, f·d − ½·m·Δv² with f the sum of the held forces, β takes β/(bO + β).

use cohaptic_harness::Model;
use cohaptic_harness::measures::Measures;
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_scene::{Measure, MeasureName, MeasureSettings, MeasureSpec, Scene};
use cohaptic_tests::{Body, Draft, Log, Tick, run};
use proptest::prelude::*;

use crate::energy::{heavy, springs};
use crate::{TICK, ages, cases};

/// The energy that the network has injected by each tick \[J\], what it may be at most, and how far all this may be from exact numbers.
struct Injected {
    energy: Vec<f64>,
    most: f64,
    rounding: f64,
}

impl Injected {
    fn of(scene: &Scene, log: &Log) -> Self {
        let peers = scene.peers.len();
        let (stiffness, mass) = (scene.coordination.gains.stiffness, scene.copy_mass());
        let ticks: Vec<&[Tick]> = log.ticks.chunks_exact(peers).collect();
        let pair = stiffness / (peers - 1) as f64;
        let first = ticks[0];
        let stored = |one: &Tick| first.iter().map(|other| 0.25 * pair * (one.object.position[0] - other.object.position[0]).powi(2)).sum::<f64>();
        let most = first.iter().map(stored).sum();
        let (mut injected, mut exchanged, mut energy) = (0.0, most, Vec::new());
        for (k, row) in ticks.iter().enumerate() {
            for (place, now) in row.iter().enumerate() {
                let own = scene.own_damping(place);
                let end = &log.summary.peers[place];
                let at_end = || Body { position: [end.position[0], 0.0, 0.0], velocity: [end.velocity[0], 0.0, 0.0] };
                let (before, after) = (now.object, ticks.get(k + 1).map_or_else(at_end, |next| next[place].object));
                let moved = after.position[0] - before.position[0];
                let spring = now.coordination_force[0] - own * before.velocity[0];
                let held = now.coupling_force[0] - spring;
                let damped = held * moved - 0.5 * mass * (after.velocity[0].powi(2) - before.velocity[0].powi(2));
                injected -= spring * moved + damped * own / (own + scene.object.damping);
                exchanged += (spring.abs() + held.abs()) * (moved.abs() + before.position[0].abs() * 1e-4)
                    + mass * (after.velocity[0].powi(2) + before.velocity[0].powi(2))
                    + own * before.velocity[0].abs() * moved.abs();
            }
            energy.push(injected);
        }
        // Step maps are exact to 1e-11 of what they exchange (crates/peer/src/plant.rs), positions to 2^-53 < 1e-4·1e-11 of themselves.
        Self { energy, most, rounding: 1e-11 * exchanged }
    }

    /// How much more than it may \[J\]; above zero, by more than rounding, where the claim fails.
    fn excess(&self) -> f64 {
        self.energy.iter().copied().fold(f64::MIN, f64::max) - self.most - self.rounding
    }
}

/// `energy_j` and `energy_peak_j` of the scene.
fn measured(mut scene: Scene) -> (f64, f64) {
    let names = [Measure::Energy, Measure::EnergyPeak].map(|measure| MeasureName { measure, peer: None }).to_vec();
    scene.measure = Some(MeasureSpec { names, settings: MeasureSettings::default() });
    let values = Measures::run(&scene, Model::Least).1;
    (values[0].value.unwrap(), values[1].value.unwrap())
}

fn with_damping(draft: &mut Draft, damping: f64) {
    draft.strategy = Coordination::LocalDamping;
    draft.settings.of_mut(Coordination::LocalDamping).set(0, LawValue::Number(damping));
}

proptest! {
    #![proptest_config(cases(200))]

    /// At the bound and above it, over any network and without damping of the object or with it.
    #[test]
    fn the_network_injects_no_energy(
        mut draft in springs(),
        more in prop_oneof![Just(0.0), 0.0..1.0],
        object in prop_oneof![Just(0.0), 0.0..5.0],
    ) {
        draft.damping = object;
        // What becomes of a packet does not depend on where the copies are.
        let age = ages::oldest(&run(&draft.scene(), Model::Least), draft.peers.len());
        let stiffness = draft.gains.stiffness;
        with_damping(&mut draft, (1.0 + more) * stiffness * (age + TICK));
        let log = run(&draft.scene(), Model::Least);
        let injected = Injected::of(&draft.scene(), &log);
        prop_assert!(injected.excess() <= 0.0, "{:e} J more than {:e} J", injected.excess(), injected.most);
        let (energy, peak) = measured(draft.scene());
        let largest = injected.energy.iter().copied().fold(0.0, f64::max);
        prop_assert!((energy - injected.energy.last().unwrap()).abs() <= injected.rounding && (peak - largest).abs() <= injected.rounding);
        prop_assert!(peak <= injected.most + injected.rounding, "the measure says what the claim does: {peak} J of {} J", injected.most);
        // The tolerance decides nothing: it is far below what moves.
        prop_assert!(injected.rounding <= 1e-6 * injected.energy.iter().copied().fold(injected.most, |most, energy| most.max(energy.abs())));
    }

    /// A damping of `auto` is the bound for what the links do at most.
    #[test]
    fn automatic_damping_is_at_least_the_bound(mut draft in springs(), delay in 0..40_u64, lost in 0..3_u64, more in 1..5_u64) {
        draft.links.clear();
        draft.link = format!("delay = \"{delay}ms\"");
        if lost > 0 {
            draft.link.push_str(&format!(", loss = {{ packets = [\"1-{lost}\"], every = {} }}", lost + 1 + more));
        }
        with_damping(&mut draft, 0.0);
        draft.settings.of_mut(Coordination::LocalDamping).set(0, LawValue::Automatic);
        draft.settings.of_mut(Coordination::LocalDamping).set(1, LawValue::Automatic);
        let scene = draft.scene();
        let log = run(&scene, Model::Least);
        let bound = scene.coordination.gains.stiffness * (ages::oldest(&log, scene.peers.len()) + TICK);
        let damping = scene.own_damping(0);
        prop_assert!(damping >= bound * (1.0 - 1e-12), "{damping} is below {bound}");
        prop_assert!(Injected::of(&scene, &log).excess() <= 0.0);
    }
}

/// The bound cannot be lowered: two heavy copies that send at every tick over 20 ms swing apart with ω·T = 0.066 (see `energy.rs`), where nothing of it is lost.
#[test]
fn one_percent_below_the_bound_the_network_injects_energy() {
    let mut draft = heavy();
    let mut excess = |damping: LawValue| {
        with_damping(&mut draft, 0.0);
        let settings = draft.settings.of_mut(Coordination::LocalDamping);
        settings.set(0, damping);
        settings.set(1, LawValue::Automatic);
        let scene = draft.scene();
        (scene.own_damping(0), Injected::of(&scene, &run(&scene, Model::Least)).excess())
    };
    let (bound, at_bound) = excess(LawValue::Automatic);
    assert!((bound - 2.1).abs() < 1e-12, "{bound}");
    assert!(at_bound <= 0.0, "{at_bound}");
    let (_, below) = excess(LawValue::Number(0.99 * bound));
    assert!(below > 0.0, "{below}");
}
