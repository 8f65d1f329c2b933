//! Tasks in whole runs.

use std::fs;
use std::path::Path;

use cohaptic_harness::check::check;
use cohaptic_harness::live::LiveScene;
use cohaptic_harness::measures::{MeasuredRun, Measures};
use cohaptic_harness::record::Recorder;
use cohaptic_harness::{Ending, Model, NoObserver, Simulation, run_side_by_side};
use cohaptic_scene::{Scene, TaskOutcome};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::prelude::*;

use crate::cases;

const SCENE: &str = r#"
    scene = { duration = "2s", seed = 5 }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    peers = [
        { name = "left", hand = { arm = { mass = 0.5, damping = 20.0, stiffness = 300.0 }, follows = { position = 0.1 } } },
        { name = "right" },
    ]
    link = { delay = "24ms", jitter = "3ms", loss = "5%" }
"#;
const REACH: &str = r#"task = { kind = "reach", targets = [0.1, 0.098], radius = 0.01, speed = 0.1, dwell = "20ms" }"#;

fn scene(text: &str) -> Scene {
    Scene::parse(text, Path::new("test.toml"), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Files of a run by name.
fn recorded(scene: &Scene) -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), scene).unwrap();
    let summary = Simulation::new(scene, Model::Least).run(&mut recorder).unwrap();
    let files = recorder.finish(&summary).unwrap();
    files.iter().map(|file| (file.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(file).unwrap())).collect()
}

#[test]
fn a_task_changes_no_byte_of_the_run() {
    let turning = SCENE
        .replace("duration = \"2s\"", "duration = \"2s\", axes = 3")
        .replace("mass = 0.45", "mass = 0.45, inertia = 0.001")
        .replace("position = 0.1", "position = [0.1, 0, 0]");
    let both = "orientations = [[1, 0, 0, 0], [1, 0, 0, 0.1]], angle = 0.2, targets = [[0.1, 0, 0], [0, 0, 0]]";
    for (scene_text, task) in [
        (SCENE, REACH.to_owned()),
        (SCENE, REACH.replace("radius", "order = \"shuffled\", radius")),
        (SCENE, REACH.replace("radius", "who = \"any\", start = \"100ms\", timeout = \"1s\", fail = { force = 20 }, radius")),
        (SCENE, "task = { kind = \"track\", sines = [{ amplitude = 0.02, frequency = 0.5 }], who = \"right\" }".to_owned()),
        (SCENE, "task = { kind = \"hold\", target = 0.1, radius = 0.01, grace = \"100ms\" }".to_owned()),
        (SCENE, "task = { kind = \"path\", points = [0.0, 0.1], width = 0.02 }".to_owned()),
        (SCENE, REACH.replace("reach", "carry").replace("radius", "gap = { peers = [\"left\", \"right\"], max = 0.5 }, radius")),
        (&turning, format!("task = {{ kind = \"reach\", radius = 0.01, {both} }}")),
    ] {
        let without = recorded(&scene(scene_text));
        let with = recorded(&scene(&format!("{scene_text}\n{task}")));
        let is_of_task = |name: &str| name.starts_with("task") || name == "positions.svg";
        let (of_task, others): (Vec<_>, Vec<_>) = with.into_iter().partition(|(name, _)| is_of_task(name));
        let without: Vec<_> = without.into_iter().filter(|(name, _)| !is_of_task(name)).collect();
        assert!(others == without, "a file of the run differs: {task}");
        let names: Vec<&str> = of_task.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["task.csv", "task-events.csv", "positions.svg"]);
    }
}

/// The files of a run that ends at the outcome are the beginnings of those of the run that goes on.
#[test]
fn a_run_that_ends_at_the_outcome_is_a_prefix() {
    for (task, outcome, last) in [
        (REACH.to_owned(), TaskOutcome::Done, None),
        (REACH.replace("radius", "who = \"any\", radius"), TaskOutcome::Done, None),
        (REACH.replace("radius = 0.01", "radius = 0.01, fail = { force = 5 }"), TaskOutcome::Failed, None),
        // The timeout lies on a tick and between two ticks.
        (REACH.replace("radius = 0.01", "radius = 0.00001, timeout = \"300ms\""), TaskOutcome::TimedOut, Some("0.3")),
        (REACH.replace("radius = 0.01", "radius = 0.00001, timeout = \"300500us\""), TaskOutcome::TimedOut, Some("0.3")),
    ] {
        let of = |end: &str| scene(&format!("{SCENE}\n{}", task.replace("radius", &format!("end = \"{end}\", radius"))));
        let (stopping, going_on) = (of("stop"), of("continue"));
        let (stopped, whole) = (recorded(&stopping), recorded(&going_on));
        let text =
            |files: &[(String, Vec<u8>)], name: &str| String::from_utf8(files.iter().find(|(file, _)| file == name).unwrap().1.clone()).unwrap();
        for name in ["trajectory.csv", "packets.csv"] {
            let (part, all) = (text(&stopped, name), text(&whole, name));
            assert!(all.starts_with(&part) && part.len() < all.len(), "{name}: {task}");
        }
        for name in ["task.csv", "task-events.csv"] {
            assert_eq!(text(&stopped, name), text(&whole, name), "{name}: {task}");
        }
        let MeasuredRun { summary, task: Some(result), .. } = Measures::run(&stopping, Model::Least) else { panic!("the scene has a task") };
        assert_eq!((result.outcome, summary.ending, summary.duration), (outcome, Ending::Complete, result.at - Instant::ZERO));
        assert_eq!(Some(&result), Measures::run(&going_on, Model::Least).task.as_ref());
        let trajectory = text(&stopped, "trajectory.csv");
        let last_tick = trajectory.lines().last().unwrap().split(',').next().unwrap();
        let at = result.at.as_secs_f64();
        assert_eq!(last_tick, last.map_or_else(|| at.to_string(), str::to_owned), "{task}");
        // Every engine and a session stop at the same tick.
        let Ok(unwatched) = Simulation::new(&stopping, Model::Least).run(&mut NoObserver);
        let Ok(general) = Simulation::new(&stopping, Model::General).run(&mut NoObserver);
        let Ok(threads) = Simulation::new(&stopping, Model::Least).on_threads(2).run(&mut NoObserver);
        let mut live = LiveScene::new(&stopping, |_| None);
        while let Some(due) = live.poll_timeout() {
            let Ok(()) = live.handle_timeout(due, &mut NoObserver);
        }
        assert_eq!(live.ended(), Some(Ending::Complete));
        let [beside] = &run_side_by_side(std::slice::from_ref(&stopping))[..] else { panic!("one run") };
        for other in [&unwatched, &general, &threads, &live.summary(), beside] {
            assert_eq!(other, &summary, "{task}");
        }
    }
}

/// A run that its task has ended says nothing about later instants, and something about earlier ones.
#[test]
fn what_is_expected_after_the_outcome_is_not_known() {
    let failures = |end: &str, at: &str| {
        let task = REACH.replace("radius", &format!("end = \"{end}\", radius"));
        let expect = format!("expect = {{ position = [{{ peer = \"left\", at = \"{at}\", min = -10.0 }}] }}");
        check(&scene(&format!("{SCENE}\n{task}\n{expect}")), Model::Least, || true)
    };
    for (end, at) in [("continue", "1.9s"), ("continue", "100ms"), ("stop", "100ms")] {
        assert!(failures(end, at).is_empty(), "{:?}", failures(end, at));
    }
    let late = failures("stop", "1.9s");
    assert!(late.len() == 1 && late[0].contains("the run ended at") && late[0].contains("with its task"), "{late:?}");
}

/// A timeout between the end of the scene and the tick that would come next does not make the run longer.
#[test]
fn a_timeout_after_the_end_changes_nothing() {
    let task = REACH.replace("radius = 0.01", "radius = 0.00001, timeout = \"1999700us\", end = \"stop\"");
    let scene = scene(&format!("{SCENE}\n{task}").replace("duration = \"2s\"", "duration = \"1999500us\""));
    let MeasuredRun { summary, task: Some(result), .. } = Measures::run(&scene, Model::Least) else { panic!("the scene has a task") };
    assert_eq!((result.outcome, summary.duration), (TaskOutcome::Unfinished, std::time::Duration::from_micros(1_999_500)));
}

/// Columns `t`, `peer`, `xo` and `vo` of a trajectory.
fn states(trajectory: &[u8]) -> Vec<(f64, usize, f64, f64)> {
    let text = std::str::from_utf8(trajectory).unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |place: usize| cells[place].parse::<f64>().unwrap();
        (number(0), usize::from(cells[1] == "right"), number(4), number(5))
    };
    text.lines().skip(1).map(row).collect()
}

/// Instants at which the targets are reached, read from the definition: the first instant t with every state of [t − dwell, t] within radius and speed, where
/// t − dwell is not before the target before was reached.
fn reached(states: &[(f64, usize, f64, f64)], targets: &[f64], radius: f64, speed: f64, dwell: f64) -> Vec<f64> {
    let mut instants: Vec<f64> = states.iter().map(|state| state.0).collect();
    instants.dedup();
    let mut reached: Vec<f64> = Vec::new();
    for target in targets {
        let begin = reached.last().copied().unwrap_or(0.0);
        let is_there = |t: f64| {
            t - dwell >= begin - 1e-9
                && states
                    .iter()
                    .filter(|state| state.0 >= t - dwell - 1e-9 && state.0 <= t)
                    .all(|(_, _, position, velocity)| (position - target).abs() <= radius && velocity.abs() <= speed)
        };
        match instants.iter().find(|t| is_there(**t)) {
            Some(t) => reached.push(*t),
            None => break,
        }
    }
    reached
}

properties! {
    #![proptest_config(cases(24))]

    /// The judge says what the definition says of the recorded trajectory, over random targets and networks.
    #[test]
    fn the_judge_agrees_with_the_definition(
        seed in any::<u32>(),
        first in 0.0..0.1_f64,
        second in 0.0..0.1_f64,
        radius in 0.002..0.03_f64,
        speed in 0.01..0.5_f64,
        dwell in 0..100_u32,
    ) {
        let keys = format!(r#"task = {{ kind = "reach", targets = [{first}, {second}], radius = {radius}, speed = {speed}, dwell = "{dwell}ms" }}"#);
        let mut scene = scene(&format!("{SCENE}\n{keys}"));
        scene.seed = u64::from(seed);
        let files = recorded(&scene);
        let trajectory = &files.iter().find(|(name, _)| name == "trajectory.csv").unwrap().1;
        let expected = reached(&states(trajectory), &[first, second], radius, speed, f64::from(dwell) * 1e-3);
        let result = Measures::run(&scene, Model::Least).task.unwrap();
        let found: Vec<f64> = result.reached.iter().map(|at| (*at - Instant::ZERO).as_secs_f64()).collect();
        prop_assert_eq!(&found, &expected);
        prop_assert_eq!(result.outcome, if expected.len() == 2 { TaskOutcome::Done } else { TaskOutcome::TimedOut });
    }
}

#[test]
fn measures_of_a_task_are_those_of_the_recorded_rows() {
    let scene =
        scene(&format!("{SCENE}\n{REACH}\nmeasure = {{ names = [\"task_time_s\", \"peers.left.error_rms_m\", \"peers.left.effort_n2_s\"] }}"));
    let files = recorded(&scene);
    let text = |name: &str| String::from_utf8(files.iter().find(|(file, _)| file == name).unwrap().1.clone()).unwrap();
    let values = Measures::run(&scene, Model::Least).values;
    let value = |place: usize| values[place].value.unwrap();
    let events = text("task-events.csv");
    let end: f64 = events.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    assert!(events.ends_with(",,done,2\n"), "{events}");
    // Names are sorted as in the registry.
    assert!((value(0) - end).abs() < 1e-12);
    let reached: f64 = events.lines().find(|line| line.ends_with(",reached,1")).unwrap().split(',').next().unwrap().parse().unwrap();
    let (mut squares, mut effort, mut count) = (0.0, 0.0, 0.0);
    for line in text("trajectory.csv").lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let at: f64 = cells[0].parse().unwrap();
        if cells[1] == "left" && at <= end {
            let target = if at <= reached { 0.1 } else { 0.098 };
            let error = cells[4].parse::<f64>().unwrap() - target;
            let force: f64 = cells[8].parse().unwrap();
            squares += error * error;
            effort += force * force * 1e-3;
            count += 1.0;
        }
    }
    assert!((value(1) - (squares / count).sqrt()).abs() < 1e-12, "{} {}", value(1), (squares / count).sqrt());
    assert!((value(2) / effort - 1.0).abs() < 1e-12);
}

/// Work, forces and shares of the recorded rows, by their definitions: F_C of a tick acts until the next tick of the peer.
#[test]
fn work_and_forces_are_those_of_the_recorded_rows() {
    let of_peer = |name: &str| format!("\"peers.left.{name}\", \"peers.right.{name}\"");
    let [given, taken, share] = ["given_j", "taken_j", "load_share"].map(of_peer);
    let names = format!("\"motion_force_n\", \"internal_force_n\", {given}, {taken}, {share}");
    // The right hand holds the object back.
    let text = SCENE.replace("{ name = \"right\" }", "{ name = \"right\", hand = { arm = { mass = 0.3, damping = 5.0, stiffness = 30.0 } } }");
    let keys = REACH.replace("radius = 0.01", "radius = 0.00001, start = \"100ms\", timeout = \"900ms\"");
    let scene = scene(&format!("{text}\n{keys}\nmeasure = {{ names = [{names}] }}"));
    let files = recorded(&scene);
    let rows: Vec<(f64, usize, f64, f64)> = {
        let text = std::str::from_utf8(&files.iter().find(|(name, _)| name == "trajectory.csv").unwrap().1).unwrap();
        let row = |line: &str| {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |place: usize| cells[place].parse::<f64>().unwrap();
            (number(0), usize::from(cells[1] == "right"), number(2), number(8))
        };
        text.lines().skip(1).map(row).filter(|row| row.0 > 0.0995 && row.0 < 1.0005).collect()
    };
    let [left, right] = [0, 1].map(|peer| rows.iter().filter(|row| row.1 == peer).map(|row| (row.2, row.3)).collect::<Vec<_>>());
    let work = |rows: &[(f64, f64)], sign: f64| -> f64 {
        rows.windows(2).map(|pair| pair[0].1 * (pair[1].0 - pair[0].0)).map(|work| (sign * work).max(0.0)).sum::<f64>() * sign
    };
    let mut expected: Vec<(String, f64)> = Vec::new();
    for (peer, rows) in [("left", &left), ("right", &right)] {
        expected.push((format!("peers.{peer}.given_j"), work(rows, 1.0)));
        expected.push((format!("peers.{peer}.taken_j"), work(rows, -1.0)));
    }
    let count = 901.0;
    let (mut motion, mut internal, mut shares) = (0.0, 0.0, [0.0; 2]);
    for (left, right) in left.iter().zip(&right) {
        let (positive, negative) = (left.1.max(0.0) + right.1.max(0.0), (-left.1).max(0.0) + (-right.1).max(0.0));
        motion += (positive - negative).abs() / count;
        internal += positive.min(negative) / count;
        let along = [left.1, right.1].map(|force| (force * (positive - negative).signum()).max(0.0));
        (0..2).for_each(|peer| shares[peer] += along[peer] / (along[0] + along[1]) / count);
    }
    expected.extend([("motion_force_n".to_owned(), motion), ("internal_force_n".to_owned(), internal)]);
    expected.extend([("peers.left.load_share".to_owned(), shares[0]), ("peers.right.load_share".to_owned(), shares[1])]);
    let values = Measures::run(&scene, Model::Least).values;
    assert_eq!(values.len(), expected.len());
    for (name, expected) in expected {
        let found = values.iter().find(|value| value.name.text(&scene) == name).unwrap().value.unwrap();
        assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{name}: {found}, expected {expected}");
    }
    assert!(left.len() == 901 && right.len() == 901 && work(&left, 1.0) > 0.0 && work(&right, -1.0) < 0.0 && internal > 0.0 && shares[1] > 0.0);
}

#[test]
fn only_a_done_task_has_a_time() {
    let time = |timeout: &str| {
        let task = REACH.replace("radius", &format!("timeout = \"{timeout}\", radius"));
        Measures::run(&scene(&format!("{SCENE}\n{task}\nmeasure = {{ names = [\"task_time_s\"] }}")), Model::Least).values[0].value
    };
    assert!(time("2s").is_some() && time("100ms").is_none());
}

/// A run in which copies are a metre apart has diverged, also if its numbers are finite, and so has its task.
#[test]
fn the_task_of_a_run_that_diverges_is_not_merely_late() {
    let outcome = |stiffness: &str| {
        let text = format!("{SCENE}\n{REACH}").replace("stiffness = 1000.0", &format!("stiffness = {stiffness}"));
        let scene = scene(&text);
        let run = Measures::run(&scene, Model::Least);
        (run.summary.has_diverged(), run.task.unwrap().outcome)
    };
    assert_eq!(outcome("1000.0"), (false, TaskOutcome::Done));
    assert_eq!(outcome("8000.0"), (true, TaskOutcome::Diverged));
}
