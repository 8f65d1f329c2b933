//! Admittance of an object that turns and that is held away from its centre.

use std::f64::consts::{PI, TAU};
use std::time::Duration;

use cohaptic_peer::{Device as _, Hand, Held, ObjectCopy, Peer, Signal, SimulatedDevice, State};
use cohaptic_scene::{FromScene, Scene, Strategies as _};
use cohaptic_stability::{Admittance, AdmittanceError, Estimate, PushedAxis, Unwatched, ideal};
use cohaptic_units::{Hertz, Instant};
use num_complex::Complex64;

const THREE: &str = r#"
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    scene        = { duration = "1s", axes = 3 }
    object       = { mass = 0.45, inertia = [1.2e-4, 2.0e-4, 2.6e-4], damping = 1.5, rotational-damping = [1e-3, 2e-3, 5e-4] }
    link         = { delay = "8ms" }
    [coordination]
    strategy = "average-position"
    stiffness = 1000.0
    damping = 5.0
    update = "8ms"
    rotational-stiffness = [0.9, 0.7, 0.8]
    rotational-damping = [3e-3, 1e-3, 2e-3]
    [[peers]]
    name = "a"
    grasp = [0.03, 0.01, -0.02]
    [[peers]]
    name = "b"
    grasp = [-0.015, 0.025, 0]
    [[peers]]
    name = "c"
    grasp = [0.01, 0, 0.02]
"#;

fn three(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(THREE, "three.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns a scene of two peers whose devices have an attitude.
fn six(overrides: &[&str]) -> Scene {
    let turns = [
        "peers=[{ name = 'a', grasp = [0.03, 0.01, -0.02] }, { name = 'b', grasp = [-0.015, 0.025, 0] }]",
        "link.delay=16ms",
        "peer.device.inertia=[2e-5, 2e-5, 1e-5]",
        "peer.device.rotational-damping=2e-3",
        "peer.coupling.rotational-stiffness=3",
        "peer.coupling.rotational-damping=2e-3",
    ];
    three(&[&turns, overrides].concat())
}

fn between(scene: &Scene, peer: usize, push: usize, seen: usize) -> Admittance {
    let [push, seen] = [push, seen].map(|place| Some(PushedAxis::ALL[place]));
    Admittance::between_watched(scene, peer, push, seen, &Unwatched).unwrap()
}

/// Frequency, peer, component of the push and of the motion, and real and imaginary part.
type Row = (f64, usize, usize, usize, (f64, f64));

/// Computed apart, by the equations alone, all peers one by one in numbers of 40 digits: tests/reference/turned_admittance.py.
#[test]
fn what_was_computed_in_long_arithmetic() {
    let of_three: &[Row] = &[
        (0.1, 0, 0, 0, (0.02932701211680841, 0.0002950202158796223)),
        (3.0, 0, 1, 1, (0.04920157221023355, 0.008634426366708962)),
        (3.0, 0, 1, 2, (0.004086337957745874, 0.0002484847131589923)),
        (70.0, 0, 2, 0, (0.002881346736930717, 0.0013249860799318218)),
        (120.0, 0, 0, 1, (-4.975653659447215e-5, 3.303777031718228e-5)),
        (400.0, 1, 0, 1, (-1.3130861771726638e-6, -1.2521749935109022e-6)),
    ];
    let of_six: &[Row] = &[
        (0.1, 0, 3, 3, (21.57374833900309, 0.37718361245482074)),
        (3.0, 0, 4, 0, (-0.4361032329882229, -0.03697602766714838)),
        (40.0, 0, 5, 3, (23.83752984068392, 22.86303526934801)),
        (300.0, 1, 5, 5, (-52.96387958870921, -47.99103872055218)),
        (3.0, 0, 0, 4, (-0.43610250862678385, -0.03689729822178322)),
    ];
    for (scene, rows) in [(three(&[]), of_three), (six(&[]), of_six)] {
        for (hz, peer, push, seen, (re, im)) in rows {
            let (point, expected) = (between(&scene, *peer, *push, *seen).at(*hz).unwrap(), Complex64::new(*re, *im));
            // The inertia of a copy is that of the object over the number of peers, rounded.
            let rounded = 1e-13 * expected.norm();
            let off = (point.value - expected).norm();
            assert!(off <= point.error + rounded && off <= 1e-9 * expected.norm(), "{point:?} is not {expected}");
        }
    }
}

/// With one grasp along x and default gains each world axis is a touched scene: of the mass along x, across it of 1/(1/m + r²/J).
#[test]
fn one_grasp_has_the_admittances_of_its_exact_parts() {
    let text = r#"
        scene        = { duration = "1s", count = 3, axes = 3 }
        object       = { mass = 0.45, inertia = [2.0e-4, 3.0e-4, 2.7e-4], damping = 0.7 }
        coordination = { strategy = "average-position", stiffness = 800.0, damping = 5.0, update = "8ms" }
        peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, grasp = [0.03, 0, 0] }
        link         = { delay = "12ms" }
    "#;
    let compute_delay = ["peer.compute-delay=1".to_owned(), "peers.peer3.contact=none".to_owned()];
    for overrides in [&[][..], &compute_delay] {
        let scene = Scene::parse(text, "one.toml".as_ref(), overrides).unwrap();
        let parts = scene.rotation_parts().unwrap().unwrap().parts;
        for (axis, mass) in [(0, 0.45), (1, 1.0 / (1.0 / 0.45 + 9e-4 / 2.7e-4)), (2, 1.0 / (1.0 / 0.45 + 9e-4 / 3.0e-4))] {
            let part = parts.iter().find(|part| part.devices[0] && (part.scene.object.mass / mass - 1.0).abs() < 1e-12).unwrap();
            let (whole, part) = (between(&scene, 0, axis, axis), Admittance::of(&part.scene, 0).unwrap());
            assert!((whole.object_mass() / mass - 1.0).abs() < 1e-14);
            for hz in [0.02, 1.0, 9.0, 62.5, 125.0, 410.0] {
                let (whole, part) = (whole.at(hz).unwrap(), part.at(hz).unwrap());
                assert!((whole.value - part.value).norm() <= whole.error + part.error + 1e-13 * part.value.norm(), "{axis}: {whole:?} {part:?}");
                assert!(whole.error < 1e-8 * part.value.norm(), "{whole:?}");
            }
            let (whole, part) = (whole.fit_low_frequency(), part.fit_low_frequency());
            let agree = |one: Estimate, other: Estimate| (one.value - other.value).abs() <= one.error + other.error + 1e-12 * other.value.abs();
            assert!(agree(whole.viscosity, part.viscosity) && agree(whole.inertia, part.inertia), "{whole:?} {part:?}");
            assert_eq!((whole.stiffness, part.stiffness), (Estimate { value: 0.0, error: 0.0 }, Estimate { value: 0.0, error: 0.0 }));
        }
        // r is along x: a push along y moves nothing along z.
        let refused = Admittance::between_watched(&scene, 0, Some(PushedAxis::Y), Some(PushedAxis::Z), &Unwatched).unwrap_err();
        assert_eq!(refused, AdmittanceError::Uncoupled { from: "y", to: "z" });
    }
}

/// With light devices, over a network that is nearly ideal, the object is felt as if it were free: 1/(jω)·W. A tick of 1 µs damps by N·KT·T/2 = 10⁻³ N·s/m, 0.1 %
/// of ωm at 0.3 Hz, and the springs yield by ω²·m/KT = 0.2 %.
#[test]
fn light_devices_on_an_ideal_network_feel_the_free_object() {
    let text = r#"
        scene        = { duration = "1s", count = 2, axes = 3 }
        object       = { mass = 0.45, inertia = [2.0e-4, 3.0e-4, 2.7e-4] }
        coordination = { strategy = "average-position", stiffness = 1000, damping = 5, update = "1us" }
        [peer]
        tick         = "1us"
        device       = { mass = 1e-6, inertia = 1e-11 }
        coupling     = { stiffness = 1000, damping = 0.1, rotational-stiffness = 1, rotational-damping = 1e-5 }
        grasp        = [0.03, -0.01, 0.02]
    "#;
    let scene = Scene::parse(text, "ideal.toml".as_ref(), &["peers.peer2.contact=none".to_owned()]).unwrap();
    // W = I/m − [r]·J⁻¹·[r], and [r]·J⁻¹ between torques and points.
    let [x, y, z] = [0.03, -0.01, 0.02];
    for (push, seen, inverse) in [
        (0, 0, 1.0 / 0.45 + z * z / 3.0e-4 + y * y / 2.7e-4),
        (0, 1, -x * y / 2.7e-4),
        (1, 2, -y * z / 2.0e-4),
        (0, 4, z / 3.0e-4),
        (5, 1, x / 2.7e-4),
        (3, 3, 1.0 / 2.0e-4),
    ] {
        let found = between(&scene, 0, push, seen);
        assert!((found.object_mass() * inverse - 1.0).abs() < 1e-13, "{push} {seen}: {}", found.object_mass());
        let (point, expected) = (found.at(0.3).unwrap(), ideal(1.0 / inverse, 0.3));
        assert!((point.value - expected).norm() <= 0.01 * expected.norm(), "{push} {seen}: {point:?} is not {expected}");
    }
}

/// The admittance by its definition: simulated peers are pushed by a sampled sine so small that its angles do not matter, and their motion is correlated with
/// the sine over whole periods after the transient has died out.
#[test]
fn the_definition_carried_out_gives_the_same() {
    let soft = ["coordination.stiffness=200", "coordination.rotational-stiffness=[0.15, 0.12, 0.14]"];
    for (scene, push, seen) in [(three(&soft), 1, 1), (three(&soft), 0, 2), (six(&soft), 4, 4), (six(&soft), 0, 5), (six(&soft), 3, 1)] {
        let lifted = between(&scene, 0, push, seen);
        assert!(lifted.radius().value < 0.97, "the transient dies out: {:?}", lifted.radius());
        for hz in [1.0, 40.0, 130.0] {
            let (cosine, sine) = (under(&scene, push, seen, hz, 0.5 * PI), under(&scene, push, seen, hz, 0.0));
            // Angles are some 10⁻⁵ rad and their squares are left out; motion apart from the sine has died out by a millionth.
            let (point, expected) = (lifted.at(hz).unwrap(), cosine + Complex64::I * sine);
            assert!((point.value - expected).norm() <= 1e-5 * expected.norm(), "{push} {seen} {hz}: {point:?} is not {expected}");
        }
    }
}

fn under(scene: &Scene, push: usize, seen: usize, hz: f64, phase: f64) -> Complex64 {
    let n = scene.peers.len();
    // Newtons, and newtons times a lever of some centimetres.
    let size = if push < 3 { 1e-4 } else { 1e-6 };
    let signal = |first: usize| Signal::Sine {
        amplitude: std::array::from_fn(|axis| if first + axis == push { size } else { 0.0 }),
        frequency: Hertz(hz),
        phase,
    };
    let mut peers: Vec<_> = (0..n)
        .map(|place| {
            let spec = &scene.peers[place];
            let force = Hand::Force(signal(0));
            let device =
                SimulatedDevice::<3>::new(spec.device, (place == 0).then_some(&force), scene.initial_device(place), scene.integrator, &spec.clock);
            let object = ObjectCopy::new(scene.copy_config(place), State::REST, scene.integrator, &spec.clock);
            let mut rotation = scene.rotation_of(place).unwrap();
            if place == 0 {
                rotation.set_hand(Some(signal(3)));
            }
            let held = Held::new((1..n).map(|_| State::REST));
            Peer::new(scene.peer_config(place), device, object, FromScene.strategy::<3>(scene, place), held).with_rotation(rotation)
        })
        .collect();
    let delay = usize::try_from(scene_delay(scene).as_millis() / 8).unwrap();
    let (mut sum, mut sent) = (Complex64::ZERO, Vec::new());
    // 4 s to settle, 4 s to listen to.
    for k in 0..8000_u64 {
        if k % 8 == 0 {
            sent.push(peers.iter().map(|peer| (*peer.object().state(), *peer.rotation().unwrap().copy())).collect::<Vec<_>>());
            if let Some(frame) = sent.len().checked_sub(1 + delay) {
                let sent_at = Instant::ZERO.saturating_add_nanos(8_000_000 * u64::try_from(frame).unwrap());
                for (to, peer) in peers.iter_mut().enumerate() {
                    for from in (0..n).filter(|from| *from != to) {
                        let (other, (state, attitude)) = (if from < to { from } else { from - 1 }, sent[frame][from]);
                        peer.hold(other, sent_at, state);
                        peer.rotation_mut().unwrap().hold(other, &attitude);
                    }
                }
            }
        }
        if k >= 4000 {
            #[expect(clippy::cast_precision_loss, reason = "some thousands")]
            let part = Complex64::from_polar(1.0, -TAU * hz * k as f64 * 1e-3);
            let velocity =
                if seen < 3 { peers[0].device().state().velocity[seen] } else { peers[0].rotation().unwrap().device().unwrap().rate[seen - 3] };
            sum += part * velocity;
        }
        let now = Instant::ZERO.saturating_add_nanos(k * 1_000_000);
        for peer in &mut peers {
            peer.compute(now);
            peer.advance(now, Duration::from_millis(1));
        }
    }
    sum / (4000.0 * size)
}

/// Returns the constant delay of the links of [`three`] and [`six`].
fn scene_delay(scene: &Scene) -> Duration {
    Duration::from_millis(if scene.peers.len() == 2 { 16 } else { 8 })
}

/// Held by an arm at another point, a peer is tied along the line to that point and free across it.
#[test]
fn an_arm_ties_along_the_line_to_it() {
    let scene = three(&[
        "peers.a.grasp=[0.03, 0, 0]",
        "peers.b.grasp=[-0.02, 0, 0]",
        "peers.b.hand={ arm = { mass = 0.3, damping = 4, stiffness = 100 }, follows = { position = [0, 0, 0] } }",
    ]);
    let felt = |axis| between(&scene, 0, axis, axis).fit_low_frequency().stiffness;
    // Springs in a row: the arm alone is less than all of them, and copies hold each other by KT.
    assert!((10.0..100.0).contains(&felt(0).value) && felt(0).error < 1e-3, "{:?}", felt(0));
    assert_eq!(felt(1).value, 0.0);
}
