//! Writes the table of measured speed: `cargo run --release -p cohaptic-benches --bin speed-table > docs/speed.md`.
#![allow(clippy::print_stdout, reason = "printing the table is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "seconds and rounds are small")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use cohaptic_benches::{Mesh, bare};

/// What is asked for: times real time, from the project's first milestone, and the largest ratio to the bare loop.
const ASKED: [f64; 6] = [12_000.0, 8_000.0, 2_500.0, 1_200.0, 120.0, 50.0];

fn main() {
    println!("| peers | links | cohaptic | asked for | bare loop | ratio |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for (mesh, asked) in Mesh::ALL.into_iter().zip(ASKED) {
        let (program, bare) = measure(mesh);
        let links = if mesh.impaired { "24 ± 2 ms, 1 % loss" } else { "24 ms" };
        println!("| {} | {links} | {program:.0}× | {asked:.0}× | {bare:.0}× | {:.2} |", mesh.peers, bare / program);
    }
}

/// Times real time of the program and of the bare loop: the median of alternating rounds, so that a noisy moment hits both.
fn measure(mesh: Mesh) -> (f64, f64) {
    const ROUNDS: usize = 9;
    // About half a second of work each.
    let seconds = 20_000 / (mesh.peers * mesh.peers) as u64 + 20;
    let scene = mesh.scene(seconds);
    let mut rounds = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        rounds[0].push(time(|| drop(black_box(Mesh::run(&scene)))));
        rounds[1].push(time(|| drop(black_box(bare::run(mesh, seconds * 1000)))));
    }
    let [program, bare] = rounds.map(|mut times| {
        times.sort();
        seconds as f64 / times[ROUNDS / 2].as_secs_f64()
    });
    (program, bare)
}

fn time(work: impl FnOnce()) -> Duration {
    let start = Instant::now();
    work();
    start.elapsed()
}
