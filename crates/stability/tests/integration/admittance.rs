//! The admittance against long arithmetic, closed forms and simulations.

use std::f64::consts::{PI, TAU};

use cohaptic_scene::Scene;
use cohaptic_stability::{Admittance, AdmittanceError, Verdict, admittance, ideal};
use num_complex::Complex64;
use serde_json::Value;

use crate::anchors::scene;

/// The paper's scene of this number of peers of whom one touches.
fn one_touches(count: usize, strategy: &str) -> Scene {
    one_touches_with(count, strategy, &[])
}

fn one_touches_with(count: usize, strategy: &str, overrides: &[&str]) -> Scene {
    let (count, strategy) = (format!("scene.count={count}"), format!("coordination.strategy={strategy}"));
    scene(&[&[count.as_str(), strategy.as_str(), "peer.contact=none", "peers.peer1.contact=grasp"], overrides].concat())
}

#[track_caller]
fn assert_close(found: Complex64, expected: Complex64, relative: f64) {
    assert!((found - expected).norm() <= relative * expected.norm(), "{found} is not {expected}");
}

#[test]
fn what_was_computed_in_long_arithmetic() {
    let entries: Vec<Value> = serde_json::from_str(include_str!("../reference/admittance.json")).unwrap();
    assert!(entries.len() >= 30);
    compare(&entries);
}

/// The component at ω, computed apart in long arithmetic. What rounding may have done is as much as is claimed, and little.
#[track_caller]
pub(crate) fn compare(entries: &[Value]) {
    for entry in entries {
        let scene = Scene::parse(entry["scene"].as_str().unwrap(), "reference.toml".as_ref(), &[]).unwrap();
        let peer = scene.peers.iter().position(|peer| peer.name == entry["peer"].as_str().unwrap()).unwrap();
        let number = |key: &str| entry[key].as_str().unwrap().parse::<f64>().unwrap();
        let point = Admittance::of(&scene, peer).unwrap().at(entry["hz"].as_f64().unwrap()).unwrap();
        let expected = Complex64::from_polar(10_f64.powf(number("magnitude_db") / 20.0), number("phase_deg").to_radians());
        let off = (point.value - expected).norm();
        // The expected value itself is rounded, by about as much as exp and sin of numbers of some tens.
        let rounded = 1e-14 * expected.norm();
        assert!(off <= point.error + rounded && off <= 1e-11 * expected.norm(), "{}: {point:?}, off by {off:e}", entry["name"]);
    }
}

/// b = bH + σ·KT·(Td + (M − 1)·Tc/2), σ = N and N(N − 1), leaves out the ripple between two arrivals: 5 % and 12 %. With it, b = bH + σ·KT·(τ + δ),
/// τ = 11.5 ms and δ = BT·(σ/N)·(Tc²/m)·(M² − 1)/12: see scenarios/README.md. 2 %.
#[test]
fn the_rendered_viscosity_follows_the_law() {
    for (strategy, tolerance) in [("average-position", 0.05), ("proportional-derivative", 0.12)] {
        for count in 2..=5_u32 {
            let n = f64::from(count);
            let others = if strategy == "average-position" { 1.0 } else { n - 1.0 };
            let fit = Admittance::of(&one_touches(count as usize, strategy), 0).unwrap().fit_low_frequency();
            let (b, copy) = (fit.viscosity.value, 0.45 / n);
            let plain = 5.0 + n * others * 1000.0 * 0.0115;
            let ripple = 5.0 * others * 1e-6 / copy * 63.0 / 12.0;
            let refined = 5.0 + n * others * 1000.0 * (0.0115 + ripple);
            assert!((b / plain - 1.0).abs() < tolerance && (b / refined - 1.0).abs() < 0.02, "{strategy}, N = {count}: {b}, {plain}, {refined}");
            assert!(fit.viscosity.error < 1e-7 * b && fit.inertia.error < 1e-4 * fit.inertia.value.abs() && fit.stiffness.value == 0.0, "{fit:?}");
        }
    }
}

/// A sampled and held mass and damper: v⁺ = p·v + g·F, p = e^{−bT/m} and g = (1 − p)/b, so v/F = g/(e^{jωT} − p).
#[test]
fn a_peer_who_touches_nothing_moves_its_bare_device() {
    let frequencies = [1e-4, 0.01, 1.0, 62.5, 125.0, 333.3, 500.0];
    let closed = |mass: f64, damping: f64, hz: f64| {
        let gain = if damping > 0.0 { -libm::expm1(-damping * 1e-3 / mass) / damping } else { 1e-3 / mass };
        // e^{jωT} − p, each part without cancellation.
        let angle = TAU * hz * 1e-3;
        let real = -2.0 * (0.5 * angle).sin().powi(2) - libm::expm1(-damping * 1e-3 / mass);
        gain / Complex64::new(real, angle.sin())
    };
    for (mass, damping) in [(0.1, 5.0), (0.2, 0.0), (1.0, 0.01)] {
        for (set, off) in [("peer.compute-delay=1", 0.0), ("peers.peer3.hand={ arm = { mass = 0.3, damping = 10.0, stiffness = 0.0 } }", 1.0)] {
            let device = format!("peers.peer3.device={{ mass = {mass:?}, damping = {damping:?} }}");
            let scene = scene(&["peers.peer3.contact=none", &device, set]);
            let bare = Admittance::of(&scene, 2).unwrap();
            for point in bare.response(&frequencies).unwrap().points {
                let expected = closed(mass + 0.3 * off, damping + 10.0 * off, point.hz);
                assert_close(point.value, expected, 1e-15 / (TAU * 1e-3 * point.hz) + 1e-12);
                assert!((point.value - expected).norm() <= point.error, "{point:?} is not {expected}");
            }
            let fit = bare.fit_low_frequency();
            assert!((fit.viscosity.value - damping - 10.0 * off).abs() < 1e-8, "{fit:?}");
            // Z = b·(e^{jωT} − p)/(1 − p) = b + jω·bT/(1 − p) + …, and bT/(1 − p) is m where b is 0.
            let b = damping + 10.0 * off;
            let inertia = if b > 0.0 { -b * 1e-3 / libm::expm1(-b * 1e-3 / (mass + 0.3 * off)) } else { mass };
            assert!((fit.inertia.value / inertia - 1.0).abs() < 1e-7, "{fit:?}, {inertia}");
        }
    }
}

/// An arm ties the device to ground. At low frequency a device alone feels like the spring of its arm, and the object held by two peers like the springs of
/// both arms.
#[test]
fn arms_are_felt_as_springs() {
    let arm = "peer.hand={ arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } }";
    let stiffness = |overrides: &[&str]| Admittance::of(&scene(overrides), 0).unwrap().fit_low_frequency().stiffness.value;
    // Between two steps of a force that is held, the velocity at a tick lags behind the mean by k·Tc²/(12·m).
    let alone = stiffness(&[arm, "peers.peer1.contact=none"]);
    assert!((alone / (100.0 * (1.0 + 100.0 * 1e-6 / (12.0 * 0.4))) - 1.0).abs() < 1e-8, "{alone}");
    // Pulled slowly, the device is held by its own arm and, through two couplings and the coordination, by that of the other.
    let both = stiffness(&[arm, "scene.count=2"]);
    let expected = 100.0 + 1.0 / (1.0 / 3500.0 + 1.0 / 1000.0 + 1.0 / 3500.0 + 1.0 / 100.0);
    assert!((both / expected - 1.0).abs() < 1e-3, "{both}, {expected}");
}

/// Equal peers in one class, against peers whose masses differ by a rounding, so that each peer is a class of its own.
#[test]
fn classes_of_equal_peers_are_exact() {
    for (set, touching) in [("link.delay=8ms", "none"), ("link.delay=27.3ms", "grasp"), ("peer.compute-delay=1", "grasp"), ("peer.phase=3", "none")] {
        let contact = format!("peer.contact={touching}");
        let base = vec!["scene.count=6", "peers.peer2.contact=grasp", set, &contact];
        let apart: Vec<String> =
            (1..=6).map(|peer| format!("peers.peer{peer}.device.mass={:?}", 0.1 * (1.0 + 2e-16 * f64::from(3 * peer)))).collect();
        let different: Vec<&str> = base.iter().copied().chain(apart.iter().map(String::as_str)).collect();
        let frequencies = [0.01, 0.3, 5.0, 62.5, 200.0];
        let equal = admittance(&scene(&base), 1, &frequencies).unwrap();
        let different = admittance(&scene(&different), 1, &frequencies).unwrap();
        for (equal, different) in equal.points.iter().zip(&different.points) {
            assert_close(equal.value, different.value, 1e-10);
        }
    }
}

/// A delay of 125 frames costs what a short one does; an ideal 0.45 kg mass is 30.97 dB at 0.01 Hz.
#[test]
fn a_long_delay_costs_nothing() {
    let scene = scene(&["scene.count=2", "peers.peer2.contact=none", "link.delay=1s", "coordination.stiffness=1.0"]);
    let (slow, magnitude) = (Admittance::of(&scene, 0).unwrap(), 20.0 * ideal(0.45, 0.01).norm().log10());
    // Below the first resonance of the delay the law of the viscosity holds: 5 + 2·1·1.0035.
    let b = slow.fit_low_frequency().viscosity;
    assert!((b.value / 7.007 - 1.0).abs() < 0.02 && b.error < 1e-6, "{b:?}");
    assert!((magnitude - 30.97).abs() < 0.005);
}

#[test]
fn an_unstable_scene_says_so_and_has_an_admittance_all_the_same() {
    let unstable = Admittance::of(&scene(&["link.delay=48ms", "coordination.stiffness=5000.0"]), 0).unwrap();
    assert_eq!(unstable.verdict(), Verdict::Unstable);
    assert!(unstable.at(1.0).unwrap().value.norm() > 0.0);
    assert_eq!(Admittance::of(&scene(&[]), 0).unwrap().verdict(), Verdict::Stable);
}

#[test]
fn one_sided_contacts_are_closed_and_that_is_said() {
    let (pushing, grasping) = (scene(&["peers.peer1.contact={ push = '+x' }"]), scene(&[]));
    let (pushing, grasping) = (Admittance::of(&pushing, 0).unwrap(), Admittance::of(&grasping, 0).unwrap());
    assert_close(pushing.at(1.0).unwrap().value, grasping.at(1.0).unwrap().value, 1e-12);
    assert!(pushing.notes().iter().any(|note| note.contains("one-sided")) && grasping.notes().is_empty(), "{:?}", pushing.notes());
}

#[test]
fn frequencies_are_above_zero_and_at_most_half_the_rate_of_ticks() {
    let three = Admittance::of(&scene(&["peers.peer2.tick=2ms"]), 1).unwrap();
    assert_eq!(three.highest_frequency(), 250.0);
    assert!(three.at(250.0).is_ok());
    for hz in [0.0, -1.0, 250.000_001, f64::NAN, f64::INFINITY] {
        let refused = three.response(&[1.0, hz]).unwrap_err();
        assert!(refused.to_string().contains("above 0 and at most 250 Hz"), "{refused}");
    }
    assert_eq!(Admittance::of(&scene(&[]), 3).unwrap_err(), AdmittanceError::NoSuchPeer { peer: 3, peers: 3 });
}

/// From the definition: real peers under a sampled sine, correlated over whole periods once everything else has died out. And the figures of control.md,
/// which are the part at ω of the velocity at the beginnings of frames alone.
mod simulated {
    use cohaptic_peer::{Device as _, Hand, Held, ObjectCopy, Peer, Signal, SimulatedDevice, State};
    use cohaptic_scene::{FromScene, Strategies as _};
    use cohaptic_units::{Hertz, Instant};

    use super::*;

    /// The part at hz of the velocity of the first peer under a force e^{jωt}, over all ticks and over the first tick of each frame alone. A cosine and a
    /// sine are simulated apart: together they are e^{jωt} at every frequency, also where a cosine is its own alias.
    fn stepped(scene: &Scene, hz: f64, frames: u32, delay: usize) -> [Complex64; 2] {
        let (cosine, sine) = (under(scene, hz, 0.5 * PI, frames, delay), under(scene, hz, 0.0, frames, delay));
        [cosine[0] + Complex64::I * sine[0], cosine[1] + Complex64::I * sine[1]]
    }

    fn under(scene: &Scene, hz: f64, phase: f64, frames: u32, delay: usize) -> [Complex64; 2] {
        let n = scene.peers.len();
        let mut peers: Vec<_> = (0..n)
            .map(|place| {
                let spec = &scene.peers[place];
                let hand = Hand::Force(Signal::Sine { amplitude: [1.0; 3], frequency: Hertz(hz), phase });
                let device = SimulatedDevice::<1>::new(spec.device, (place == 0).then_some(&hand), State::REST, scene.integrator, &spec.clock);
                let object = ObjectCopy::new(scene.copy_config(place), State::REST, scene.integrator, &spec.clock);
                Peer::new(scene.peer_config(place), device, object, FromScene.strategy::<1>(scene, place), Held::new((1..n).map(|_| State::REST)))
            })
            .collect();
        let tick = std::time::Duration::from_millis(1);
        let mut sums = [Complex64::ZERO; 2];
        let mut sent: Vec<Vec<State<1>>> = Vec::new();
        for k in 0..16 * frames {
            if k % 8 == 0 {
                sent.push(peers.iter().map(|peer| *peer.object().state()).collect());
                if let Some(frame) = sent.len().checked_sub(1 + delay) {
                    let sent_at = Instant::ZERO.saturating_add_nanos(8_000_000 * u64::try_from(frame).unwrap());
                    for to in 0..n {
                        for from in (0..n).filter(|from| *from != to) {
                            peers[to].hold(if from < to { from } else { from - 1 }, sent_at, sent[frame][from]);
                        }
                    }
                }
            }
            // The second half is listened to.
            if k >= 8 * frames {
                let part = Complex64::from_polar(1.0, -TAU * hz * f64::from(k) * 1e-3) * peers[0].device().state().velocity[0];
                sums[0] += part / 8.0;
                sums[1] += if k % 8 == 0 { part } else { Complex64::ZERO };
            }
            let now = Instant::ZERO.saturating_add_nanos(u64::from(k) * 1_000_000);
            for peer in &mut peers {
                peer.compute(now);
                peer.advance(now, tick);
            }
        }
        sums.map(|sum| sum / f64::from(frames))
    }

    /// The figures handed down are those of velocities at the beginnings of frames, to the last digit given. The part at ω of all ticks is as the formula says,
    /// up to 0.04 dB below: the device trembles with the period of a frame. 12 500 frames are one period of 0.01 Hz.
    #[test]
    fn the_anchors_are_those_of_the_first_ticks() {
        for (count, strategy, first, all) in
            [(2, "average-position", -29.01, -29.018), (3, "average-position", -32.03, -32.052), (3, "proportional-derivative", -37.61, -37.646)]
        {
            let scene = one_touches(count, strategy);
            let [ticks, beginnings] = stepped(&scene, 0.01, 12_500, 1).map(|part| 20.0 * part.norm().log10());
            let lifted = Admittance::of(&scene, 0).unwrap().at(0.01).unwrap().magnitude_db();
            assert!(
                (beginnings - first).abs() < 0.005 && (ticks - all).abs() < 0.0005 && (lifted - ticks).abs() < 1e-6,
                "{lifted} {ticks} {beginnings}"
            );
        }
    }

    /// 5000 frames are 40 s: whole periods of a multiple of 0.025 Hz.
    #[test]
    fn the_definition_carried_out_gives_the_same() {
        let scenes = [
            one_touches(2, "average-position"),
            one_touches(3, "average-position"),
            one_touches(3, "proportional-derivative"),
            one_touches_with(2, "smoothed-average-position", &["coordination.stiffness=200.0"]),
            one_touches(3, "extrapolated"),
            one_touches_with(2, "local-lag", &["coordination.stiffness=200.0", "coordination.local-lag.lag=11ms"]),
            // Ages of 8 to 15 ms.
            one_touches_with(2, "extrapolated", &["coordination.extrapolated.horizon=11ms"]),
        ];
        for scene in scenes {
            let lifted = Admittance::of(&scene, 0).unwrap();
            for hz in [0.05, 1.0, 7.3, 40.0, 62.5, 125.0, 130.0] {
                assert_close(stepped(&scene, hz, 5000, 1)[0], lifted.at(hz).unwrap().value, 1e-6);
            }
        }
    }
}
