//! Writes the last part of `docs/measured-peers.md`: what others wrote in other languages, where it is installed. See `others/run`.

mod foreign;
mod map;
mod scene_file;

use std::path::{Path, PathBuf};

use cohaptic_benches_peers::mesh::{Mesh, on_cohaptic};
use cohaptic_benches_peers::{median, seconds_of};
use foreign::{Foreign, Ran};

/// Rounds of which the median is taken, in each of which all alternate.
const ROUNDS: usize = 3;
/// What a run should take \[s\].
const WORTH: f64 = 0.4;
/// Ticks of the runs whose ends are compared.
const COMPARED: u64 = 2_000;
/// Compilers and libraries may round differently on other machines; what differs by more \[m\] has done other work.
const SAME: f64 = 1e-9;

fn main() {
    let folder = std::env::temp_dir().join(format!("cohaptic-others-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    mesh(&folder);
    map::table(&folder);
    std::fs::remove_dir_all(&folder).expect("it is ours");
}

fn scripts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("others")
}

fn mesh(folder: &Path) {
    println!("## In other languages\n");
    println!(
        "The same mesh and the same arithmetic in C++ on ns-3 and in Python on SimPy (`benches/peers/others/`), where they are installed. Their draws of loss and"
    );
    println!(
        "jitter are read from a file, which costs them nothing. Processor time of what they simulate, without starting, reading and building; the median of {ROUNDS}"
    );
    println!(
        "rounds in which all alternate. *Ends* says how far the copies are from cohaptic's after {} simulated seconds. cohaptic is that of the first\nrow above, unwatched; its second row says how fast it is event by event.\n",
        COMPARED / 1000
    );
    println!("| peers | links | program | simulated s per s | cohaptic is | ns a packet delivered | ends |");
    println!("| ---: | --- | --- | ---: | ---: | ---: | --- |");
    let mut missing: Vec<(Foreign, String)> = Vec::new();
    let mut lacks: Vec<(String, String)> = Vec::new();
    for mesh in Mesh::ALL {
        cell(mesh, folder, &mut missing, &mut lacks);
    }
    println!();
    for (foreign, why) in &missing {
        println!("{}: skipped. {why}\n", foreign.name());
    }
    if !lacks.is_empty() {
        println!("| program | does not model |\n| --- | --- |");
        for (program, lacks) in &lacks {
            println!("| {program} | {lacks} |");
        }
        println!();
    }
}

fn cell(mesh: Mesh, folder: &Path, missing: &mut Vec<(Foreign, String)>, lacks: &mut Vec<(String, String)>) {
    let path = folder.join("compared");
    scene_file::write(&path, mesh, COMPARED);
    let expected = on_cohaptic::run(&on_cohaptic::scene(mesh, COMPARED)).positions;
    // Which program ran, how many ticks are worth its while, and how its end compares.
    let mut there = Vec::new();
    for foreign in Foreign::ALL {
        if missing.iter().any(|(other, _)| *other == foreign) {
            continue;
        }
        match foreign.run(&path) {
            Ran::Skipped(why) => missing.push((foreign, why)),
            Ran::Answered(answer) => {
                let ends = compare(&answer.positions, &expected);
                assert!(ends <= SAME, "{}: {mesh:?} ends {ends:e} m from where it ends here: a table would compare different work", answer.program);
                if !lacks.iter().any(|(program, _)| *program == answer.program) {
                    lacks.push((answer.program.clone(), answer.lacks.clone()));
                }
                there.push((foreign, length(WORTH / answer.seconds), ends));
            }
        }
    }
    let own = {
        let scene = on_cohaptic::scene(mesh, COMPARED);
        length(WORTH / seconds_of(|| drop(std::hint::black_box(on_cohaptic::run(&scene)))))
    };
    let scene = on_cohaptic::scene(mesh, own);
    let paths: Vec<PathBuf> = there
        .iter()
        .map(|(foreign, ticks, _)| {
            let path = folder.join(foreign.name().replace(' ', "-"));
            scene_file::write(&path, mesh, *ticks);
            path
        })
        .collect();
    let mut times = vec![Vec::new(); there.len()];
    let mut answers = vec![None; there.len()];
    let mut own_times = Vec::new();
    for _ in 0..ROUNDS {
        own_times.push(seconds_of(|| drop(std::hint::black_box(on_cohaptic::run(&scene)))));
        for (place, (foreign, _, _)) in there.iter().enumerate() {
            if let Ran::Answered(answer) = foreign.run(&paths[place]) {
                times[place].push(answer.seconds);
                answers[place] = Some(answer);
            }
        }
    }
    let speed = |ticks: u64, seconds: f64| ticks as f64 / 1e3 / seconds;
    let (links, own) = (mesh.links(), speed(own, median(own_times)));
    println!("| {} | {links} | cohaptic | {own:.0} | 1 | | |", mesh.peers);
    for (((_, ticks, ends), times), answer) in there.iter().zip(times).zip(&answers) {
        let Some(answer) = answer else { continue };
        let seconds = median(times);
        let packet = seconds * 1e9 / answer.delivered as f64;
        let ends = if *ends == 0.0 { String::from("to the bit") } else { format!("within {ends:.0e} m") };
        let rate = speed(*ticks, seconds);
        let rate_text = if rate < 10.0 { format!("{rate:.2}") } else { format!("{rate:.0}") };
        println!("| {} | {links} | {} | {rate_text} | {:.1}× | {packet:.0} | {ends} |", mesh.peers, answer.program, own / rate);
    }
}

/// The largest difference.
fn compare(actual: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(actual.len(), expected.len(), "as many peers");
    actual.iter().zip(expected).map(|(actual, expected)| (actual - expected).abs()).fold(0.0, f64::max)
}

/// The ticks that are worth this multiple of those compared; few enough that their delays do not fill a disk.
fn length(times: f64) -> u64 {
    ((COMPARED as f64 * times) as u64).clamp(1_000, 10_000_000).next_multiple_of(8)
}
