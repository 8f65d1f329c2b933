//! The linear equations against real peers that turn.

use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_peer::{Device as _, Hand, Held, ObjectCopy, Peer, Signal, SimulatedDevice, State};
use cohaptic_scene::{FromScene, Scene, Strategies};
use cohaptic_units::Instant;

use super::*;
use crate::timetable::{Event, Instants};

type Member = Peer<3, SimulatedDevice<3>, BuiltInStrategy<3>>;

/// What every clock shows when a frame begins \[ns\].
const EARLIER: i64 = 1 << 60;

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

/// The peers; arms hold their devices where they begin, but `loaded` hands do what the scene says.
fn members(scene: &Scene, loaded: bool) -> Vec<Member> {
    let member = |place: usize| {
        let spec = &scene.peers[place];
        let grasp = scene.rotation.as_ref().unwrap().peers[place].grasp;
        let rests = || spec.hand.as_ref().and_then(Hand::arm).map(|arm| Hand::Arm { arm, follows: Signal::Constant(grasp) });
        let hand = if loaded { spec.hand.clone() } else { rests() };
        let device = SimulatedDevice::new(spec.device, hand.as_ref(), State::REST, scene.integrator, &spec.clock);
        let object = ObjectCopy::new(scene.copy_config(place), State::REST, scene.integrator, &spec.clock);
        let held = Held::new((1..scene.peers.len()).map(|_| State::REST));
        Peer::new(scene.peer_config(place), device, object, FromScene.strategy(scene, place), held).with_rotation(scene.rotation_of(place).unwrap())
    };
    (0..scene.peers.len()).map(member).collect()
}

/// Where peers begin without a load: copies at the origin, devices at their grasp points.
fn at_rest(scene: &Scene) -> Vec<Pose> {
    let grasps = scene.rotation.as_ref().unwrap().peers.iter().map(|peer| peer.grasp);
    grasps.map(|device| Pose { centre: [0.0; 3], attitude: Attitude::REST, device, handle: Attitude::REST }).collect()
}

fn body(base: Triple, position: &[f64], velocity: &[f64], time: f64) -> State<3> {
    State { position: std::array::from_fn(|axis| base[axis] + position[axis]), velocity: std::array::from_fn(|axis| velocity[axis] / time) }
}

fn attitude(base: &Attitude, angle: &[f64], rate: &[f64], length: f64, time: f64) -> Attitude {
    let mut attitude = Attitude { rate: std::array::from_fn(|axis| rate[axis] / length / time), ..*base };
    attitude.turn(std::array::from_fn(|axis| angle[axis] / length));
    attitude
}

/// The rotation vector from one attitude to another, in the body axes of the first.
fn angle(base: &Attitude, attitude: &Attitude) -> Triple {
    let ([w, x, y, z], [a, b, c, d]) = (base.orientation, attitude.orientation);
    let relative = [w * a + x * b + y * c + z * d, w * b - x * a - y * d + z * c, w * c - y * a - z * b + x * d, w * d - z * a - x * c + y * b];
    Attitude { orientation: relative, rate: [0.0; 3] }.rotation_vector()
}

fn copy_of(z: &[f64], base: &Pose, node: &Node, time: f64) -> (State<3>, Attitude) {
    (body(base.centre, z, &z[6..], time), attitude(&base.attitude, &z[3..], &z[9..], node.length, time))
}

fn write(z: &mut [f64], base: &Pose, node: &Node, time: f64, (state, attitude): (&State<3>, &Attitude)) {
    let turned = angle(&base.attitude, attitude);
    for axis in 0..3 {
        (z[axis], z[6 + axis]) = (state.position[axis] - base.centre[axis], state.velocity[axis] * time);
        (z[3 + axis], z[9 + axis]) = (turned[axis] * node.length, attitude.rate[axis] * node.length * time);
    }
}

fn put(members: &mut [Member], turning: &Turning<'_>, bases: &[Pose], z: &[f64]) {
    let mut first = 0;
    for ((member, node), base) in members.iter_mut().zip(turning.nodes).zip(bases) {
        let (z, time, devices) = (&z[first..], turning.time, node.device.len());
        first += node.states();
        let (state, turned) = copy_of(z, base, node, time);
        member.object_mut().set_state(state);
        member.device_mut().set_state(body(base.device, &z[12..], &z[12 + devices..], time));
        let rotation = member.rotation_mut().unwrap();
        rotation.set_copy(turned);
        if devices == 6 {
            rotation.set_device(attitude(&base.handle, &z[15..], &z[15 + devices..], node.length, time));
        }
        member.set_local_time(Instant::from_nanos(EARLIER.unsigned_abs()));
    }
}

/// Where a frame leads real peers, with the numbers of [`Turning`]. Forces that wait are those that peers compute `before`, if they do; at the end they are left at zero.
fn pushed(members: &mut [Member], turning: &Turning<'_>, bases: &[Pose], z: &[f64], before: Option<&[f64]>) -> Vec<f64> {
    let (nodes, time, timetable) = (turning.nodes, turning.time, turning.timetable);
    let firsts: Vec<usize> = (0..nodes.len()).map(|place| nodes[..place].iter().map(Node::states).sum()).collect();
    if let Some(before) = before {
        for (to, member) in members.iter_mut().enumerate() {
            for (other, base) in bases.iter().enumerate().filter(|(other, _)| *other != to).map(|(_, base)| base).enumerate() {
                member.hold(other, Instant::ZERO, State { position: base.centre, velocity: [0.0; 3] });
                member.rotation_mut().unwrap().hold(other, &base.attitude);
            }
        }
        put(members, turning, bases, before);
        for member in members.iter_mut() {
            member.compute(Instant::ZERO);
        }
    }
    put(members, turning, bases, z);
    let mut next: usize = nodes.iter().map(Node::states).sum();
    let mut samples = Vec::new();
    for ((node, base), depth) in nodes.iter().zip(bases).zip(&timetable.depth) {
        let earlier = z[next..next + depth * 12].chunks_exact(12).map(|sample| copy_of(sample, base, node, time));
        samples.push(earlier.rev().collect::<Vec<_>>());
        next += depth * 12;
    }
    let instants = Instants::of(timetable, nodes.len());
    let hold = |members: &mut [Member], samples: &[Vec<(State<3>, Attitude)>], (to, from, sample): (usize, usize, i64)| {
        let (state, attitude) = samples[from][usize::try_from(i64::try_from(timetable.depth[from]).unwrap() + sample).unwrap()];
        let sent = Instant::from_nanos((EARLIER + instants.sent_at(from, sample, timetable.frame)).unsigned_abs());
        let other = if from < to { from } else { from - 1 };
        members[to].hold(other, sent, state);
        members[to].rotation_mut().unwrap().hold(other, &attitude);
    };
    timetable.held.iter().for_each(|held| hold(members, &samples, *held));
    for event in &timetable.events {
        match *event {
            Event::Sample { node } => {
                let sample = (*members[node].object().state(), *members[node].rotation().unwrap().copy());
                samples[node].push(sample);
            }
            Event::Deliver { from, to, sample } => hold(members, &samples, (to, from, sample)),
            Event::Tick { node, at, span } => {
                members[node].compute(Instant::from_nanos(at));
                members[node].advance(Instant::from_nanos(at), span);
            }
        }
    }
    let mut reached = vec![0.0; z.len()];
    for (place, member) in members.iter().enumerate() {
        let (node, base, out) = (&nodes[place], &bases[place], &mut reached[firsts[place]..]);
        let rotation = member.rotation().unwrap();
        write(out, base, node, time, (member.object().state(), rotation.copy()));
        let (state, devices) = (member.device().state(), node.device.len());
        for axis in 0..3 {
            (out[12 + axis], out[12 + devices + axis]) = (state.position[axis] - base.device[axis], state.velocity[axis] * time);
            if let Some(device) = rotation.device() {
                let turned = angle(&base.handle, device)[axis] * node.length;
                (out[15 + axis], out[15 + devices + axis]) = (turned, device.rate[axis] * node.length * time);
            }
        }
    }
    let mut next: usize = nodes.iter().map(Node::states).sum();
    for (((node, base), samples), depth) in nodes.iter().zip(bases).zip(&samples).zip(&timetable.depth) {
        for (state, attitude) in samples.iter().rev().take(*depth) {
            write(&mut reached[next..], base, node, time, (state, attitude));
            next += 12;
        }
    }
    reached
}

/// The states that are no forces that wait.
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

/// Central differences over ±e and ±e/2, taken together for an error of order e⁴.
fn slope(at: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let over = |size: f64| -> Vec<f64> { at(size).iter().zip(at(-size)).map(|(up, down)| (up - down) / (2.0 * size)).collect() };
    over(2e-5).iter().zip(over(1e-5)).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect()
}

/// Compares all columns but those of forces that wait, and gives the largest entry.
fn compare(scene: &Scene, turning: &Turning<'_>, bases: &[Pose], loaded: bool) -> f64 {
    let known = known(turning);
    let mut largest = 0.0_f64;
    for column in &known {
        let found = slope(|size| {
            let mut z = vec![0.0; turning.size()];
            z[*column] = size;
            // What each computes before at rest waits as at rest.
            let rest = vec![0.0; z.len()];
            pushed(&mut members(scene, loaded), turning, bases, &z, scene.peers[0].compute_delay.then_some(&*rest))
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

/// Steps are the length 2·10⁻⁵ m. Angles are below 2·10⁻³ rad, whose fourth power is 1.6·10⁻¹¹; a rounding of a position of 4 cm, over e, is 10⁻¹³, and a frame has some
/// hundred of them. Entries are up to about 3.
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

/// Forces and torques that wait are those that peers have computed where they were: there they are moved by every way at once, and what a frame makes of it at rest is
/// compared.
#[test]
fn forces_that_wait_are_those_of_real_peers() {
    let scene = scene(&["peers.a.compute-delay=1", "peers.b.compute-delay=1", "peers.c.compute-delay=1"]);
    let (together, bases) = (each(&scene), at_rest(&scene));
    let turning = Turning { free: Vec::new(), ..together.turning() };
    let known = known(&turning);
    let states: usize = turning.nodes.iter().map(Node::states).sum();
    for column in known.iter().copied().filter(|state| *state < states) {
        let found = slope(|size| {
            let mut before = vec![0.0; turning.size()];
            before[column] = size;
            pushed(&mut members(&scene, false), &turning, &bases, &vec![0.0; turning.size()], Some(&before))
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

/// Hands that pull against each other, by 6 and 8 N at three grasp points, and twist devices that turn; an arm holds against all of them.
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
        let (together, poses) = loaded(&scene, &network).unwrap();
        let apart = poses[0].attitude.angle_to(&poses[1].attitude.orientation);
        assert!(apart > 1e-3, "{overrides:?}: {apart}");
        let turning = together.turning();
        // Forces of some newtons are rounded, and move what they act on for a frame.
        let rest = vec![0.0; turning.size()];
        let stays = pushed(&mut members(&scene, true), &turning, &poses, &rest, scene.peers[0].compute_delay.then_some(&*rest));
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
        let (together, _) = loaded(&scene, &NominalNetwork::of(&scene).unwrap()).unwrap();
        assert_eq!(together.free.len(), expected, "{overrides:?}");
    }
    let none = scene(&[]);
    let network = NominalNetwork::of(&none).unwrap();
    assert_eq!(loaded(&none, &network).unwrap().0.free.len(), 6);
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
