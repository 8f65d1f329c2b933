//! Records of a run as CSV: how many bytes leave in a second of processor time.

use std::convert::Infallible;
use std::hint::black_box;
use std::path::{Path, PathBuf};

use cohaptic_harness::record::{Recorder, links_csv};
use cohaptic_harness::{Model, Observer, PacketRow, Simulation, Summary, TickRow};
use cohaptic_scene::Scene;

/// Sees every row that a record has, and keeps nothing.
#[derive(Clone, Copy, Debug)]
pub struct Reader;

impl Observer for Reader {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        black_box(row);
        Ok(())
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        black_box(row);
        Ok(())
    }
}

/// A run that only [`Reader`] sees.
pub fn read(scene: &Scene) {
    let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut { Reader });
    black_box(summary);
}

/// A run that is recorded into a folder, with its pictures; gives the files.
///
/// # Panics
///
/// If they cannot be written.
pub fn record(scene: &Scene, folder: &Path) -> Vec<PathBuf> {
    let mut recorder = Recorder::create(folder, scene).expect("the folder of records can be made");
    let summary = Simulation::new(scene, Model::Least).run(&mut recorder).expect("records can be written");
    recorder.finish(&summary).expect("records can be written")
}

/// The bytes of the CSV files among these.
///
/// # Panics
///
/// If one is not there.
#[must_use]
pub fn csv_bytes(files: &[PathBuf]) -> u64 {
    let csv = files.iter().filter(|file| file.extension().is_some_and(|end| end == "csv"));
    csv.map(|file| file.metadata().expect("a record is there").len()).sum()
}

/// Writes a row a link, as `--links` does into a pipe that takes everything at once; gives the bytes.
#[must_use]
pub fn stream(summary: &Summary) -> u64 {
    let mut bytes = 0;
    let Ok(()) = links_csv(summary, |rows| {
        bytes += black_box(rows).len() as u64;
        Ok::<(), Infallible>(())
    });
    bytes
}
