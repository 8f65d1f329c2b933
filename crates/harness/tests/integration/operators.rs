//! Operators in whole runs. Expected times and errors come from a program that shares no code with this one: a simulation in Python, with its own matrix
//! exponential, judge, law and random numbers.

use std::convert::Infallible;
use std::path::Path;

use cohaptic_harness::measures::Measures;
use cohaptic_harness::record::Recorder;
use cohaptic_harness::{Model, NoObserver, Observer, Simulation, TickRow};
use cohaptic_scene::{Scene, TaskOutcome};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::prelude::*;

use crate::cases;

/// Two peers, of which the first has an operator.
const SCENE: &str = r#"
    scene = { duration = "10s" }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    peers = [{ name = "left", hand = { operator = { noise = 0.0 } } }, { name = "right" }]
    link = { delay = "24ms" }
    task = { kind = "reach", targets = [0.1], radius = 0.005, speed = 0.02, dwell = "200ms" }
"#;
/// Keys of a target there and another back.
const BACK: &str = "task.targets=[0.1, 0.0]";

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(SCENE, Path::new("test.toml"), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the instants at which the targets are reached \[ms\].
fn reached(scene: &Scene) -> Vec<u128> {
    let result = Measures::run(scene, Model::Least).task.unwrap();
    result.reached.iter().map(|at| (*at - Instant::ZERO).as_millis()).collect()
}

#[test]
fn operators_reach_targets_when_the_other_program_says() {
    const SECOND: &str = "peers.left.hand.operator.sees=right";
    for (overrides, expected) in [
        (&[][..], &[2821][..]),
        (&[SECOND, "peers.left.hand.operator.expects=0s"], &[3267]),
        (&[SECOND, "peers.left.hand.operator.expects=24ms"], &[2949]),
        (&["peers.left.hand.operator.step=0.02"], &[4369]),
        (
            &[
                SECOND,
                "peers.left.hand.operator.step=0.02",
                "peers.left.hand.operator.expects=100ms",
                "coordination.stiffness=200",
                "link.delay=100ms",
            ],
            &[4294],
        ),
        (&[SECOND, "peers.left.hand.operator.expects=0s", "coordination.stiffness=50", "link.delay=300ms"], &[]),
        (&[BACK], &[2821, 5643]),
        (&[BACK, "peers.left.hand.operator.step=0.03"], &[3711, 8493]),
        (&[BACK, "peers.left.hand.operator.speed=0.4"], &[3223, 6366]),
        (&[BACK, SECOND], &[2946, 5917]),
        (&[BACK, SECOND, "peers.left.hand.operator.step=0.03", "peers.left.hand.operator.speed=0.2"], &[4013, 7721]),
        (&[BACK, "peers.left.hand.operator.noise=0.1"], &[2839, 5551]),
        (&[BACK, "peers.left.hand.operator.noise=0.1", "scene.seed=7"], &[2685, 5723]),
        (&[BACK, SECOND, "peers.left.hand.operator.noise=0.1", "scene.seed=7"], &[2830, 6028]),
    ] {
        assert_eq!(reached(&scene(overrides)), expected, "{overrides:?}");
    }
}

/// The closed form holds for a perfect arm; in the scene the error is larger.
#[test]
fn crossover_has_the_error_that_the_other_program_finds() {
    let sines = "{ amplitude = 0.02, frequency = 0.1 }, { amplitude = 0.015, frequency = 0.17 }, { amplitude = 0.01, frequency = 0.29 }, \
                 { amplitude = 0.006, frequency = 0.43 }, { amplitude = 0.004, frequency = 0.61 }";
    let task = format!("task={{ kind = \"track\", sines = [{sines}] }}");
    let names = "measure={ names = [\"peers.left.error_rms_m\", \"peers.right.error_rms_m\"] }";
    let scene = scene(&["peers.left.hand.operator={}", &task, "scene.duration=25s", names]);
    let values = Measures::run(&scene, Model::Least).values;
    for (value, expected) in values.iter().zip([13.518_128_552e-3, 14.146_200_964e-3]) {
        assert!((value.value.unwrap() - expected).abs() < 1e-11, "{:?}", value.value);
    }
}

/// Bytes of all files of a run.
fn recorded(scene: &Scene, model: Model) -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), scene).unwrap();
    let summary = Simulation::new(scene, model).run(&mut recorder).unwrap();
    let files = recorder.finish(&summary).unwrap();
    files.iter().map(|file| (file.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(file).unwrap())).collect()
}

properties! {
    #![proptest_config(cases(16))]

    /// A loop in which all peers tick together, a loop with an event for each tick, and a run that nobody watches move operators alike, to the bit.
    #[test]
    fn every_way_of_running_moves_operators_alike(
        axes in 1_usize..4,
        seed in any::<u16>(),
        sees in prop::sample::select(vec!["own", "right"]),
        tracks in any::<bool>(),
        start in 0_u32..300,
        noise in 0.0..0.3_f64,
    ) {
        let vector = |value: f64| format!("{:?}", vec![value; axes]);
        let (task, operator) = if tracks {
            (format!("task={{ kind = \"track\", sines = [{{ amplitude = {}, frequency = 0.5 }}], start = \"{start}ms\" }}", vector(0.02)), String::new())
        } else {
            let targets = format!("[{}, {}]", vector(0.02), vector(0.0));
            (format!("task={{ kind = \"reach\", targets = {targets}, radius = 0.01, start = \"{start}ms\" }}"), format!(", noise = {noise}"))
        };
        let operator = format!("peers.left.hand={{ operator = {{ sees = \"{sees}\"{operator} }} }}");
        let other = "peers.right.hand={ operator = {} }";
        let overrides = [format!("scene.axes={axes}"), format!("scene.seed={seed}"), task, operator, other.to_owned(), "link.jitter=3ms".to_owned(), "scene.duration=2s".to_owned()];
        let scene = scene(&overrides.iter().map(String::as_str).collect::<Vec<_>>());
        let least = recorded(&scene, Model::Least);
        prop_assert!(least == recorded(&scene, Model::General), "a file differs");
        let watched = Measures::run(&scene, Model::Least).summary;
        let Ok(alone) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
        prop_assert_eq!(&watched, &alone);
        prop_assert!(alone.peers[0].position[0] != 0.0, "nobody moved");
    }
}

/// Positions of the device of one peer.
struct DeviceOf(usize, Vec<u64>);

impl Observer for DeviceOf {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if row.peer == self.0 {
            self.1.extend(row.device.position.iter().map(|position| position.to_bits()));
        }
        Ok(())
    }
}

/// The noise of a movement follows from the seed, the name of the peer, the axis and the number of the movement, and from nothing else: other peers, links with
/// chance and the place in the list change nothing. A person whose device touches nothing moves again and again, because the seen copy stays where it is.
#[test]
fn noise_has_the_address_of_the_movement() {
    let device = |peers: &str, more: &[&str]| {
        let peers = format!("peers=[{peers}]");
        let scene = scene(&[&[peers.as_str(), "scene.axes=2", "task.targets=[[0.1, 0.0]]", "scene.seed=3"], more].concat());
        let mut device = DeviceOf(scene.peer_index("left").unwrap(), Vec::new());
        let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut device);
        device.1
    };
    let left = "{ name = \"left\", contact = \"none\", hand = { operator = {} } }";
    let still = device(&format!("{}, {{ name = \"right\" }}", left.replace("{}", "{ noise = 0 }")), &[]);
    let alone = device(&format!("{left}, {{ name = \"right\" }}"), &[]);
    let others = "{ name = \"right\" }, { name = \"third\", contact = \"none\", hand = { operator = { noise = 0.3 } } }";
    assert_eq!(alone, device(&format!("{others}, {left}"), &["link.jitter=5ms", "link.loss=10%"]));
    // Noise of different numbers moves the device along both axes, as seen after the first movement. Another seed has other numbers.
    let at = |device: &[u64], axis: usize| f64::from_bits(device[2 * 700 + axis]);
    let noise = [0, 1].map(|axis| at(&alone, axis) - at(&still, axis));
    assert!(noise[0].abs() > 1e-6 && noise[1].abs() > 1e-6 && (noise[0] - noise[1]).abs() > 1e-6, "{noise:?}");
    assert!(alone != device(&format!("{left}, {{ name = \"right\" }}"), &["scene.seed=4"]));
}

/// An operator is asked for nothing before the task begins, and then begins as if the scene began there.
#[test]
fn an_operator_waits_for_the_task() {
    let from = |start: &str| reached(&scene(&[&format!("task.start={start}"), BACK]));
    let later: Vec<u128> = from("0s").iter().map(|at| at + 1504).collect();
    // 1504 ms is a whole number of periods of sending, so samples go at the same ticks of the task.
    assert_eq!(from("1504ms"), later);
}

/// Positions of the device of a peer.
fn device_of(scene: &Scene, peer: usize) -> Vec<f64> {
    let mut device = DeviceOf(peer, Vec::new());
    let Ok(_) = Simulation::new(scene, Model::Least).run(&mut device);
    device.1.into_iter().map(f64::from_bits).collect()
}

/// Before the first movement, and without need of a movement, the arm holds the device where the scene begins.
#[test]
fn an_operator_at_the_target_rests() {
    let scene = scene(&["object.position=0.1", "scene.duration=2s", "task.start=300ms"]);
    let device = device_of(&scene, 0);
    assert!(device.iter().all(|position| (position - 0.1).abs() < 1e-12), "{device:?}");
}

/// Without noise a person on a path makes a movement to its end, as for a target there.
#[test]
fn a_path_without_noise_is_a_target_at_its_end() {
    let device = |task: &str| device_of(&scene(&[&format!("task={{ {task} }}"), "scene.duration=3s"]), 0);
    let path = device(r#"kind = "path", points = [0.0, 0.04, 0.1], width = 0.02"#);
    let target = device(r#"kind = "reach", targets = [0.1, 0.1], radius = 1e-300"#);
    assert!(path == target && path.iter().any(|position| *position > 0.09));
}

/// Copies that hardly act on each other, each judged alone: a person who reacts 100 ms later moves 100 ms later, for the targets of the own copy.
#[test]
fn each_operator_goes_for_the_target_of_the_own_copy() {
    let later = r#"peers.right.hand={ operator = { noise = 0.0, reaction = "350ms" } }"#;
    let scene = scene(&["task.who=any", "task.targets=[0.1, 0.0, 0.1]", "coordination.stiffness=1e-9", "coordination.damping=0", later]);
    let reached = reached(&scene);
    let [left, right] = [0, 1].map(|peer| device_of(&scene, peer));
    // The task ends when the left copy is at the third target.
    let end = usize::try_from(reached[2]).unwrap();
    for tick in 0..end - 100 {
        assert!((right[tick + 100] - left[tick]).abs() < 1e-6, "{tick}: {} {}", right[tick + 100], left[tick]);
    }
}

#[test]
fn an_operator_of_an_unjudged_peer_goes_for_the_same_targets() {
    // The right copy alone is judged, and is moved by the left hand.
    let scene = scene(&[BACK, "task.who=right"]);
    assert_eq!(Measures::run(&scene, Model::Least).task.unwrap().outcome, TaskOutcome::Done);
}
