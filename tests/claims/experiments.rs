//! The experiments of Section 5 of the paper.
//!
//! **`stability-tests`** (Section 5.1, Fig. 7). Three users, two of whom move the object, 48 ms there and back: at KT = 2100 N/m PD is unstable and AP stable; at 1000 N/m both are stable.
//! *Region*: the two who touch have arms of 0.2 to 0.5 kg, 5 to 20 N·s/m and 50 to 300 N/m, and all links the same delay, of 20 to 28 ms one way. *Outside*:
//! `stability-tests.toml`: one of the six links 5 ms slower than the others makes PD stable at 2100 N/m. `scenarios/paper/5-1-ap-2100-no-arm.toml` and
//! `5-1-ap-1000-no-arm.toml`: without arms AP is unstable at both stiffnesses.
//!
//! **`both-stable`** (Section 5.2). One touches, KT = 1000 N/m, 24 ms one way: stable with both strategies. *Region*: delays to 8 ms one way. *Outside*: `both-stable.toml`, with the
//! paper's 24 ms.
//!
//! **`travel-times`** (Section 5.2, Fig. 8): 1.22 s and 1.514 s. Not reproduced for PD with the printed parameters: `scenarios/paper/5-2-pd.toml`. Nothing is asserted of it here.

use cohaptic_peer::{ArmConfig, Coordination};
use cohaptic_stability::Verdict;
use cohaptic_tests::DraftHand;
use cohaptic_tests_common::properties;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::claims::cases;
use crate::claims::paper::{BOTH, nominal, paper};

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn with_arms_the_four_outcomes_are_those_of_the_paper(
        arms in vec((0.2..0.5, 5.0..20.0, 50.0..300.0), 2), delay in 20_000..=28_000_u32,
    ) {
        let outcome = |strategy, stiffness| {
            let mut draft = paper(strategy, 3, 2);
            draft.gains.stiffness = stiffness;
            for (peer, (mass, damping, stiffness)) in draft.peers.iter_mut().zip(&arms) {
                peer.hand = DraftHand::Arm { arm: ArmConfig { mass: *mass, damping: *damping, stiffness: *stiffness }, wanted: [0.0; 3] };
            }
            draft.link = format!("delay = \"{delay}us\"");
            nominal(&draft)
        };
        prop_assert_eq!(BOTH.map(|strategy| outcome(strategy, 2100.0)), [Verdict::Stable, Verdict::Unstable]);
        prop_assert_eq!(BOTH.map(|strategy| outcome(strategy, 1000.0)), [Verdict::Stable, Verdict::Stable]);
    }

    #[test]
    fn at_1000_newtons_per_metre_and_up_to_8_ms_one_who_touches_is_stable(peers in 2..=3_usize, delay in 0..=8000_u32) {
        let stable = |strategy: Coordination| {
            let mut draft = paper(strategy, peers, 1);
            draft.link = format!("delay = \"{delay}us\"");
            nominal(&draft)
        };
        prop_assert_eq!(BOTH.map(stable), [Verdict::Stable, Verdict::Stable]);
    }
}
