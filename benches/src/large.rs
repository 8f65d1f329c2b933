//! Scenes of many peers, each with the time and the memory of one run: reading it, running it, and what comes out of it.
//!
//! Each run has a process of its own, since memory that an earlier one gave back may still be there for the next.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use cohaptic_benches_common::mesh::{Mesh, SEED};
use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::Scene;

use crate::machine::peak_memory;

/// The option by which a program that writes a page is asked for a run of the row whose place follows, or of a small one if `small` follows.
const OPTION: &str = "--run-of-many-peers";

/// A scene of many peers, with the least speed and the most memory that are asked for.
#[derive(Clone, Copy, Debug)]
pub struct Large {
    /// The number of peers.
    pub peers: usize,
    /// Neighbours on a ring; all others without.
    pub neighbours: Option<usize>,
    /// `true` if its links have jitter and lose packets.
    pub impaired: bool,
    /// How many threads run it.
    pub threads: usize,
    /// How long it lasts \[ms\].
    pub millis: u64,
    /// How many times real time it shall take at least.
    pub asked: Option<f64>,
    /// How much memory it shall take at most \[MB\].
    pub asked_memory: Option<f64>,
}

/// What a run came to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Run {
    /// The simulated time over that which reading and running took by the wall clock.
    pub times_real_time: f64,
    /// The most memory that the process held \[bytes\]; zero if this system does not tell.
    pub memory: u64,
}

impl Large {
    /// The rows of the table.
    pub const ALL: [Self; 4] = [
        Self { peers: 100_000, neighbours: None, impaired: false, threads: 1, millis: 1000, asked: Some(0.05), asked_memory: Some(200.0) },
        Self { peers: 4096, neighbours: None, impaired: false, threads: 1, millis: 10_000, asked: None, asked_memory: Some(300.0) },
        Self { peers: 1000, neighbours: None, impaired: true, threads: 2, millis: 2000, asked: Some(0.25), asked_memory: None },
        Self { peers: 10_000, neighbours: Some(8), impaired: true, threads: 2, millis: 5000, asked: Some(1.0), asked_memory: None },
    ];

    /// Fewer peers for a shorter time: the program runs, and its figures say nothing.
    #[must_use]
    pub const fn in_small(self) -> Self {
        Self { peers: self.peers / 100 + 10, millis: 20, ..self }
    }

    /// The scene.
    ///
    /// # Errors
    ///
    /// If it is no scene, which a test would show.
    pub fn scene(&self) -> Result<Scene, String> {
        let ring = |neighbours: usize| format!("topology={{ kind = \"ring\", neighbours = {neighbours} }}");
        heavy_mesh(Mesh { peers: self.peers, impaired: self.impaired }, self.millis, self.neighbours.map(ring))
    }

    /// Runs it in this process.
    ///
    /// # Errors
    ///
    /// As [`Large::scene`], and if it diverges.
    pub fn run(&self) -> Result<Run, String> {
        let start = Instant::now();
        let scene = self.scene()?;
        let Ok(summary) = Simulation::new(&scene, Model::Least).on_threads(self.threads).run(&mut NoObserver);
        let took = start.elapsed();
        if summary.duration != scene.duration {
            return Err(format!("{} peers diverge", self.peers));
        }
        Ok(Run { times_real_time: scene.duration.as_secs_f64() / took.as_secs_f64(), memory: bytes(&peak_memory()).unwrap_or_default() })
    }
}

/// A number of kilobytes, as the system writes it, in bytes.
fn bytes(kilobytes: &str) -> Option<u64> {
    let number: u64 = kilobytes.strip_suffix(" kB")?.parse().ok()?;
    Some(1024 * number)
}

/// The mesh for that time with these settings, whose copies have 0.15 kg whatever their number: lighter ones diverge.
///
/// # Errors
///
/// If it is no scene, which a test would show.
pub fn heavy_mesh(mesh: Mesh, millis: u64, settings: impl IntoIterator<Item = String>) -> Result<Scene, String> {
    let settings: Vec<String> = std::iter::once(format!("object.mass={}", 0.15 * mesh.peers as f64)).chain(settings).collect();
    Scene::parse(&mesh.text(millis, SEED), Path::new("mesh.toml"), &settings).map_err(|error| error.to_string())
}

/// The run that this process was made for, if it was: the line that tells what it came to.
///
/// # Errors
///
/// As [`Large::run`], and if there is no such row.
pub fn run_as_asked() -> Option<Result<String, String>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [option, place, size] = &arguments[..] else { return None };
    (option == OPTION).then(|| {
        let row = place.parse().ok().and_then(|place: usize| Large::ALL.get(place)).ok_or("there is no such row")?;
        let Run { times_real_time, memory } = if size == "small" { row.in_small() } else { *row }.run()?;
        Ok(format!("{times_real_time} {memory}"))
    })
}

/// Each row with the median time and the median memory of that number of runs of it or of a small one, by this program, which must begin by printing [`run_as_asked`].
///
/// # Errors
///
/// If a run fails.
pub fn rows(rounds: usize, small: bool) -> Result<Vec<(Large, Run)>, String> {
    let run = |place: usize| {
        let program = std::env::current_exe().map_err(|error| error.to_string())?;
        let output = Command::new(program).args([OPTION, &place.to_string(), if small { "small" } else { "whole" }]).output();
        let output = output.map_err(|error| error.to_string())?;
        let text = String::from_utf8_lossy(&output.stdout);
        let parts = text.trim().split_once(' ').and_then(|(times, memory)| Some((times.parse().ok()?, memory.parse().ok()?)));
        parts.ok_or_else(|| String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let mut rows = Vec::new();
    for (place, row) in Large::ALL.into_iter().enumerate() {
        let runs: Vec<(f64, u64)> = (0..rounds.max(1)).map(|_| run(place)).collect::<Result<_, String>>()?;
        let (mut times, mut memory): (Vec<f64>, Vec<u64>) = runs.into_iter().unzip();
        times.sort_by(f64::total_cmp);
        memory.sort_unstable();
        rows.push((if small { row.in_small() } else { row }, Run { times_real_time: times[times.len() / 2], memory: memory[memory.len() / 2] }));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link leads to each peer from each of those that it hears.
    #[test]
    fn each_row_is_a_scene_of_the_size_that_it_says() {
        for row in Large::ALL.map(Large::in_small) {
            let scene = row.scene().unwrap_or_else(|error| panic!("{row:?}: {error}"));
            let Ok(summary) = Simulation::new(&scene, Model::Least).on_threads(row.threads).run(&mut NoObserver);
            let heard = row.neighbours.unwrap_or(row.peers - 1);
            assert_eq!(summary.links.len(), (row.peers * heard) as u64, "{row:?}");
            assert!(row.run().is_ok_and(|run| run.times_real_time > 0.0), "{row:?}");
        }
    }

    #[test]
    fn kilobytes_are_1024_bytes() {
        assert_eq!([bytes("12 kB"), bytes("not told by this system")], [Some(12_288), None]);
    }
}
