//! The runs themselves.

use cohaptic_harness::{Model, NoObserver, Simulation, Summary};
use cohaptic_scene::Scene;

/// How many runs are handed over at once: as many as a vector of eight lanes takes, and few enough that all threads are busy until the end.
pub(crate) const CHUNK: u64 = 8;

/// Runs each scene to its end, and gives what each comes to, in the same order. The summaries are those of one run at a time, to the last bit.
pub(crate) fn run_side_by_side(scenes: &[Scene]) -> Vec<Summary> {
    let run = |scene| match Simulation::new(scene, Model::Least).run(&mut NoObserver) {
        Ok(summary) => summary,
        Err(never) => match never {},
    };
    scenes.iter().map(run).collect()
}
