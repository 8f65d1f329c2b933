//! Stability regions: Figures 3 and 4 of the paper.
//!
//! Peers, links and gains are equal. Stable is meant as `docs/stability.md` says: by the spectral radius where nothing is left to chance, in the mean square
//! where samples are lost at random.
//!
//! **`region-contains`** ("the AP strategy can keep the distributed three-user haptic cooperation stable for stiffer coordination", Section 5.1; Figs. 3, 4). What is stable with PD
//! is stable with AP. *Regions*:
//!
//! 1. BT = BC = 5 N·s/m, KT from 10 to 1000 N/m, KC from 500 to 6000 N/m, delay to 8 ms, N from 3 to 6, whoever touches, both readings of the mass: proven ([`crate::claims::proofs`]), and searched here;
//! 2. the same with a delay to 8 ms, all touching, and up to 30 % of samples lost, each by itself;
//! 3. BT = BC = 0, KT to 1000 N/m, delay to 12 ms, all touching.
//!
//! *Outside*: `region-contains.toml` (KT = 5000 N/m, no delay at all).
//!
//! **`ap-unaffected`** (Section 3). AP's stability does not depend on N. *Region*: BT = BC = 0 and the object's damping above KT·T + β ([`crate::claims::energy`]): AP is stable for
//! every N, whatever the delay below T. *Outside*: `ap-unaffected.toml`: the paper's own parameters without damping; with three in place of two it is unstable.
//!
//! **`pd-decreases`** (Section 3). What is stable with PD for N + 1 is stable for N. *Region*: BT = BC = 0, mO/N per copy, KT to 300 N/m, delay to 8 ms, all touching.
//! *Outside*: `pd-decreases.toml`: two are unstable, three are stable.
//!
//! **`region-larger`** (Figs. 3, 4). Of a square of gains AP keeps the larger share stable. It follows where `region-contains` holds point by point; the areas of the figures are on
//! `docs/results.md`. *Outside*: `region-larger.toml`: in one reading of Fig. 4 eight peers are stable with PD over most of the square, and with AP not.

use cohaptic_peer::{Coordination, Gains};
use cohaptic_stability::{Method, QUICK_UNKNOWNS, Verdict, analyse, judge};
use cohaptic_tests::Draft;
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::energy::least_damping;
use crate::claims::paper::{coupled, nominal, paper, with};
use crate::claims::{TICK, cases};

const AP: Coordination = Coordination::AveragePosition;
const PD: Coordination = Coordination::ProportionalDerivative;

/// A scene of Figs. 3 and 4 with these gains.
fn figure(peers: usize, touching: usize, split_mass: bool, (stiffness, coupling, damping): (f64, f64, f64), delay_us: u64) -> Draft {
    let mut draft = coupled(paper(AP, peers, touching), coupling, damping);
    (draft.gains, draft.split_mass) = (Gains { stiffness, damping }, split_mass);
    draft.link = format!("delay = \"{delay_us}us\"");
    draft
}

/// With chance in the network, in the mean square.
fn verdict(draft: &Draft) -> Verdict {
    let judged = judge(&draft.scene(), Method::Reduced, QUICK_UNKNOWNS).unwrap();
    assert!(judged.mean_square.is_some(), "{:?}", judged.analysis.notes);
    judged.verdict
}

properties! {
    #![proptest_config(cases(200))]

    #[test]
    fn what_pd_keeps_stable_ap_keeps_stable(
        (peers, touching) in (3..=6_usize).prop_flat_map(|peers| (Just(peers), 0..=peers)),
        split_mass in any::<bool>(),
        gains in (10.0..1000.0, 500.0..6000.0, Just(5.0)),
        delay in 0..=8000_u64,
    ) {
        let ap = figure(peers, touching, split_mass, gains, delay);
        // With nobody touching and no damping of the object a common velocity stays for ever, with both strategies: what is left of `marginal` is that.
        let damped = |draft: Draft| Draft { damping: if touching == 0 { 0.01 } else { 0.0 }, ..draft };
        prop_assume!(nominal(&damped(with(&ap, PD))) == Verdict::Stable);
        prop_assert_eq!(nominal(&damped(ap)), Verdict::Stable);
    }

    #[test]
    fn what_pd_keeps_stable_without_damping_ap_keeps_stable(
        peers in 3..=6_usize, split_mass in any::<bool>(), gains in (1.0..1000.0, 100.0..6000.0, Just(0.0)), delay in 0..=12_000_u64,
    ) {
        let ap = figure(peers, peers, split_mass, gains, delay);
        prop_assume!(nominal(&with(&ap, PD)) == Verdict::Stable);
        prop_assert_eq!(nominal(&ap), Verdict::Stable);
    }

    #[test]
    fn what_pd_keeps_stable_for_one_more_it_keeps_stable(peers in 2..=6_usize, gains in (1.0..300.0, 100.0..6000.0, Just(0.0)), delay in 0..=8000_u64) {
        let pd = |peers| with(&figure(peers, peers, true, gains, delay), PD);
        prop_assume!(nominal(&pd(peers + 1)) == Verdict::Stable);
        prop_assert_eq!(nominal(&pd(peers)), Verdict::Stable);
    }

    /// Whatever the delay is, as long as a sample is never older than that of the bound.
    #[test]
    fn above_the_bound_of_local_damping_ap_is_stable_for_any_number_of_peers(
        peers in 2..=200_usize, (stiffness, coupling) in (10.0..3000.0, 100.0..3000.0), delay in 0..=60_000_u64, mass in 0.05..3.0,
    ) {
        // The bound needs the scene, and is set in it: a text of two hundred peers is read once.
        let mut scene = Draft { mass, ..figure(peers, peers, false, (stiffness, coupling, 0.0), delay) }.scene();
        // Used first a tick after it came, at most, and last a period later.
        let age = 1e-6 * delay as f64 + 9.0 * TICK;
        scene.object.damping = least_damping(&scene, age);
        prop_assert_eq!(analyse(&scene, Method::Reduced).unwrap().verdict(), Verdict::Stable);
    }
}

properties! {
    #![proptest_config(cases(60))]

    #[test]
    fn what_pd_keeps_stable_over_lossy_links_ap_keeps_stable(
        peers in 3..=6_usize, split_mass in any::<bool>(), gains in (10.0..1000.0, 500.0..6000.0, Just(5.0)), delay in 0..=8000_u64, percent in 1..=30_u32,
    ) {
        let mut ap = figure(peers, peers, split_mass, gains, delay);
        ap.link += &format!(", loss = \"{percent}%\"");
        prop_assume!(verdict(&with(&ap, PD)) == Verdict::Stable);
        prop_assert_eq!(verdict(&ap), Verdict::Stable);
    }
}
