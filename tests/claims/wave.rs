//! What the network injects with `wave`.
//!
//! **Claim** (derived in `docs/claims.md`). W ≤ 0 at every tick, over any links, for any number of peers and any impedance, where waves end with the ticks that they
//! were sent for.

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_scene::Scene;
use cohaptic_tests::run;
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::cases;
use crate::claims::energy::springs;
use crate::claims::injected::Injected;

properties! {
    #![proptest_config(cases(200))]

    #[test]
    fn the_network_injects_nothing(
        mut draft in springs(),
        impedance in 0.1..100.0,
        object in prop_oneof![Just(0.0), 0.0..5.0],
    ) {
        (draft.strategy, draft.damping) = (Coordination::Wave, object);
        let settings = draft.settings.of_mut(Coordination::Wave);
        settings.set(0, LawValue::Number(impedance));
        settings.set(1, LawValue::Word(0));
        let scene = draft.scene();
        Injected::of(&scene, &run(&scene, Model::Least)).is_at_most(0.0)?;
    }
}

/// A wave that goes on when the next one is lost is energy that nobody sent.
#[test]
fn a_held_wave_injects_energy() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/counterexamples/wave-held.toml");
    let injected = |changes: &[&str]| {
        let changes: Vec<String> = changes.iter().copied().map(str::to_owned).collect();
        let scene = Scene::read(&file, &changes).unwrap_or_else(|error| panic!("{error}"));
        Injected::of(&scene, &run(&scene, Model::Least))
    };
    let held = injected(&[]);
    // By a simulation of the equations apart from this program.
    assert!((held.peak() - 0.026_55).abs() < 5e-6, "{}", held.peak());
    let zero = injected(&["coordination.wave.on-loss=zero"]);
    assert!(zero.excess(0.0) <= 0.0, "{}", zero.peak());
}
