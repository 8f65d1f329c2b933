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

fn members(scene: &Scene) -> Vec<Member> {
    let member = |place: usize| {
        let spec = &scene.peers[place];
        let grasp = scene.rotation.as_ref().unwrap().peers[place].grasp;
        let hand = spec.hand.as_ref().and_then(Hand::arm).map(|arm| Hand::Arm { arm, follows: Signal::Constant(grasp) });
        let device = SimulatedDevice::new(spec.device, hand.as_ref(), State::REST, scene.integrator, &spec.clock);
        let object = ObjectCopy::new(scene.copy_config(place), State::REST, scene.integrator, &spec.clock);
        let held = Held::new((1..scene.peers.len()).map(|_| State::REST));
        Peer::new(scene.peer_config(place), device, object, FromScene.strategy(scene, place), held).with_rotation(scene.rotation_of(place).unwrap())
    };
    (0..scene.peers.len()).map(member).collect()
}

fn body(position: &[f64], velocity: &[f64], time: f64) -> State<3> {
    State { position: std::array::from_fn(|axis| position[axis]), velocity: std::array::from_fn(|axis| velocity[axis] / time) }
}

fn attitude(angle: &[f64], rate: &[f64], length: f64, time: f64) -> Attitude {
    let mut attitude = Attitude { rate: std::array::from_fn(|axis| rate[axis] / length / time), ..Attitude::REST };
    attitude.turn(std::array::from_fn(|axis| angle[axis] / length));
    attitude
}

/// The rotation vector of an attitude.
fn angle(attitude: &Attitude) -> Triple {
    let [w, x, y, z] = attitude.orientation;
    let size = x.hypot(y).hypot(z);
    [x, y, z].map(|component| if size > 0.0 { 2.0 * component / size * size.atan2(w) } else { 0.0 })
}

fn copy_of(z: &[f64], node: &Node, time: f64) -> (State<3>, Attitude) {
    (body(z, &z[6..], time), attitude(&z[3..], &z[9..], node.length, time))
}

fn write(z: &mut [f64], node: &Node, time: f64, (state, attitude): (&State<3>, &Attitude)) {
    let turned = angle(attitude);
    for axis in 0..3 {
        (z[axis], z[6 + axis]) = (state.position[axis], state.velocity[axis] * time);
        (z[3 + axis], z[9 + axis]) = (turned[axis] * node.length, attitude.rate[axis] * node.length * time);
    }
}

/// Where a frame leads real peers, with the numbers of [`Turning`]; forces that wait are left at zero.
fn pushed(scene: &Scene, turning: &Turning<'_>, z: &[f64]) -> Vec<f64> {
    let (nodes, time, timetable) = (turning.nodes, turning.time, turning.timetable);
    let firsts: Vec<usize> = (0..nodes.len()).map(|place| nodes[..place].iter().map(Node::states).sum()).collect();
    let mut members = members(scene);
    let grasps: Vec<Triple> = nodes.iter().map(|node| node.grasp).collect();
    for (place, member) in members.iter_mut().enumerate() {
        let (node, z) = (&nodes[place], &z[firsts[place]..]);
        let (state, turned) = copy_of(z, node, time);
        member.object_mut().set_state(state);
        let devices = node.device.len();
        let mut device = body(&z[12..], &z[12 + devices..], time);
        (0..3).for_each(|axis| device.position[axis] += grasps[place][axis]);
        member.device_mut().set_state(device);
        let rotation = member.rotation_mut().unwrap();
        rotation.set_copy(turned);
        if devices == 6 {
            rotation.set_device(attitude(&z[15..], &z[15 + devices..], node.length, time));
        }
        member.set_local_time(Instant::from_nanos(EARLIER.unsigned_abs()));
    }
    let mut next: usize = nodes.iter().map(Node::states).sum();
    let mut samples = Vec::new();
    for (node, depth) in nodes.iter().zip(&timetable.depth) {
        let earlier = z[next..next + depth * 12].chunks_exact(12).map(|sample| copy_of(sample, node, time));
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
    timetable.held.iter().for_each(|held| hold(&mut members, &samples, *held));
    for event in &timetable.events {
        match *event {
            Event::Sample { node } => {
                let sample = (*members[node].object().state(), *members[node].rotation().unwrap().copy());
                samples[node].push(sample);
            }
            Event::Deliver { from, to, sample } => hold(&mut members, &samples, (to, from, sample)),
            Event::Tick { node, at, span } => {
                members[node].compute(Instant::from_nanos(at));
                members[node].advance(Instant::from_nanos(at), span);
            }
        }
    }
    let mut reached = vec![0.0; z.len()];
    for (place, member) in members.iter().enumerate() {
        let (node, out) = (&nodes[place], &mut reached[firsts[place]..]);
        let rotation = member.rotation().unwrap();
        write(out, node, time, (member.object().state(), rotation.copy()));
        let (state, devices) = (member.device().state(), node.device.len());
        for axis in 0..3 {
            (out[12 + axis], out[12 + devices + axis]) = (state.position[axis] - grasps[place][axis], state.velocity[axis] * time);
            if let Some(device) = rotation.device() {
                (out[15 + axis], out[15 + devices + axis]) = (angle(device)[axis] * node.length, device.rate[axis] * node.length * time);
            }
        }
    }
    let mut next: usize = nodes.iter().map(Node::states).sum();
    for ((node, samples), depth) in nodes.iter().zip(&samples).zip(&timetable.depth) {
        for (state, attitude) in samples.iter().rev().take(*depth) {
            write(&mut reached[next..], node, time, (state, attitude));
            next += 12;
        }
    }
    reached
}

/// Central differences over ±e and ±e/2, e the length 2·10⁻⁵ m, taken together so that what is left is of order e⁴. Angles are below 2·10⁻³ rad, whose fourth power
/// is 1.6·10⁻¹¹; a rounding of a position of 4 cm, over e, is 10⁻¹³, and a frame has some hundred of them. Entries are up to about 3.
#[test]
fn the_equations_are_the_linear_part_of_real_peers() {
    for more in [
        &[][..],
        &["coordination.strategy=proportional-derivative", "coordination.scaling=inverse-n", "object.split-mass=true"],
        &["coordination.strategy=extrapolated", "simulation.integrator=rk4", "simulation.rotation-steps=2"],
        &["simulation.integrator=semi-implicit-euler", "simulation.rotation-steps=3", "peers.b.contact=none"],
        &["peers.a.compute-delay=1", "peers.b.compute-delay=1"],
    ] {
        let scene = scene(&[&[arm("c").as_str()], more].concat());
        let network = NominalNetwork::of(&scene).unwrap();
        let structure = Structure::of_each(&scene, &network, &contacts(&scene).unwrap()).unwrap();
        let nodes: Vec<Node> = (0..3).map(|place| Node::of(&scene, place)).collect();
        let turning = Turning { nodes: &nodes, weights: &structure.weights, timetable: &structure.timetable, time: 0.01, free: Vec::new() };
        let waits = |state: usize| {
            let mut first = 0;
            nodes.iter().any(|node| {
                let place = state.checked_sub(first);
                first += node.states();
                place.is_some_and(|place| (12 + 2 * node.device.len()..node.states()).contains(&place))
            })
        };
        let known: Vec<usize> = (0..turning.size()).filter(|state| !waits(*state)).collect();
        let mut largest = 0.0_f64;
        for column in &known {
            let at = |size: f64| {
                let mut z = vec![0.0; turning.size()];
                z[*column] = size;
                pushed(&scene, &turning, &z)
            };
            let slope = |size: f64| -> Vec<f64> { at(size).iter().zip(at(-size)).map(|(up, down)| (up - down) / (2.0 * size)).collect() };
            let (coarse, fine) = (slope(2e-5), slope(1e-5));
            let mut unit = vec![0.0; turning.size()];
            unit[*column] = 1.0;
            let linear = turning.pushed(&unit, &mut 0.0);
            for row in &known {
                let found = (4.0 * fine[*row] - coarse[*row]) / 3.0;
                assert!((found - linear[*row]).abs() < 1e-9, "{more:?}, row {row}, column {column}: {found} is not {}", linear[*row]);
                largest = largest.max(found.abs());
            }
        }
        assert!((1.0..10.0).contains(&largest), "{largest}");
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
        let network = NominalNetwork::of(&scene).unwrap();
        let structure = Structure::of_each(&scene, &network, &contacts(&scene).unwrap()).unwrap();
        let nodes: Vec<Node> = (0..3).map(|place| Node::of(&scene, place)).collect();
        let free = rigid::displacements(&nodes);
        assert_eq!(free.len(), expected, "{overrides:?}");
        let turning = Turning { nodes: &nodes, weights: &structure.weights, timetable: &structure.timetable, time: 0.01, free };
        for free in &turning.free {
            let moved = turning.displaced(&free.copy);
            let reached = turning.pushed(&moved, &mut 0.0);
            // A frame rounds some hundred times, and lengths here are up to about 1.
            assert!(moved.iter().zip(&reached).all(|(moved, reached)| (moved - reached).abs() < 1e-12), "{overrides:?}");
        }
    }
}
