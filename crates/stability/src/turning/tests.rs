//! Compares the linear equations with simulated peers that turn.

use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::{Hand, Signal, State};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::node::Node;
use super::peers::{Bases, Member, members, slope};
use super::*;

const SCENE: &str = r#"
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    scene        = { duration = "1s", axes = 3 }
    object       = { mass = 0.45, inertia = [1.2e-4, 2.0e-4, 2.6e-4], damping = 1.5, rotational-damping = [1e-3, 2e-3, 0] }
    link         = { delay = "12ms" }
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
    device = { inertia = [2e-5, 2e-5, 1e-5], rotational-damping = 2e-3 }
    coupling = { rotational-stiffness = 3, rotational-damping = 2e-3 }
    [[peers]]
    name = "c"
    grasp = [0.01, 0, 0.02]
"#;

fn arm(peer: &str) -> String {
    format!("peers.{peer}.hand={{ arm = {{ mass = 0.3, damping = 4, stiffness = 100 }}, follows = {{ position = [0, 0, 0] }} }}")
}

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(SCENE, "turns.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the peers of a scene. With `loaded` the hands act as in the scene. Otherwise arms hold the devices at their grasp points, and other hands are left
/// out.
fn peers(scene: &Scene, loaded: bool) -> Vec<Member> {
    members(scene, |place| {
        let hand = scene.peers[place].hand.clone();
        let grasp = scene.rotation.as_ref().unwrap().peers[place].grasp;
        if loaded { hand } else { hand.and_then(|hand| hand.arm()).map(|arm| Hand::Arm { arm, follows: Signal::Constant(grasp) }) }
    })
}

/// Returns the initial poses without a load: copies at the origin, devices at their grasp points.
fn at_rest(scene: &Scene) -> Vec<Pose> {
    let grasps = scene.rotation.as_ref().unwrap().peers.iter().map(|peer| peer.grasp);
    grasps.map(|device| Pose { centre: [0.0; 3], attitude: Attitude::REST, device, handle: Attitude::REST }).collect()
}

/// Returns the state of simulated peers after a frame from the state `z`, in the coordinates of [`Turning`]. Late forces are those that the peers compute at
/// the state `before`, if given. In the returned state the late forces are zero.
fn pushed(members: &mut [Member], turning: &Turning<'_>, poses: &[Pose], z: &[f64], before: Option<&[f64]>) -> Vec<f64> {
    let bases = Bases::resting(poses.to_vec(), turning);
    if let Some(before) = before {
        for (to, member) in members.iter_mut().enumerate() {
            for (other, base) in poses.iter().enumerate().filter(|(other, _)| *other != to).map(|(_, base)| base).enumerate() {
                member.hold(other, Instant::ZERO, State { position: base.centre, velocity: [0.0; 3] });
                member.rotation_mut().unwrap().hold(other, &base.attitude);
            }
        }
        bases.put(members, turning, before);
        for member in members.iter_mut() {
            member.compute(Instant::ZERO);
        }
    }
    bases.reached(members, turning, z)
}

/// Returns the indices of all states except the late forces.
fn known(turning: &Turning<'_>) -> Vec<usize> {
    let waits = |state: usize| {
        let mut first = 0;
        turning.nodes.iter().any(|node| {
            let place = state.checked_sub(first);
            first += node.states();
            place.is_some_and(|place| (12 + 2 * node.device.len()..node.states()).contains(&place))
        })
    };
    (0..turning.size()).filter(|state| !waits(*state)).collect()
}

/// Compares all columns except those of late forces, and returns the largest entry.
fn compare(scene: &Scene, turning: &Turning<'_>, bases: &[Pose], loaded: bool) -> f64 {
    let known = known(turning);
    let mut largest = 0.0_f64;
    for column in &known {
        let (found, _) = slope(|size| {
            let mut z = vec![0.0; turning.size()];
            z[*column] = size;
            // The late forces are those that the peers compute at rest, which count as zero in the linear equations.
            let rest = vec![0.0; z.len()];
            pushed(&mut peers(scene, loaded), turning, bases, &z, scene.peers[0].compute_delay.then_some(&*rest))
        });
        let mut unit = vec![0.0; turning.size()];
        unit[*column] = 1.0;
        let linear = turning.reached(&unit);
        for row in &known {
            assert!((found[*row] - linear[*row]).abs() < 1e-9, "row {row}, column {column}: {} is not {}", found[*row], linear[*row]);
            largest = largest.max(found[*row].abs());
        }
    }
    largest
}

fn each(scene: &Scene) -> Together {
    let network = NominalNetwork::of(scene).unwrap();
    let together = Together::new(scene, Structure::of_each(scene, &network, &contacts(scene).unwrap()).unwrap());
    Together { time: 0.01, ..together }
}

/// Steps are the length 2·10⁻⁵ m. Angles are below 2·10⁻³ rad, whose fourth power is 1.6·10⁻¹¹; a rounding of a position of 4 cm, over e, is 10⁻¹³, and a
/// frame has some hundred of them. Entries are up to about 3.
#[test]
fn the_equations_are_the_linear_part_of_real_peers() {
    for more in [
        &[][..],
        &["coordination.strategy=proportional-derivative", "coordination.scaling=inverse-n", "object.split-mass=true"],
        &["coordination.strategy=extrapolated", "simulation.integrator=rk4", "simulation.rotation-steps=2"],
        &["simulation.integrator=semi-implicit-euler", "simulation.rotation-steps=3", "peers.b.contact=none"],
        &["peers.a.compute-delay=1", "peers.b.compute-delay=1"],
        // A frame of 17 samples of one clock and 16 of the others, whose ticks have two lengths; and a link that never delivers.
        &["peers.a.clock.drift=0.0625", "coordination.update=2ms", "link.delay=11.7ms", "links=[{ from = 'c', to = 'b', loss = 1 }]"],
    ] {
        let scene = scene(&[&[arm("c").as_str()], more].concat());
        let together = each(&scene);
        assert_eq!(together.structure.silent, more.iter().any(|more| more.contains("loss")));
        let largest = compare(&scene, &Turning { free: Vec::new(), ..together.turning() }, &at_rest(&scene), false);
        assert!((1.0..10.0).contains(&largest), "{more:?}: {largest}");
    }
}

/// Peers with a delayed force hold forces and torques from the tick before. Such a state is displaced along every coordinate at once, and the state after a
/// frame at rest is compared with the equations.
#[test]
fn forces_that_wait_are_those_of_real_peers() {
    let scene = scene(&["peers.a.compute-delay=1", "peers.b.compute-delay=1", "peers.c.compute-delay=1"]);
    let (together, bases) = (each(&scene), at_rest(&scene));
    let turning = Turning { free: Vec::new(), ..together.turning() };
    let known = known(&turning);
    let states: usize = turning.nodes.iter().map(Node::states).sum();
    for column in known.iter().copied().filter(|state| *state < states) {
        let (found, _) = slope(|size| {
            let mut before = vec![0.0; turning.size()];
            before[column] = size;
            pushed(&mut peers(&scene, false), &turning, &bases, &vec![0.0; turning.size()], Some(&before))
        });
        // One tick in which no delayed force acts leaves the computed forces those of the state before.
        let mut before = vec![0.0; turning.size()];
        before[column] = 1.0;
        let waiting = turning.computed(&before);
        let linear = turning.reached(&waiting);
        assert!(waiting.iter().any(|entry| *entry != 0.0));
        for row in &known {
            assert!((found[*row] - linear[*row]).abs() < 1e-9, "row {row}, column {column}: {} is not {}", found[*row], linear[*row]);
        }
    }
}

/// Six for no arm, three about one point, one about a line, none about three points; each is left where it is by a frame.
#[test]
fn nothing_resists_what_leaves_the_arms_at_rest() {
    let line = ["peers.b.grasp=[0.01, 0.01, 0.01]", "peers.a.grasp=[0.03, 0.01, 0]", "peers.c.grasp=[-0.01, 0.01, 0.02]"].map(str::to_owned);
    let all = || ["a", "b", "c"].map(arm).to_vec();
    for (overrides, expected) in [(vec![], 6), (vec![arm("c")], 3), (vec![arm("c"), arm("a")], 1), (all(), 0), ([all(), line.to_vec()].concat(), 1)] {
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let scene = scene(&overrides);
        let together = each(&scene);
        assert_eq!(together.free.len(), expected, "{overrides:?}");
        let turning = together.turning();
        for free in &turning.free {
            let moved = turning.displaced(free);
            let reached = turning.reached(&moved);
            // A frame rounds some hundred times, and lengths here are up to about 1.
            assert!(moved.iter().zip(&reached).all(|(moved, reached)| (moved - reached).abs() < 1e-12), "{overrides:?}");
        }
    }
}

/// Loads at rest: hands that pull against each other with 6 and 8 N at three grasp points and twist devices with an attitude, and an arm that holds against all
/// hands.
const LOADS: [&[&str]; 3] = [
    &["peers.a.hand={ force = [3, 1, -4] }", "peers.b.hand={ force = [-5, 2, 1] }", "peers.c.hand={ force = [2, -3, 3] }"],
    &[
        "peers.a.hand={ force = [6, 0, 0] }",
        "peers.b.hand={ force = [-6, 0, 0], torque = [0, 0.02, 0.01] }",
        "peers.b.compute-delay=1",
        "peers.a.compute-delay=1",
        "peers.c.compute-delay=1",
        "peers.c.hand={ arm = { mass = 0.3, damping = 4, stiffness = 100 }, follows = { position = [0.02, 0, 0] } }",
    ],
    &[
        "peers.a.hand={ force = [0, 4, 0] }",
        "peers.b.hand={ force = [0, -4, 0] }",
        "peers.b.contact=grasp",
        "coordination.strategy=proportional-derivative",
    ],
];

/// At the rest under a load no forces are left, and small motions about it are those of real peers: angles between copies are some hundredths.
#[test]
fn about_a_load_the_equations_are_the_linear_part_of_real_peers() {
    for overrides in LOADS {
        let scene = scene(overrides);
        let network = NominalNetwork::of(&scene).unwrap();
        let (together, poses) = loaded(&scene, &network, &Unwatched).unwrap();
        let apart = poses[0].attitude.angle_to(&poses[1].attitude.orientation);
        assert!(apart > 1e-3, "{overrides:?}: {apart}");
        let turning = together.turning();
        // Forces of some newtons are rounded, and move what they act on for a frame.
        let rest = vec![0.0; turning.size()];
        let stays = pushed(&mut peers(&scene, true), &turning, &poses, &rest, scene.peers[0].compute_delay.then_some(&*rest));
        assert!(known(&turning).iter().all(|state| stays[*state].abs() < 1e-11), "{overrides:?}");
        assert!(compare(&scene, &turning, &poses, true) > 1.0);
        for free in &turning.free {
            let moved = turning.displaced(free);
            assert!(moved.iter().zip(turning.reached(&moved)).all(|(moved, reached)| (moved - reached).abs() < 1e-10), "{overrides:?}");
        }
    }
}

/// Three ways along the axes; about the line of two forces the whole may turn; an arm holds all of it.
#[test]
fn a_load_leaves_fewer_displacements_that_nothing_resists() {
    for (overrides, expected) in LOADS.into_iter().zip([3, 0, 4]) {
        let scene = scene(overrides);
        let (together, _) = loaded(&scene, &NominalNetwork::of(&scene).unwrap(), &Unwatched).unwrap();
        assert_eq!(together.free.len(), expected, "{overrides:?}");
    }
    let none = scene(&[]);
    let network = NominalNetwork::of(&none).unwrap();
    assert_eq!(loaded(&none, &network, &Unwatched).unwrap().0.free.len(), 6);
    let (about_load, about_rest) = (analyse_loaded(&none, &Unwatched).unwrap(), analyse(&none, Method::Full, &Unwatched).unwrap());
    assert!((about_load.radius.value - about_rest.radius.value).abs() <= about_load.radius.error + about_rest.radius.error);
}

#[test]
fn without_rest_there_is_no_verdict() {
    for (overrides, why) in [
        (&["peers.a.hand={ force = [1, 0, 0] }"][..], "forces of the hands are left over"),
        (&["peers.b.hand={ force = [0, 0, 0], torque = [0, 0, 0.01] }"], "forces of the hands are left over"),
        (&["peers.a.hand={ sine = { amplitude = [1, 0, 0], frequency = 1 } }"], "the hand of a does not stay"),
        (&["links=[{ from = 'a', to = 'b', loss = 1 }]"], "a link never delivers"),
    ] {
        let error = analyse_loaded(&scene(overrides), &Unwatched).unwrap_err().to_string();
        assert!(error.contains(why), "{overrides:?}: {error}");
    }
}

/// A free body that spins about the axis of its middle moment of inertia departs from the spin as e^(λt), λ = ω·√((J₂ − J₁)(J₃ − J₂)/(J₁J₃)) (Euler 1758). A
/// spin about another principal axis does not depart. Links have no delay here, so that copies with equal states stay equal.
#[test]
fn about_the_middle_axis_a_spin_departs_as_that_of_a_free_body() {
    let [j1, j2, j3] = [1.2e-4, 2.0e-4, 2.6e-4_f64];
    for (axis, inertias) in [([5.0, 0.0, 0.0], None), ([0.0, 5.0, 0.0], Some((j2 - j1) * (j3 - j2) / (j1 * j3))), ([0.0, 0.0, 5.0], None)] {
        let spinning = format!("object.angular-velocity={axis:?}");
        let nobody = ["a", "b", "c"].map(|peer| format!("peers.{peer}.contact=none"));
        let mut overrides = vec![spinning.as_str(), "object.rotational-damping=0", "link.delay=0ms", "coordination.update=1ms"];
        overrides.extend(nobody.iter().map(String::as_str));
        let analysis = analyse_spinning(&scene(&overrides), &Unwatched).unwrap();
        let expected = inertias.map_or(1.0, |squared: f64| libm::exp(5.0 * squared.sqrt() * 1e-3));
        // The step is of fourth order in the angle of a tick, and differences leave 1e-9.
        assert!((analysis.radius.value - expected).abs() < 1e-8, "{axis:?}: {} is not {expected}", analysis.radius.value);
    }
}

/// The torque of one hand turns all copies, and attitudes of old samples brake the spin.
const SPINNING: [&str; 4] = [
    "peers.b.hand={ force = [0, 0, 0], torque = [0, 0, 0.2] }",
    "peers.a.contact=none",
    "peers.c.contact=none",
    "object.rotational-damping=[1e-3, 2e-3, 1.5e-3]",
];

/// Simulated peers that begin with the steady spin keep it over a hundred frames. The directions that the analysis removes are unchanged by a frame.
#[test]
fn a_steady_spin_is_that_of_real_peers() {
    let scene = scene(&SPINNING);
    let network = NominalNetwork::of(&scene).unwrap();
    let spin = Spin::of(&scene, &network, &Unwatched).unwrap();
    assert!((0.5..50.0).contains(&spin.rate), "{}", spin.rate);
    assert!(spin.apart() > 1e-3, "{}", spin.apart());
    spin.assert_steady(&scene);
}

#[test]
fn without_a_steady_spin_there_is_no_verdict() {
    for (overrides, why) in [
        (&[][..], "no hand exerts a torque"),
        (&["peers.a.hand={ force = [1, 0, 0] }"], "the hand of a pushes in one direction"),
        (&["peers.b.hand={ sine = { amplitude = [0, 0, 0], frequency = 1, torque = [0, 0, 0.1] } }"], "varies"),
        (&["links=[{ from = 'a', to = 'b', loss = 1 }]", SPINNING[0]], "a link never delivers"),
        (&["peers.a.compute-delay=1", SPINNING[0]], "a applies forces a tick late"),
        (&[arm("c").as_str(), SPINNING[0]], "the arm of c ties the object to the world"),
    ] {
        let error = analyse_spinning(&scene(overrides), &Unwatched).unwrap_err().to_string();
        assert!(error.contains(why), "{overrides:?}: {error}");
    }
}
