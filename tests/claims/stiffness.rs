//! The effective coordination stiffness.
//!
//! **`bounded-stiffness`** (Section 2, equations 3 and 6). Over a network without delay and without limit of rate the copies swing against one another with the
//! stiffness N/(N − 1)·KT under AP, which lies between KT and 2·KT, and with N·KT under PD.
//!
//! **`frequency-needs-scaling`** (Section 2, after equation 6). The copies are governed by (N/mO)·K_AP, so with mO/N per copy the swing grows faster with N all the
//! same; with KT scaled by 4(N − 1)/N² it is that of N = 2 for every N.
//!
//! *Region*: no delay, no loss, a sample every tick; N from 2 to 60, any gains that one tick can follow.
//!
//! *Outside*: with samples further apart it is not this stiffness that decides. `scenarios/counterexamples/ap-unaffected.toml` is AP with a sample every 8 ms in place of every tick: the stiffness
//! falls from N = 2 to N = 3, and the copies become unstable.

use cohaptic_harness::Model;
use cohaptic_peer::{Coordination, Gains};
use cohaptic_tests::{Draft, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::paper::{BOTH, with};
use crate::claims::{TICK, cases};

/// With forces held over a tick h, the distance d of two copies of mass m on a spring k obeys d₂ − 2·d₁ + d₀ = −(k·h²/2m)·(d₁ + d₀), exactly. Fitted to all ticks.
fn swing(draft: &Draft) -> f64 {
    let log = run(&draft.scene(), Model::Least);
    let (first, last) = (log.of(0), log.of(draft.peers.len() - 1));
    let distances: Vec<f64> = first.iter().zip(&last).map(|(one, other)| one.object.position[0] - other.object.position[0]).collect();
    let fitted = distances.windows(3).map(|d| ((2.0 * d[1] - d[0] - d[2]) * (d[1] + d[0]), (d[1] + d[0]).powi(2)));
    let (above, below) = fitted.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1));
    let mass = if draft.split_mass { draft.mass / draft.peers.len() as f64 } else { draft.mass };
    above / below * 2.0 * mass / (TICK * TICK)
}

fn apart(peers: usize, stiffness: f64, split_mass: bool) -> Draft {
    let mut draft = Draft { split_mass, duration: 60, ..Draft::calm(peers) };
    draft.gains = Gains { stiffness, damping: 0.0 };
    draft.peers[0].position = Some([0.01, 0.0, 0.0]);
    draft
}

properties! {
    #![proptest_config(cases(60))]

    /// To 10⁻⁹: rounding of positions, 10⁻¹⁸ m, in second differences of some 10⁻⁶ m.
    #[test]
    fn copies_swing_with_the_stiffness_of_equations_3_and_6(peers in 2..=60_usize, stiffness in 10.0..300.0, split_mass in any::<bool>()) {
        let n = peers as f64;
        let draft = apart(peers, stiffness, split_mass);
        let [ap, pd] = BOTH.map(|strategy| swing(&with(&draft, strategy)));
        prop_assert!((ap / (n / (n - 1.0) * stiffness) - 1.0).abs() < 1e-8, "AP {ap}");
        prop_assert!((pd / (n * stiffness) - 1.0).abs() < 1e-8, "PD {pd}");
        prop_assert!(ap > stiffness && ap <= 2.0 * stiffness * (1.0 + 1e-8));
    }

    #[test]
    fn with_scaled_gains_the_swing_of_every_number_of_peers_is_that_of_two(peers in 3..=60_usize, stiffness in 10.0..1000.0) {
        let n = peers as f64;
        let frequency = |draft: &Draft| (swing(draft) * draft.peers.len() as f64 / draft.mass).sqrt();
        let two = frequency(&apart(2, stiffness, true));
        // 4(N − 1)/N², as `scaling = "inverse-n"` makes of it.
        let scaled = Draft { strategy: Coordination::AveragePosition, ..apart(peers, stiffness * 4.0 * (n - 1.0) / (n * n), true) };
        prop_assert!((frequency(&scaled) / two - 1.0).abs() < 1e-8);
        // And without, it grows as N/(2·√(N − 1)).
        let unscaled = frequency(&apart(peers, stiffness.min(300.0), true));
        let expected = n / (2.0 * (n - 1.0).sqrt()) * frequency(&apart(2, stiffness.min(300.0), true));
        prop_assert!((unscaled / expected - 1.0).abs() < 1e-8);
    }
}
