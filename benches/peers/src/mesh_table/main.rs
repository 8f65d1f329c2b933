//! Writes the first part of `docs/measured-peers.md`: see its first lines, or `others-table`, which writes the rest. Takes about three minutes.
//!
//! `mesh-table mesh` and `mesh-table link` write one table each.

use std::hint::black_box;

use cohaptic_benches_peers::mesh::program::Program;
use cohaptic_benches_peers::mesh::{Mesh, Outcome};
use cohaptic_benches_peers::{link, machine, median, seconds_of};

/// Rounds of which the median is taken, in each of which all alternate.
const ROUNDS: usize = 5;
/// What a run of a program should take \[s\].
const WORTH: f64 = 0.4;
/// Ticks of the runs that are compared to the bit.
const COMPARED: u64 = 2_000;
/// Packets of a run through a link.
const PACKETS: u64 = 1_000_000;

fn main() {
    let only = std::env::args().nth(1);
    let wanted = |part: &str| only.as_deref().is_none_or(|only| only == part);
    if only.is_none() {
        head();
    }
    if wanted("mesh") {
        mesh();
    }
    if wanted("link") {
        links();
    }
}

fn head() {
    println!("# Compared with others: speed\n");
    println!("The same scenes on this project and on what others wrote, in one run. This page is written by\n");
    println!("    cd benches/peers && (cargo run --release --bin mesh-table && others/run) > ../../docs/measured-peers.md\n");
    println!("and measured on: {}. Processor time on one core, the median of {ROUNDS} rounds in which", machine());
    println!("all alternate. The columns leave out [what the others do not model](#what-the-others-do-not-model).\n");
}

fn mesh() {
    println!("## A full mesh\n");
    println!(
        "N peers at 1 kHz, each grasping the object through a device, one of them pushed by a constant hand, 125 samples a second to each other peer:"
    );
    println!(
        "the scene of [measured-speed.md](measured-speed.md). All but cohaptic have the same arithmetic (`benches/peers/src/mesh/body.rs`) and differ in the part that keeps the time and"
    );
    println!(
        "brings the samples; each is written as its own documentation would have it, and for speed. All draw loss and jitter from the same addresses, so that"
    );
    println!(
        "the same packets are lost and late: the run stops unless after {} simulated seconds the copies of all peers are at the same place *to the bit* in all",
        COMPARED / 1000
    );
    println!("programs. cohaptic reads the scene from TOML, and keeps counters of each link; the others do neither.\n");
    println!(
        "Nothing in this scene happens between ticks but packets on their way. cohaptic sees that, and runs it in arrays, tick by tick, as long as nobody watches"
    );
    println!(
        "([architecture.md](architecture.md#only-what-the-scene-needs)). If all links have one constant delay, a sample on its way is one for all its receivers, so that its time"
    );
    println!(
        "a packet is less than any program can move one in. Its second row is the same scene with an observer that is shown every packet: event by event, as any scene"
    );
    println!("runs that needs events. That is the row to compare with other schedulers.\n");
    println!(
        "*Arrives* is the largest time, measured over all packets, between the instant at which a packet should arrive and that at which the program has it.\n"
    );
    println!("| peers | links | program | simulated s per s | cohaptic is | ns a packet delivered | arrives |");
    println!("| ---: | --- | --- | ---: | ---: | ---: | ---: |");
    for mesh in Mesh::ALL {
        cell(mesh);
    }
    println!(
        "\n*Cohaptic is* says how many times as fast. The bare loops are what its speed is set against, with nothing but this scene: they have no room for another one."
    );
    println!(
        "That of [measured-speed.md](measured-speed.md) keeps the counters of each link and the largest discrepancy, as cohaptic does; these keep nothing but what moves. bach's queues"
    );
    println!("have a packet at its instant; its peers, like those of the loop over ticks, look at each tick.\n");
    println!("### What the others do not model\n");
    println!("| program | does not model | time |\n| --- | --- | --- |");
    for program in Program::ALL.into_iter().filter(|program| *program != Program::CohapticWatched) {
        println!("| {} | {} | {} |", program.name(), program.lacks(), program.resolution());
    }
    println!();
}

/// The rows of one mesh.
fn cell(mesh: Mesh) {
    let compared: Vec<(Outcome, f64)> = Program::ALL.iter().map(|program| timed(|| program.run(mesh, COMPARED))).collect();
    for (program, (outcome, _)) in Program::ALL.iter().zip(&compared) {
        let bits = |outcome: &Outcome| outcome.positions.iter().map(|position| position.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(outcome), bits(&compared[0].0), "{program:?} does not end where cohaptic does: the table would compare different work");
    }
    // So long that each takes about as much; a whole number of frames.
    let lengths: Vec<u64> = compared.iter().map(|(_, seconds)| length(WORTH / seconds)).collect();
    let mut times = vec![Vec::new(); Program::ALL.len()];
    let mut delivered = vec![0; Program::ALL.len()];
    for _ in 0..ROUNDS {
        for (place, program) in Program::ALL.iter().enumerate() {
            let (outcome, seconds) = timed(|| program.run(mesh, lengths[place]));
            times[place].push(seconds);
            delivered[place] = outcome.delivered;
        }
    }
    let speeds: Vec<[f64; 2]> =
        times.into_iter().zip(&lengths).zip(&delivered).map(|((times, ticks), delivered)| speed(median(times), *ticks, *delivered)).collect();
    for ((program, [speed, packet]), (outcome, _)) in Program::ALL.iter().zip(&speeds).zip(&compared) {
        let times = if *program == Program::Cohaptic { String::from("1") } else { format!("{:.2}×", speeds[0][0] / speed) };
        let error = match outcome.arrival_error_nanos {
            0 => String::from("at its instant"),
            nanos => format!("{:.0} µs late", nanos as f64 / 1e3),
        };
        println!("| {} | {} | {} | {} | {times} | {packet:.0} | {error} |", mesh.peers, mesh.links(), program.name(), figures(*speed));
    }
}

/// The ticks that are worth this multiple of those compared.
fn length(times: f64) -> u64 {
    ((COMPARED as f64 * times) as u64).clamp(1_000, 20_000_000).next_multiple_of(8)
}

/// Simulated seconds a second, and nanoseconds a packet.
fn speed(seconds: f64, ticks: u64, delivered: u64) -> [f64; 2] {
    [ticks as f64 / 1e3 / seconds, seconds * 1e9 / delivered as f64]
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let mut result = None;
    let seconds = seconds_of(|| result = Some(black_box(work())));
    (result.expect("it ran"), seconds)
}

/// Three figures at least of a small number, none behind the point of a large one.
fn figures(value: f64) -> String {
    if value < 10.0 { format!("{value:.2}") } else { format!("{value:.0}") }
}

fn links() {
    println!("## One link alone\n");
    println!(
        "A steady stream of 64-byte packets 1 µs apart over 10 ms, so that 10⁴ are on the way: offered, and polled when they come out, {PACKETS} of them. *Seen* is"
    );
    println!(
        "what came out by the last packet sent, of a run with the same packets: how many, and mean and deviation of their delays. The cost of each stage of a link:"
    );
    println!("[measured-link.md](measured-link.md).\n");
    println!("| link | program | ns a packet | million packets/s | seen: out | delay \\[ms\\] |");
    println!("| --- | --- | ---: | ---: | ---: | ---: |");
    let mut times = vec![Vec::new(); link::ROWS.len()];
    for _ in 0..ROUNDS {
        for ((kind, by), times) in link::ROWS.iter().zip(&mut times) {
            times.push(timed(|| by.drive(*kind, PACKETS)).1);
        }
    }
    for ((kind, by), times) in link::ROWS.iter().zip(times) {
        let (nanos, seen) = (median(times) * 1e9 / PACKETS as f64, by.watch(*kind, PACKETS));
        let [mean, deviation] = seen.delay();
        println!("| {} | {} | {nanos:.1} | {:.1} | {} | {mean:.3} ± {deviation:.3} |", kind.name(), by.name(*kind), 1e3 / nanos, seen.delivered);
    }
    println!(
        "\nIn order a packet waits for the slowest before it, hence the mean; str0m-netem knows no other jitter. It does not model: packets that overtake by their"
    );
    println!(
        "delay, any law but the uniform one; a rate that holds packets up before they are delayed; outages, slots, corruption, queues but for tail drop, token"
    );
    println!(
        "buckets; what became of a packet that does not come out. It gives no instant with a packet, so that a program that wants to know it must poll at each timeout, and"
    );
    println!(
        "its clock is the standard library's, so that virtual time begins at an instant of the wall clock. The bare ring and heap model nothing but their row.\n"
    );
}
