//! Copies converge when the link heals.
//!
//! **Claim.** Whatever the links did until some instant (losses, bursts, jitter, copies, disorder, queues, slots, outages): if from then on they only delay, and the scene with these delays has a
//! spectral radius ρ < 1, then the copies come together, in every frame by the factor γ = (1 + ρ)/2 up to a constant κ of the healed scene ([`crate::claims::settling`]). *Region*: ρ < 1 of the *healed*
//! scene. Nothing is asked of the scene before.
//!
//! *Outside*: `heals-and-diverges.toml`: three copies that moved as one come apart for ever after a short outage of one link, since the scene on whole links is unstable, in a mode that
//! nothing excites as long as the links are alike.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_peer::{Contact, Gains};
use cohaptic_tests::{Draft, DraftHand, links, run};
use cohaptic_tests_common::properties;
use cohaptic_wan::Fate;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::claims::cases;
use crate::claims::paper::BOTH;
use crate::claims::settling::{Settling, motions, spread};

/// When the links heal \[ms\].
const HEALED: u64 = 400;
/// All that a link can do, taken away.
pub(crate) const PLAIN: &str = "jitter = \"0s\", order = \"allow-reordering\", loss = 0, duplicate = 0, corrupt = 0, reorder = 0, rate = \"unlimited\", slots = \"none\", outage = []";

/// Two to four peers that are moved about until the links heal, which then have that delay \[µs\].
fn moved() -> BoxedStrategy<(Draft, u64)> {
    let peer = (any::<bool>(), (100.0..4000.0, 0.0..10.0), (0.05..0.3, 0.5..8.0), (-0.03..0.03, -0.3..0.3), 0..8_u64, -2.0..2.0);
    let object = (0.1..1.0, any::<bool>(), 0.2..3.0, (20.0..1200.0, 0.0..12.0), select(&BOTH), select(vec![4_u64, 8]), any::<u32>());
    (2..=4_usize)
        .prop_flat_map(move |count| {
            (object.clone(), vec(peer.clone(), count), links::any_network(count), 0..=16_000_u64).prop_map(|(object, peers, links, delay)| {
                let (mass, split_mass, damping, (stiffness, gain), strategy, every, seed) = object;
                let mut draft = Draft { seed, mass, split_mass, damping, strategy, update: 1000 * every, links, ..Draft::calm(peers.len()) };
                draft.gains = Gains { stiffness, damping: gain };
                for (peer, (grasps, (coupling, loss), (mass, damping), (position, velocity), phase, force)) in draft.peers.iter_mut().zip(peers) {
                    peer.contact = if grasps { Contact::Grasp } else { Contact::None };
                    (peer.coupling, peer.phase) = (Gains { stiffness: coupling, damping: loss }, phase % every);
                    (peer.device.mass, peer.device.damping) = (mass, damping);
                    (peer.position, peer.velocity) = (Some([position, 0.0, 0.0]), Some([velocity, 0.0, 0.0]));
                    peer.hand = DraftHand::Force([force, 0.0, 0.0]);
                }
                let hands = draft.peers.iter().map(|peer| format!("at = \"{HEALED}ms\"\npeer = \"{}\"\nset = {{ hand = \"none\" }}", peer.name));
                draft.timeline = hands.chain([format!("at = \"{HEALED}ms\"\nlink = \"all\"\nset = {{ delay = \"{delay}us\", {PLAIN} }}")]).collect();
                (draft, delay)
            })
        })
        .boxed()
}

/// The scene as it is once its links are whole and its hands gone.
fn healed(draft: &Draft, delay: u64) -> Draft {
    let mut healed = Draft { link: format!("delay = \"{delay}us\""), links: Vec::new(), timeline: Vec::new(), ..draft.clone() };
    healed.peers.iter_mut().for_each(|peer| peer.hand = DraftHand::None);
    healed
}

properties! {
    #![proptest_config(cases(80))]

    #[test]
    fn copies_come_together_as_fast_as_the_radius_says((mut draft, delay) in moved()) {
        let settling = Settling::of(&healed(&draft, delay));
        prop_assume!(settling.is_some());
        let settling = settling.unwrap();
        let ticks = settling.ticks();
        // All that is held and on the way was sent, and heard, since.
        let first = (HEALED as usize).div_ceil(ticks) + settling.memory() + 2;
        // A hundredth of what the state is then.
        let frames = settling.frames(0.01);
        prop_assume!(frames * ticks < 30_000);
        draft.duration = ((first + frames) * ticks + 1) as u64;
        let log = run(&draft.scene(), Model::Least);
        // Healed is healed: whatever is sent from then on takes the delay, and nothing else happens to it.
        for packet in log.packets.iter().filter(|packet| packet.offered.as_nanos() >= HEALED * 1_000_000) {
            prop_assert_eq!(packet.fate, Fate::Delivered(packet.offered.saturating_add(Duration::from_micros(delay))));
        }
        let motions = motions(&log, draft.peers.len());
        let size = settling.size(&draft, &motions, first);
        let place = motions.iter().flatten().map(|motion| motion.object.0.abs().max(motion.device.0.abs())).fold(0.0, f64::max);
        for frame in first..=first + frames {
            let (apart, most) = (spread(&motions, frame * ticks), 2_f64.sqrt() * settling.later(size, frame - first));
            prop_assert!(apart <= most + settling.rounding(place), "{apart:e} m after {} frames, at most {most:e}: {:?}", frame - first, (settling.rate, settling.constant));
        }
        prop_assert!(spread(&motions, (first + frames) * ticks) <= 2_f64.sqrt() * 0.01 * size + settling.rounding(place));
        // The tolerance decides nothing.
        prop_assert!(settling.rounding(place) < 1e-6 * place);
    }
}
