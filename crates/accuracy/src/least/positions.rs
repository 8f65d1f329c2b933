//! Where the copies of the object are in both models.

use std::convert::Infallible;

use cohaptic_harness::{Model, NoObserver, Observer, Simulation, TickRow};
use cohaptic_scene::Scene;

/// The largest difference between a position of a copy in the least model and in the general one, at any tick, at the end, and at the end of a run that
/// nobody watches, which may take another way; infinite if the runs have not the same ticks, or if one has a number where the other has none \[m\].
pub(super) fn largest_difference(scene: &Scene) -> f64 {
    let [least, general] = [Model::Least, Model::General].map(|model| seen(scene, model));
    if least.len() != general.len() {
        return f64::INFINITY;
    }
    // Bits, so that a NaN counts as equal to itself alone.
    let apart = |(one, other): (&f64, &f64)| if one.to_bits() == other.to_bits() { 0.0 } else { (one - other).abs() };
    let differences = least.iter().zip(&general).map(apart).map(|apart| if apart.is_nan() { f64::INFINITY } else { apart });
    differences.fold(0.0, f64::max)
}

/// Every position, in the order in which the ticks come: instant by instant, peer by peer, axis by axis; then those at the end, and at the end unwatched.
fn seen(scene: &Scene, model: Model) -> Vec<f64> {
    let mut positions = Positions(Vec::new());
    let Ok(watched) = Simulation::new(scene, model).run(&mut positions);
    let Ok(alone) = Simulation::new(scene, model).run(&mut NoObserver);
    let mut all = positions.0;
    all.extend([watched, alone].iter().flat_map(|summary| &summary.peers).flat_map(|peer| peer.position.iter().copied()));
    all
}

struct Positions(Vec<f64>);

impl Observer for Positions {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.0.extend_from_slice(row.object.position);
        Ok(())
    }
}
