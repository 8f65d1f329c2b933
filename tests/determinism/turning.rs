//! An object that turns has events, also where the run is compiled to the least: what everything modelled comes to, to the bit.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_peer::rotation::{Attitude, Spin, Triple};
use cohaptic_peer::{Coordination, Gains, Signal};
use cohaptic_scene::{DeviceRotationSpec, PeerRotation, RotationSpec, Scene};
use cohaptic_tests::{Draft, drafts};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Hertz;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

use super::arrays::{difference, run, run_interrupted};

/// Components of both signs, and now and then a zero of either sign.
fn triple(size: f64) -> BoxedStrategy<Triple> {
    let component = prop_oneof![6 => -size..size, 1 => Just(0.0), 1 => Just(-0.0)];
    [component.clone(), component.clone(), component].boxed()
}

/// Principal moments of a body, each the sum of two positive numbers.
fn inertia() -> BoxedStrategy<Triple> {
    let part = prop_oneof![3 => 1e-5..1e-3_f64, 1 => Just(1e-4)];
    [part.clone(), part.clone(), part].prop_map(|[a, b, c]| [b + c, c + a, a + b]).boxed()
}

fn attitude() -> BoxedStrategy<Attitude> {
    let rate = prop_oneof![3 => triple(5.0), 1 => triple(2000.0), 1 => Just([0.0; 3])];
    let turn = prop_oneof![3 => triple(2.0), 1 => Just([0.0; 3])];
    (turn, rate, any::<bool>())
        .prop_map(|(turn, rate, other_sign)| {
            let mut attitude = Attitude { rate, ..Attitude::REST };
            attitude.turn(turn);
            Attitude { orientation: attitude.orientation.map(|q| if other_sign { -q } else { q }), ..attitude }
        })
        .boxed()
}

fn torque() -> BoxedStrategy<Option<Signal>> {
    let sine =
        (triple(0.05), 0.1..60.0, -3.0..3.0).prop_map(|(amplitude, frequency, phase)| Signal::Sine { amplitude, frequency: Hertz(frequency), phase });
    option::of(prop_oneof![triple(0.05).prop_map(Signal::Constant), sine]).boxed()
}

fn peer() -> BoxedStrategy<PeerRotation> {
    let gains = (0.0..2.0, 0.0..0.01).prop_map(|(stiffness, damping)| Gains { stiffness, damping });
    let device = (inertia(), triple(1e-3), gains, torque()).prop_map(|(inertia, damping, coupling, torque)| DeviceRotationSpec {
        handle: Spin { inertia, damping: damping.map(f64::abs) },
        coupling,
        torque,
    });
    (prop_oneof![triple(0.05), Just([0.0; 3])], attitude(), option::of(device))
        .prop_map(|(grasp, attitude, device)| PeerRotation { grasp, attitude, device })
        .boxed()
}

fn rotation(peers: usize) -> BoxedStrategy<RotationSpec> {
    let gains = (option::of(0.001..0.5_f64), option::of(triple(0.01)));
    let gains = gains
        .prop_map(|(stiffness, damping)| Gains { stiffness: stiffness.map(|k| [k, 0.9 * k, 1.1 * k]), damping: damping.map(|b| b.map(f64::abs)) });
    (inertia(), option::of(triple(0.01)), gains, 1..3_u32, vec(peer(), peers))
        .prop_map(|(inertia, damping, gains, steps, peers)| RotationSpec { inertia, damping: damping.map(|b| b.map(f64::abs)), gains, steps, peers })
        .boxed()
}

/// A scene whose object turns.
pub(super) fn scene() -> BoxedStrategy<Scene> {
    let of_draft = |mut drafts: Vec<Draft>| {
        let draft = drafts.remove(0);
        let rotation = rotation(draft.peers.len());
        let laws = select(&[Coordination::AveragePosition, Coordination::ProportionalDerivative, Coordination::Extrapolated][..]);
        (Just(draft), rotation, laws, any::<bool>())
    };
    drafts::alike(Just(1))
        .prop_flat_map(of_draft)
        .prop_map(|(mut draft, rotation, law, fast)| {
            (draft.axes, draft.strategy) = (3, law);
            let mut scene = draft.scene();
            scene.rotation = Some(Box::new(rotation));
            // Some turn so fast that it is their end.
            let speed = if fast { 1.0 } else { 1e-2 };
            for peer in scene.rotation.iter_mut().flat_map(|rotation| &mut rotation.peers) {
                peer.attitude.rate = peer.attitude.rate.map(|rate| speed * rate);
            }
            scene
        })
        .boxed()
}

properties! {
    #![proptest_config(cases(300))]

    #[test]
    fn one_that_turns_comes_to_the_same(scene in scene()) {
        let difference = difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

properties! {
    #![proptest_config(cases(80))]

    #[test]
    fn one_that_turns_and_is_interrupted_comes_to_the_same(mut scene in scene()) {
        scene.duration = Duration::from_millis(2500);
        let interrupted = |model| run_interrupted(&scene, model, 1);
        let difference = difference(&interrupted(Model::Least), &interrupted(Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}
