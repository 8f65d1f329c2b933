//! A prediction of the time that people need for a task over a bad network, and its comparison with a published table: the numbers of `docs/prediction.md`.
//!
//! One number of the scene is fitted to one row of the table. Everything else follows from the scene, which the test runs in every condition of the study. The
//! page shows what comes out, also where the prediction fails: this test compares numbers with the page, and never the prediction with people.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "counts and small whole numbers"
)]

mod page;
mod statistics;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use cohaptic_harness::Model;
use cohaptic_harness::measures::Measures;
use cohaptic_scene::{Scene, TaskOutcome};

/// Number of runs of each condition, with the seeds 1, 2, ….
const RUNS: usize = 100;
/// Least duration T of a movement \[s\].
const MOVE: f64 = 0.25;
/// Time of the row to which the step is fitted \[s\].
const NORMAL: f64 = 22.1;

/// A condition of the study: a link from the surgeon to the robot.
struct Condition {
    name: &'static str,
    /// Mean time of a transfer by the people of the study \[s\]; `None` if nobody tried the condition.
    people: Option<f64>,
    link: String,
}

/// Times of the runs of a condition.
struct Times {
    /// Times of the transfers that were done \[s\], in the order of seeds.
    done: Vec<f64>,
}

impl Times {
    fn mean(&self) -> f64 {
        statistics::mean(&self.done)
    }
}

fn condition(name: &'static str, people: Option<f64>, link: impl Into<String>) -> Condition {
    Condition { name, people, link: link.into() }
}

/// Link that loses the fraction `loss` of all samples, in runs of `run` samples on average.
fn bursts(loss: f64, run: f64) -> String {
    let (leave, enter) = (1.0 / run, loss / (run * (1.0 - loss)));
    format!("loss = {{ gilbert-elliott = {{ p = {enter:.6}, r = {leave:.6} }} }}")
}

/// Link that is up for `up` and then down for at most `most`, both in steps of `unit` milliseconds.
fn outages(up: u64, most: u64, unit: u64) -> String {
    format!("outage = {{ random = {{ up = {{ fixed = \"{}ms\" }}, down = {{ uniform = [\"0ms\", \"{}ms\"] }} }} }}", up * unit, most * unit)
}

/// Conditions of the study, in the order of its table. `unit`: milliseconds of a step in which the settings of outages count.
fn study(unit: u64) -> Vec<Condition> {
    vec![
        condition("normal", Some(NORMAL), ""),
        condition("loss 10 %", Some(24.4), bursts(0.099, 1.40)),
        condition("loss 30 %", Some(26.6), bursts(0.302, 1.76)),
        condition("loss 50 %", Some(36.2), bursts(0.502, 2.43)),
        condition("delay 100 ms", Some(27.1), "delay = \"100ms\""),
        condition("delay 300 ms", Some(34.1), "delay = \"299ms\""),
        condition("delay 500 ms", Some(47.9), "delay = \"500ms\""),
        condition("outages 10 %", Some(28.9), outages(8500, 3000, unit)),
        condition("outages 30 %", Some(47.4), outages(1000, 1000, unit)),
        condition("outages 50 %", Some(64.3), outages(1000, 2000, unit)),
    ]
}

/// Mean delays of a second study, of which nothing but these delays was read before its times were predicted.
fn second_study() -> Vec<Condition> {
    [("77 ms", 77), ("354 ms", 354), ("829 ms", 829)].map(|(name, delay)| condition(name, None, format!("delay = \"{delay}ms\""))).into()
}

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../scenarios/tasks/telesurgery.toml")
}

/// Returns the scene with a link from the surgeon to the robot, and with steps of so many hundredths of a millimetre.
fn scene(link: &str, step: u64) -> Scene {
    let step = metres(step);
    let changes = [
        format!("links=[{{ from = \"surgeon\", to = \"robot\"{}{link} }}]", if link.is_empty() { "" } else { ", " }),
        format!("peers.surgeon.hand.operator.step={step}"),
        format!("peers.surgeon.hand.operator.speed={}", speed(step)),
    ];
    Scene::read(&file(), &changes).unwrap_or_else(|error| panic!("{link}: {error}"))
}

fn metres(step: u64) -> f64 {
    step as f64 / 1e5
}

/// Returns the speed at the peak of a movement of the length `step` that takes [`MOVE`], without the rounding of binary fractions.
fn speed(step: f64) -> f64 {
    (1.875 * step / MOVE * 1e9).round() / 1e9
}

/// Runs a scene with every seed.
fn times(scene: &Scene) -> Times {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        loop {
            let run = next.fetch_add(1, Ordering::Relaxed);
            if run >= RUNS {
                return found;
            }
            let scene = Scene { seed: run as u64 + 1, ..scene.clone() };
            let task = Measures::run(&scene, Model::Least).task.expect("the scene has a task");
            found.push((run, (task.outcome == TaskOutcome::Done).then_some(task.time.as_secs_f64())));
        }
    };
    let mut found: Vec<(usize, Option<f64>)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..thread::available_parallelism().map_or(1, usize::from)).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    found.sort_by_key(|(run, _)| *run);
    Times { done: found.into_iter().filter_map(|(_, time)| time).collect() }
}

/// Returns the longest movement in hundredths of a millimetre with which the normal condition takes [`NORMAL`] on average, as nearly as possible.
fn fitted() -> u64 {
    let time = |step| times(&scene("", step)).mean();
    // Longer movements take less time. The ends are far from the result on either side.
    let (mut slow, mut fast) = (500, 2000);
    while fast - slow > 1 {
        let step = u64::midpoint(slow, fast);
        if time(step) >= NORMAL { slow = step } else { fast = step }
    }
    if (time(slow) - NORMAL).abs() <= (time(fast) - NORMAL).abs() { slow } else { fast }
}
