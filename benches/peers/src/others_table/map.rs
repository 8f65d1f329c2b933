//! The stability map by numpy, compared with `cohaptic stability map`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use cohaptic_benches_peers::median;
use cohaptic_benches_peers::mesh::{Mesh, SEED};
use serde::Deserialize;

use crate::foreign::{Ran, answer, python};
use crate::{ROUNDS, compare, scene_file};

/// KT before scaling [N/m], from and to.
const STIFFNESS: [f64; 2] = [100.0, 6000.0];
/// BT before scaling [N·s/m].
const DAMPING: [f64; 2] = [0.0, 60.0];
/// Eigenvalues are exact to rounding times their condition; what differs by more is another matrix.
const SAME: f64 = 1e-6;

/// A map: the number of peers, and of values of each key.
const MAPS: [(usize, [usize; 2]); 2] = [(3, [100, 75]), (10, [40, 30])];

/// What `stability_map.py` says.
#[derive(Clone, Debug, Deserialize)]
struct Map {
    program: String,
    seconds: f64,
    radii: Vec<f64>,
    lacks: String,
}

/// What `cohaptic stability map --json` says, of which this is used.
#[derive(Clone, Debug, Deserialize)]
struct Own {
    spectral_radius: Vec<Vec<f64>>,
    wall_s: f64,
}

/// Prints the table.
pub fn table(folder: &Path) {
    println!("## A stability map\n");
    println!(
        "Spectral radii of the mesh with a constant delay over KT and BT, by `cohaptic stability map --jobs 1` and by numpy on one thread (`others/stability_map.py`),"
    );
    println!(
        "which has the equations written for it by hand and takes the matrices of all cells apart at once. Wall time of the computation, the median of {ROUNDS} rounds"
    );
    println!("in which all alternate. *Differs* is the largest difference of a radius from cohaptic's.\n");
    let Some(cohaptic) = program() else {
        println!("Skipped: `cohaptic` is not built. `cargo build --release` in the root of this project does, or $COHAPTIC names it.\n");
        return;
    };
    println!("| peers | cells | program | cells/s | cohaptic is | differs |\n| ---: | ---: | --- | ---: | ---: | ---: |");
    let mut notes = Vec::new();
    for (peers, grid) in MAPS {
        let mesh = Mesh { peers, impaired: false };
        let (toml, text) = (folder.join("map.toml"), folder.join("map"));
        std::fs::write(&toml, mesh.text(1_000, SEED)).expect("a temporary file");
        std::fs::write(&text, of_map(mesh, grid)).expect("a temporary file");
        rows(&cohaptic, peers, grid, &toml, &text, &mut notes);
    }
    println!();
    for note in notes {
        println!("{note}\n");
    }
}

fn rows(cohaptic: &Path, peers: usize, grid: [usize; 2], toml: &Path, text: &Path, notes: &mut Vec<String>) {
    let mut own: Vec<Own> = Vec::new();
    let mut others: [Vec<Map>; 2] = Default::default();
    for _ in 0..ROUNDS {
        match answer(own_command(cohaptic, grid, toml)) {
            Ran::Answered(map) => own.push(map),
            Ran::Skipped(why) => return notes.push(format!("cohaptic: skipped. {why}")),
        }
        for (how, maps) in ["full", "modes"].into_iter().zip(&mut others) {
            let mut command = python("stability_map.py");
            command.arg(text).arg(how);
            match answer(command) {
                Ran::Answered(map) => maps.push(map),
                Ran::Skipped(why) => notes.push(format!("numpy: skipped. {why}")),
            }
        }
    }
    notes.dedup();
    let cells = grid[0] * grid[1];
    let rate = |times: Vec<f64>| cells as f64 / median(times);
    let speed = rate(own.iter().map(|map| map.wall_s).collect());
    println!("| {peers} | {cells} | cohaptic | {speed:.0} | 1 | |");
    let radii: Vec<f64> = own[0].spectral_radius.concat();
    for maps in others.iter().filter(|maps| !maps.is_empty()) {
        let Map { program, lacks, .. } = &maps[0];
        let differs = compare(&maps[0].radii, &radii);
        assert!(differs < SAME, "{program}: radii differ by {differs:e}: a table would compare different work");
        let other = rate(maps.iter().map(|map| map.seconds).collect());
        println!("| {peers} | {cells} | {program} | {other:.0} | {:.1}× | {differs:.0e} |", speed / other);
        let note = format!("numpy does not model {lacks}.");
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
}

/// What the script reads: the scene, both ranges, and the scaling by the number of peers.
fn of_map(mesh: Mesh, grid: [usize; 2]) -> String {
    let n = mesh.peers as f64;
    let mut text = scene_file::text(mesh);
    for (key, [low, high], count) in [("stiffness", STIFFNESS, grid[0]), ("damping", DAMPING, grid[1])] {
        writeln!(text, "{key} {low:?} {high:?} {count}").expect("a string takes all");
    }
    writeln!(text, "scale {:?}", 4.0 * (n - 1.0) / (n * n)).expect("a string takes all");
    text
}

fn own_command(cohaptic: &Path, grid: [usize; 2], toml: &Path) -> Command {
    let mut command = Command::new(cohaptic);
    command.args(["stability", "map"]).arg(toml);
    for (option, key, [low, high]) in [("--x", "stiffness", STIFFNESS), ("--y", "damping", DAMPING)] {
        command.arg(option).arg(format!("coordination.{key}={low}..{high}"));
    }
    command.arg("--grid").arg(format!("{}x{}", grid[0], grid[1])).args(["--jobs", "1", "--json"]);
    command
}

/// The program of this project.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("COHAPTIC") {
        return Some(named.into());
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target");
    let targets = [std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from), Some(root)];
    targets.into_iter().flatten().map(|target| target.join("release/cohaptic")).find(|program| program.exists())
}
