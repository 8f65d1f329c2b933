//! The law `local-lag` at a common velocity: no force.
//!
//! **Claim** (`docs/claims.md`). Let all samples in use at a tick be L ticks old, L the lag. Copies that begin together at one velocity, and that nothing else acts on, then keep it:
//! FT = KT·(x(k − L) − x̄) + BT·(v(k − L) − v̄) is zero at every tick, also before the first sample arrives, since the initial state is in use at both ends.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_peer::Gains;
use cohaptic_peer::coordination::{Law, LawValue};
use cohaptic_tests::{Draft, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::cases;

/// Untouched copies that move at one velocity and send at each tick \[µs\], over a constant delay \[µs\].
fn drifting(peers: usize, axes: usize, gains: Gains, velocity: [f64; 3], tick: u64, delay: u64) -> Draft {
    let mut draft = Draft { duration: 150, axes, gains, velocity, update: tick, link: format!("delay = \"{delay}us\""), ..Draft::calm(peers) };
    draft.strategy = Coordination::LocalLag;
    draft.peers.iter_mut().for_each(|peer| peer.tick = tick);
    draft
}

/// The largest coordination force of each tick \[N\].
fn forces(draft: &Draft, model: Model) -> Vec<f64> {
    let ticks = run(&draft.scene(), model).ticks;
    let largest =
        |peers: &[cohaptic_tests::Tick]| peers.iter().flat_map(|tick| tick.coordination_force).fold(0.0, |most: f64, force| most.max(force.abs()));
    ticks.chunks_exact(draft.peers.len()).map(largest).collect()
}

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn nobody_is_held_back_at_a_common_velocity(
        peers in 2..=5_usize,
        axes in 1..=3_usize,
        (stiffness, damping) in (1.0..1000.0, 0.0..5.0),
        velocity in prop::array::uniform3(-1.0..1.0),
        tick in select(vec![500_u64, 1000, 2000]),
        delay in 0..30_000_u64,
        model in select(vec![Model::Least, Model::General]),
    ) {
        let mut draft = drifting(peers, axes, Gains { stiffness, damping }, velocity, tick, delay);
        let lag = delay.div_ceil(tick);
        prop_assert_eq!(Law::<f64>::lag(&draft.scene().law(0).unwrap()) as u64, lag, "auto");
        // Instabilities of these gains magnify rounding, 10⁻¹⁶ m, by at most e⁸ in that time.
        let limit = 1e-11 * stiffness;
        let most = forces(&draft, model).into_iter().fold(0.0, f64::max);
        prop_assert!(most <= limit, "{most} N, and at most {limit} N of rounding");

        // The own state a tick younger or older: at the first tick at which that counts, by the way of a tick.
        let fastest = velocity[..axes].iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        for (other, first) in [(lag.checked_sub(1), lag), (Some(lag + 1), lag + 1)] {
            let Some(other) = other else { continue };
            draft.settings.of_mut(Coordination::LocalLag).set(0, LawValue::Duration(Duration::from_micros(other * tick)));
            let force = forces(&draft, model)[first as usize];
            let expected = stiffness * 1e-6 * tick as f64 * fastest;
            prop_assert!((force - expected).abs() <= limit, "{force} N, and {expected} N expected with a lag of {other} ticks in place of {lag}");
        }
    }
}
