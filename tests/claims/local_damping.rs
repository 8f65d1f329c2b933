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
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::LawValue;
use cohaptic_tests::{Draft, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::energy::{heavy, springs};
use crate::claims::injected::{Injected, stored_at_first};
use crate::claims::{TICK, ages, cases};

fn with_damping(draft: &mut Draft, damping: f64) {
    draft.strategy = Coordination::LocalDamping;
    draft.settings.of_mut(Coordination::LocalDamping).set(0, LawValue::Number(damping));
}

properties! {
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
        let most = stored_at_first(&draft.scene());
        let injected = Injected::of(&draft.scene(), &log);
        injected.is_at_most(most)?;
        injected.is_measured(&draft.scene())?;
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
        Injected::of(&scene, &log).is_at_most(stored_at_first(&scene))?;
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
        (scene.own_damping(0), Injected::of(&scene, &run(&scene, Model::Least)).excess(stored_at_first(&scene)))
    };
    let (bound, at_bound) = excess(LawValue::Automatic);
    assert!((bound - 2.1).abs() < 1e-12, "{bound}");
    assert!(at_bound <= 0.0, "{at_bound}");
    let (_, below) = excess(LawValue::Number(0.99 * bound));
    assert!(below > 0.0, "{below}");
}
