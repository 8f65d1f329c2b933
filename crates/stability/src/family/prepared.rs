//! A scene that has been read once, in which the learned keys are written without reading it again.

use cohaptic_scene::Scene;

use super::cell::Cell;
use super::leaves::{Leaf, Probe, learn};
use crate::mean_square::Followed;
use crate::radius::worse;
use crate::scene_radius::{RadiusScratch, SceneRadius, scene_radii};
use crate::{AnalysisError, Limits, Radius, Watch, has_chance, mean_square_watched};

/// A scene with learned keys.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) scene: Scene,
    /// For each learned key, the numbers that the radius depends on: of equal peers those of the first.
    leaves: Vec<Vec<Leaf>>,
    /// For each learned key, the numbers of the others, where the second moment may be followed peer by peer.
    others: Vec<Vec<Leaf>>,
    /// One for each combination of contacts.
    radii: Vec<SceneRadius>,
}

impl Prepared {
    /// From scenes read with values for the learned keys; `None` if the keys do more than to set numbers.
    pub(super) fn new(mut probes: Vec<Probe>) -> Result<Option<Self>, AnalysisError> {
        let Some(mut leaves) = learn(&mut probes) else { return Ok(None) };
        let scenes: Vec<&Scene> = probes.iter().map(|probe| &probe.scene).collect();
        let radii = scene_radii(&scenes)?;
        // Of each class only the first member is ever looked at.
        let mut looked_at: Vec<usize> = radii.iter().flat_map(|radius| radius.classes().iter().map(|class| class[0])).collect();
        looked_at.sort_unstable();
        looked_at.dedup();
        let is_other = |leaf: &Leaf| matches!(leaf, Leaf::Peer(place, _) if looked_at.binary_search(place).is_err());
        let has_chance = has_chance(&probes[0].scene);
        let others = leaves.iter().map(|leaves| leaves.iter().copied().filter(|leaf| has_chance && is_other(leaf)).collect()).collect();
        for leaves in &mut leaves {
            leaves.retain(|leaf| !is_other(leaf));
        }
        let scene = probes.swap_remove(0).scene;
        Ok(Some(Self { scene, leaves, others, radii }))
    }

    pub(super) fn is_varied(&self) -> bool {
        !self.leaves.is_empty()
    }

    /// How many numbers are written for each radius.
    #[cfg(test)]
    pub(super) fn written(&self) -> usize {
        self.leaves.iter().map(Vec::len).sum()
    }

    /// A scene of one's own to write in, and room for every radius.
    pub(super) fn scratch(&self) -> (Scene, Vec<RadiusScratch>) {
        (self.scene.clone(), self.radii.iter().map(|_| RadiusScratch::default()).collect())
    }

    /// Writes those values of the learned keys into the scene.
    pub(super) fn write(&self, values: &[f64], scene: &mut Scene) {
        set(&self.leaves, values, scene);
    }

    /// The largest radius of the second moment of all combinations of contacts, with those values of the learned keys, which have been written; where it
    /// cannot be followed, the square of the nominal one.
    pub(super) fn mean_square<const BOUND: bool>(
        &self,
        values: &[f64],
        scene: &mut Scene,
        scratch: &mut [RadiusScratch],
        watch: &dyn Watch,
    ) -> Result<Cell, AnalysisError> {
        let is_certain = |radius: &SceneRadius| matches!(radius.followed(), Ok(Followed::Certain));
        if self.radii.iter().all(is_certain) {
            return Ok(Cell { radius: self.radius::<BOUND>(scene, scratch).over(2), is_nominal: false });
        }
        let quick = |scratch: &mut [RadiusScratch]| {
            self.radii.iter().zip(scratch).try_fold(0.0, |worst: f64, (radius, scratch)| Some(worst.max(radius.mean_square(scene, scratch)?)))
        };
        if !BOUND && let Some(value) = quick(scratch) {
            return Ok(Cell { radius: Radius { value, error: 0.0 }, is_nominal: false });
        }
        set(&self.others, values, scene);
        match mean_square_watched(scene, &Limits { watch, ..Limits::of_unknowns(usize::MAX) }) {
            Ok(found) => Ok(Cell { radius: found.radius, is_nominal: false }),
            Err(
                AnalysisError::ChanceWithoutMoments { .. }
                | AnalysisError::TooManyMoments { .. }
                | AnalysisError::OtherStrategy { .. }
                | AnalysisError::Turns { .. }
                | AnalysisError::Topology { .. },
            ) => Ok(Cell { radius: self.radius::<BOUND>(scene, scratch).over(2), is_nominal: true }),
            Err(error) => Err(error),
        }
    }

    /// The largest radius of all combinations of contacts.
    pub(super) fn radius<const BOUND: bool>(&self, scene: &Scene, scratch: &mut [RadiusScratch]) -> Radius {
        let radii = self.radii.iter().zip(scratch).map(|(radius, scratch)| radius.radius::<BOUND>(scene, scratch));
        radii.reduce(worse::<BOUND>).unwrap_or(Radius { value: 0.0, error: 0.0 })
    }
}

/// Writes the value of each key into its numbers.
fn set(leaves: &[Vec<Leaf>], values: &[f64], scene: &mut Scene) {
    for (leaves, value) in leaves.iter().zip(values) {
        for leaf in leaves {
            leaf.set(scene, *value);
        }
    }
}
