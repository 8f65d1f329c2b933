//! Writes `docs/speed.md`: `cargo run --release -p cohaptic-benches --bin speed-table > docs/speed.md`. Takes about a minute.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "seconds and rounds are small")]

use std::hint::black_box;

use cohaptic_benches::machine::{median, peak_memory, processor, time};
use cohaptic_benches::{Mesh, bare};

/// What the project asks of itself in each cell: times real time.
const ASKED: [f64; 6] = [12_000.0, 8_000.0, 2_500.0, 1_200.0, 120.0, 50.0];
/// And the largest ratio of the bare loop's speed to the program's.
const ASKED_RATIO: f64 = 2.5;

fn main() {
    println!("# Speed\n");
    println!("Simulated seconds per second of processor time, on one core. This page is written by\n");
    println!("    cargo run --release -p cohaptic-benches --bin speed-table > docs/speed.md\n");
    println!("and measured on: {}.\n", processor());
    println!("## A full mesh\n");
    println!(
        "N peers at 1 kHz, each grasping the object through a device, one of them pushed by a constant hand; 125 samples of 64 bytes a second to each"
    );
    println!(
        "other peer; nothing recorded but counters. The *bare loop* (`benches/src/bare.rs`) does the same arithmetic on the same random numbers in"
    );
    println!(
        "arrays, written by hand for this one scene: no bytes on the wire, one axis, one strategy, no order of events but its own. Each figure is the"
    );
    println!("median of nine rounds in which the two alternate.\n");
    println!("| peers | links | cohaptic | asked for | bare loop | ratio | asked for |");
    println!("| ---: | --- | ---: | ---: | ---: | ---: | ---: |");
    for (mesh, asked) in Mesh::ALL.into_iter().zip(ASKED) {
        let (program, bare) = measure(mesh);
        let links = if mesh.impaired { "24 ms ± 2 ms normal, 1 % loss" } else { "24 ms" };
        let peers = mesh.peers;
        println!("| {peers} | {links} | {program:.0}× | {asked:.0}× | {bare:.0}× | {:.2} | {ASKED_RATIO} |", bare / program);
    }
    println!(
        "\nFor scale, figures for other simulators on this work, taken from the project's requirements and not measured by this command: at 3, 10 and 50"
    );
    println!(
        "peers with jitter and loss, the bare scheduler of ns-3 2090×, 190× and 6×, nexosim 1100×, 125× and 2×, turmoil 260×, 57× and 3×, SimPy 190×, 30×"
    );
    println!("and 1×.");
    println!("\nThe same cells as criterion benches: `cargo bench -p cohaptic-benches`.\n");
    println!("## Memory\n");
    println!("The most memory that the process has held, after runs of 3 peers with jitter and loss, one after the other in one process.\n");
    println!("| simulated | took | most memory |");
    println!("| --- | ---: | ---: |");
    for (name, seconds) in [("a minute", 60), ("an hour", 3_600), ("a day", 86_400)] {
        let scene = Mesh { peers: 3, impaired: true }.scene(seconds);
        let took = time(|| drop(black_box(Mesh::run(&scene))));
        println!("| {name} | {:.2} s | {} |", took.as_secs_f64(), peak_memory());
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
    let [program, bare] = rounds.map(|times| seconds as f64 / median(times).as_secs_f64());
    (program, bare)
}
