//! What a hand feels: Figures 5 and 8 of the paper.
//!
//! **`less-viscous`** (abstract; Fig. 5). Slowly moved, the object is less viscous with AP than with PD. *Region*: N from 3 to 8, KT from 50 to 1500 N/m, BT = BC = 5 N·s/m, delay to
//! 24 ms, one or all touching, wherever both are stable (nobody can feel what diverges). No counterexample was found.
//!
//! **`damping-grows`** (Fig. 5). It is the more viscous the more peers there are, with either strategy. *Region*: the same. No counterexample was found.
//!
//! **`nearer-to-mass`** (Fig. 5). The admittance with AP is nearer to that of the mass mO than with PD, as |ln(Y/Y₀)|. *Region*: the figure's (N = 3 to 5, Td = Tn = 8 ms, KT = 1000 N/m), from
//! 0.01 to 20 Hz. *Outside*: beyond 26 Hz the two cross ([`beyond_the_crossing_pd_is_nearer`]).
//!
//! **`travel-order`** (Section 5.2, Fig. 8). Pushed with 1.5 N from rest, the object takes less time for 20 mm with AP than with PD. *Region*: three peers, one pushing, KT from 300 to 1000 N/m,
//! links with a delay to 12 ms, jitter, up to 30 % loss, reordering and copies, each link by itself.

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_stability::{Admittance, Verdict, ideal};
use cohaptic_tests::{Draft, DraftHand, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::cases;
use crate::claims::paper::{BOTH, paper, with};

/// How viscous a scene is for its first peer [N·s/m]; `None` if it is not stable.
fn viscosity(draft: &Draft) -> Option<f64> {
    let admittance = Admittance::of(&draft.scene(), 0).unwrap();
    (admittance.verdict() == Verdict::Stable).then(|| admittance.fit_low_frequency().viscosity.value)
}

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn ap_is_less_viscous_than_pd_and_both_grow_with_the_number_of_peers(
        peers in 3..=8_usize, all in any::<bool>(), stiffness in 50.0..1500.0, delay in 0..=24_000_u32,
    ) {
        let scene = |strategy: Coordination, peers: usize| {
            let mut draft = paper(strategy, peers, if all { peers } else { 1 });
            (draft.gains.stiffness, draft.link) = (stiffness, format!("delay = \"{delay}us\""));
            viscosity(&draft)
        };
        let [ap, pd] = BOTH.map(|strategy| scene(strategy, peers));
        prop_assume!(ap.is_some() && pd.is_some());
        prop_assert!(ap < pd, "AP {ap:?}, PD {pd:?} N·s/m");
        for (strategy, more) in BOTH.into_iter().zip([ap, pd]) {
            if let (Some(fewer), Some(more)) = (scene(strategy, peers - 1), more) {
                prop_assert!(fewer < more, "{strategy:?}: {fewer} and {more} N·s/m");
            }
        }
    }
}

/// |ln(Y/Y₀)| at a frequency, AP and PD.
fn distances(peers: usize, touching: usize, hz: f64) -> [f64; 2] {
    BOTH.map(|strategy| {
        let mut draft = paper(strategy, peers, touching);
        draft.link = "delay = \"8ms\"".to_owned();
        let point = Admittance::of(&draft.scene(), 0).unwrap().at(hz).unwrap();
        let ratio = point.value / ideal(draft.mass, hz);
        ratio.norm().ln().hypot(ratio.arg())
    })
}

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn below_20_hz_ap_is_nearer_to_a_mass_than_pd(peers in 3..=5_usize, all in any::<bool>(), decades in -2.0..1.301) {
        let [ap, pd] = distances(peers, if all { peers } else { 1 }, 10_f64.powf(decades));
        prop_assert!(ap < pd, "AP {ap}, PD {pd}");
    }
}

/// Where the claim ends: somewhere between 26 and 40 Hz, for some number of peers.
#[test]
fn beyond_the_crossing_pd_is_nearer() {
    let crossed = (26..=40).any(|hz| {
        [(3, 1), (4, 1), (5, 1), (3, 3), (4, 4), (5, 5)].into_iter().any(|(peers, touching)| {
            let [ap, pd] = distances(peers, touching, f64::from(hz));
            pd < ap
        })
    });
    assert!(crossed);
}

/// When the first copy has moved 20 mm \[ms\]; `None` if it has not within the scene.
fn travel(draft: &Draft) -> Option<usize> {
    run(&draft.scene(), Model::Least).of(0).iter().position(|tick| tick.object.position[0] >= 0.02)
}

properties! {
    #![proptest_config(cases(60))]

    #[test]
    fn a_push_takes_less_time_with_ap_than_with_pd(
        stiffness in 300.0..1000.0,
        (delay, jitter) in (0..12_000_u32, 0..550_u32),
        (loss, copies) in (0..=30_u32, 0..=20_u32),
        seed in any::<u32>(),
    ) {
        let mut draft = Draft { duration: 6000, seed, ..paper(Coordination::AveragePosition, 3, 1) };
        draft.gains.stiffness = stiffness;
        draft.peers[0].hand = DraftHand::Force([1.5, 0.0, 0.0]);
        draft.link = format!("delay = \"{delay}us\", jitter = {{ sd = \"{}ns\", distribution = \"uniform\" }}, loss = \"{loss}%\", duplicate = \"{copies}%\"", delay * jitter);
        let [ap, pd] = BOTH.map(|strategy| travel(&with(&draft, strategy)));
        let (ap, pd) = (ap.unwrap(), pd.unwrap_or(6000));
        prop_assert!(ap < pd, "AP {ap}, PD {pd} ms");
    }
}
