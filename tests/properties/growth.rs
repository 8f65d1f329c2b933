//! What a disturbance does in a simulation is what the monodromy matrix says: two computations of the same thing that share the bodies' steps and no more.

#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "frames and nanoseconds of a second or two")]
#![allow(clippy::wildcard_enum_match_arm, reason = "a kind of state that is not listed here ends the test")]

use cohaptic_harness::Model;
use cohaptic_peer::Contact;
use cohaptic_stability::{Method, Monodromy, StateKind, analyse, monodromy};
use cohaptic_tests::{Draft, DraftHand, DraftLink, Log, Tick, drafts, run};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;
use proptest::sample::select;

use crate::eigenvectors::left_eigenvectors;

/// Frames that are compared.
const FRAMES: usize = 200;

/// Any scene without walls, pushes, chance and change: two or three peers of all kinds, over any delays, with clocks that begin at any time.
fn linear() -> BoxedStrategy<Draft> {
    let delays = proptest::collection::vec(0..40_000_u64, 7);
    // A run records no memory of a law, and ages repeat only between equal clocks.
    (drafts::anything_among(2..=3_usize), delays, select(drafts::PAPER))
        .prop_map(|(mut draft, delays, strategy)| {
            (draft.strategy, draft.send_when) = (strategy, None);
            draft.enclosure = None;
            draft.timeline.clear();
            draft.link = format!("delay = \"{}us\"", delays[0]);
            let names: Vec<String> = draft.peers.iter().map(|peer| peer.name.clone()).collect();
            let pairs = names.iter().flat_map(|from| names.iter().filter(move |to| *to != from).map(move |to| (from, to)));
            draft.links = pairs
                .zip(&delays[1..])
                .filter(|(_, delay)| *delay % 2 == 0)
                .map(|((from, to), delay)| DraftLink { from: from.clone(), to: to.clone(), keys: format!("delay = \"{delay}us\"") })
                .collect();
            for peer in &mut draft.peers {
                peer.drift = 0;
                (peer.uplink, peer.downlink) = (None, None);
                if matches!(peer.contact, Contact::Push(_)) {
                    peer.contact = Contact::Grasp;
                }
                peer.hand = match peer.hand {
                    DraftHand::Arm { arm, .. } => DraftHand::Arm { arm, wanted: [0.0; 3] },
                    DraftHand::None | DraftHand::Force(_) | DraftHand::Sine { .. } => DraftHand::None,
                };
            }
            draft
        })
        .boxed()
}

properties! {
    #![proptest_config(cases(60))]

    /// The component along the eigenvector of the largest eigenvalue grows by that eigenvalue a frame, over 200 frames (fewer where it would sink into
    /// rounding), to 10⁻⁶.
    #[test]
    fn a_disturbance_grows_by_the_spectral_radius(mut draft in linear()) {
        let matrix = monodromy(&draft.scene()).unwrap();
        let radius = analyse(&draft.scene(), Method::Reduced).unwrap().radius;
        prop_assume!(radius.value > 1e-2);
        let (eigenvalue, left) = dominant(&matrix);
        prop_assert!((eigenvalue - radius.value).abs() <= 1e-9 * radius.value + radius.error, "{eigenvalue} and {radius:?}");
        // No further than until the component has sunk or grown by 10 orders of magnitude.
        let far = (10.0 * std::f64::consts::LN_10 / libm::log(radius.value).abs().max(1e-12)).min(crate::properties::count(FRAMES)) as usize;
        prop_assume!(far >= 8);
        // Late enough that samples of all ages have been sent.
        let settle = 3 + matrix.states.iter().map(|state| age(state.kind)).max().unwrap_or(0);
        let frame = u64::try_from(matrix.frame.as_millis()).unwrap();
        draft.duration = frame * (settle + far + 2) as u64;
        let log = run(&draft.scene(), Model::Least);
        // Every state, from one frame to the next, first.
        for frames in settle..settle + 3 {
            let (before, after) = (state(&matrix, &draft, &log, frames), state(&matrix, &draft, &log, frames + 1));
            let expected = matrix.matrix.times_column(&before);
            let size = before.iter().chain(&after).map(|entry| entry.abs()).fold(1e-9, f64::max);
            for ((after, expected), name) in after.iter().zip(&expected).zip(&matrix.states) {
                let tolerance = matrix.error * size + 1e-13;
                prop_assert!((after - expected).abs() <= tolerance, "{} of peer {}: {after:e}, expected {expected:e}", name.kind, name.peer);
            }
        }
        let at = |frames: usize| {
            let state = state(&matrix, &draft, &log, frames);
            let component = |part: fn(&(f64, f64)) -> f64| left.iter().zip(&state).map(|(left, state)| part(left) * state).sum::<f64>();
            (component(|left| left.0).hypot(component(|left| left.1)), state.iter().map(|entry| entry.abs()).fold(0.0, f64::max))
        };
        let ((before, size), (after, _)) = (at(settle), at(settle + far));
        // A mode that is hardly excited is not seen.
        prop_assume!(before > 1e-5 * size && before > 1e-9);
        let growth = libm::pow(after / before, 1.0 / crate::properties::count(far));
        prop_assert!((growth / radius.value - 1.0).abs() < 1e-6, "grows by {growth} a frame over {far}, the radius is {radius:?}");
    }
}

/// The largest modulus of an eigenvalue, and a left eigenvector as (real, imaginary) parts.
fn dominant(monodromy: &Monodromy) -> (f64, Vec<(f64, f64)>) {
    let first = left_eigenvectors(&monodromy.matrix).next().unwrap();
    (first.value.norm(), first.entries.iter().map(|entry| (entry.re, entry.im)).collect())
}

fn age(kind: StateKind) -> usize {
    match kind {
        StateKind::SamplePosition { age, .. } | StateKind::SampleVelocity { age, .. } => age,
        // Any other is of now.
        _ => 0,
    }
}

/// The relative state at the beginning of a frame, put together from what was recorded.
fn state(monodromy: &Monodromy, draft: &Draft, log: &Log, frame: usize) -> Vec<f64> {
    let start = monodromy.frame.as_nanos() as u64 * frame as u64;
    let of = |peer: usize| log.of(peer);
    // A peer's state when the frame begins is that of its first tick in the frame.
    let first = |peer: usize| -> Tick { **of(peer).iter().find(|tick| tick.at.as_nanos() >= start).unwrap() };
    let before = |peer: usize| -> Tick { **of(peer).iter().rev().find(|tick| tick.at.as_nanos() < start).unwrap() };
    let sample = |peer: usize, age: usize| -> Tick {
        let spec = &draft.peers[peer];
        let every = draft.update / spec.tick;
        let sent = of(peer).into_iter().enumerate().filter(|(k, tick)| *k as u64 % every == spec.phase && tick.at.as_nanos() < start);
        *sent.map(|(_, tick)| tick).rev().nth(age - 1).unwrap()
    };
    let reference = first(0).object.position;
    let compliance = |peer: usize| {
        let mass = if draft.split_mass { draft.mass / crate::properties::count(draft.peers.len()) } else { draft.mass };
        monodromy.time * (draft.peers[peer].tick as f64 * 1e-6) / mass
    };
    let relative = |position: f64, axis: usize| if monodromy.relative[0][axis].is_some() { position - reference[axis] } else { position };
    let value = |peer: usize, kind: StateKind| match kind {
        // A device that touches nothing is relative to nothing.
        StateKind::DevicePosition { axis } if draft.peers[peer].contact == Contact::None => first(peer).device.position[axis],
        StateKind::DevicePosition { axis } => relative(first(peer).device.position[axis], axis),
        StateKind::DeviceVelocity { axis } => first(peer).device.velocity[axis] * monodromy.time,
        StateKind::ObjectPosition { axis } => relative(first(peer).object.position[axis], axis),
        StateKind::ObjectVelocity { axis } => first(peer).object.velocity[axis] * monodromy.time,
        StateKind::PendingCoupling { axis } => before(peer).coupling_force[axis] * compliance(peer),
        StateKind::PendingForce { axis } => (before(peer).coupling_force[axis] - before(peer).coordination_force[axis]) * compliance(peer),
        StateKind::SamplePosition { axis, age } => relative(sample(peer, age).object.position[axis], axis),
        StateKind::SampleVelocity { axis, age } => sample(peer, age).object.velocity[axis] * monodromy.time,
        _ => unreachable!("the strategies of scenes remember nothing"),
    };
    monodromy.states.iter().map(|state| value(state.peer, state.kind)).collect()
}
