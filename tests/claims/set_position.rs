//! What the network injects with `set-position`, over any links.
//!
//! **Claim** (derived in `docs/claims.md`). With β ≥ KT·h/2, W ≤ Σᵢ ½·KT·(xᵢ − x̄ᵢ)² + N·tank at every tick, with W as in [`crate::claims::injected`] and x̄ᵢ the mean of
//! the others at the beginning.

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_scene::Scene;
use cohaptic_tests::{Draft, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::energy::springs;
use crate::claims::injected::{Injected, has_rates};
use crate::claims::{TICK, cases};

/// What the springs to the set-positions store at the beginning, and the tanks \[J\].
fn most(scene: &Scene) -> f64 {
    let positions: Vec<f64> = scene.peers.iter().map(|peer| peer.position[0]).collect();
    let others = (positions.len() - 1) as f64;
    let all: f64 = positions.iter().sum();
    let stored = |x: &f64| 0.5 * scene.coordination.gains.stiffness * (x - (all - x) / others).powi(2);
    let tank = scene.coordination.settings.of(Coordination::SetPosition).number(1);
    positions.iter().map(stored).sum::<f64>() + positions.len() as f64 * tank
}

/// β, the tank and its ceiling.
fn with(draft: &mut Draft, values: [f64; 3]) {
    draft.strategy = Coordination::SetPosition;
    for (place, value) in values.into_iter().enumerate() {
        draft.settings.of_mut(Coordination::SetPosition).set(place, LawValue::Number(value));
    }
}

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn the_network_gives_no_more_than_the_tanks_have(
        mut draft in springs(),
        more in prop_oneof![Just(0.0), 0.0..20.0],
        object in prop_oneof![Just(0.0), 0.0..5.0],
        tank in prop_oneof![Just(0.0), 0.0..0.02],
        ceiling in prop_oneof![Just(0.0), 0.0..0.02],
    ) {
        draft.damping = object;
        let least = 0.5 * draft.gains.stiffness * TICK;
        with(&mut draft, [least + more, tank, ceiling]);
        let scene = draft.scene();
        Injected::of(&scene, &run(&scene, Model::Least)).is_at_most(most(&scene))?;
    }

    /// With more energy than is ever asked for the spring goes to the mean of the others: `local-damping` with the same β.
    #[test]
    fn with_a_large_tank_it_is_local_damping(mut draft in springs(), damping in 0.5..20.0) {
        prop_assume!(!has_rates(&draft));
        draft.strategy = Coordination::LocalDamping;
        draft.settings.of_mut(Coordination::LocalDamping).set(0, LawValue::Number(damping));
        let damped = run(&draft.scene(), Model::Least);
        prop_assume!(damped.ticks.iter().all(|tick| tick.object.position[0].abs() < 0.3));
        with(&mut draft, [damping, 1e3, 1e9]);
        let modulated = run(&draft.scene(), Model::Least);
        // The same force from the same numbers; velocities wanted are not part of it.
        let motion = |log: &cohaptic_tests::Log| -> Vec<_> { log.ticks.iter().map(|tick| (tick.device, tick.object, tick.coordination_force)).collect() };
        prop_assert_eq!(motion(&modulated), motion(&damped));
    }
}

/// Without damping nothing pays for what a held spring gives.
#[test]
fn without_damping_the_network_gives_more() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let scene = |name: &str| Scene::read(&folder.join(name), &[]).unwrap_or_else(|error| panic!("{error}"));
    let undamped = scene("counterexamples/set-position-undamped.toml");
    let injected = Injected::of(&undamped, &run(&undamped, Model::Least));
    assert!((most(&undamped) - 0.2925).abs() < 1e-12, "{}", most(&undamped));
    assert!((injected.peak() - 0.292_89).abs() < 5e-6, "{}", injected.peak());
    let damped = scene("coordination/set-position-throw.toml");
    let injected = Injected::of(&damped, &run(&damped, Model::Least));
    // By a simulation of the equations apart from this program.
    assert!((injected.peak() - 0.252_246_3).abs() < 5e-8, "{}", injected.peak());
}
