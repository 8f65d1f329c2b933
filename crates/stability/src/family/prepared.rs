//! A scene that has been read, and into which values of the learned keys are written directly, without reading the scene's text again.

use cohaptic_scene::Scene;

use super::leaves::{Leaf, Probe, learn};
use crate::mean_square::Followed;
use crate::radius::worse;
use crate::scene_radius::{RadiusScratch, SceneRadius, scene_radii};
use crate::{AnalysisError, Limits, Radius, Watch, has_chance, mean_square_watched};

/// The radius of a family of scenes for one set of key values.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cell<R = Radius> {
    /// Radius by the criterion of the family; below 1 the scene is stable.
    pub radius: R,
    /// `true` if the radius leaves out random parts of the links, because the second moment of this scene cannot be followed. A nominal radius is the square
    /// of the spectral radius of the scene in which every delay is its mean and no packet is lost.
    pub is_nominal: bool,
}

impl<R> Cell<R> {
    /// Returns a cell whose radius leaves out no random part of the links.
    pub const fn certain(radius: R) -> Self {
        Self { radius, is_nominal: false }
    }
}

/// A scene with the places of its learned keys and the prepared radii of its combinations of contacts.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) scene: Scene,
    /// Numbers on which the radius depends, indexed by learned key. Of a class of equal peers only the first member's numbers are listed.
    leaves: Vec<Vec<Leaf>>,
    /// Numbers of the remaining members of each class, indexed by learned key. Empty unless the links are random: only a second moment that is followed
    /// peer by peer reads these numbers.
    others: Vec<Vec<Leaf>>,
    /// One prepared radius per combination of contacts.
    radii: Vec<SceneRadius>,
}

impl Prepared {
    /// Prepares the scene from probes, which were read with different values of the learned keys. Returns `None` if the keys do more than set numbers.
    pub(super) fn new(mut probes: Vec<Probe>) -> Result<Option<Self>, AnalysisError> {
        let Some(mut leaves) = learn(&mut probes) else { return Ok(None) };
        let scenes: Vec<&Scene> = probes.iter().map(|probe| &probe.scene).collect();
        let radii = scene_radii(&scenes)?;
        // The radii read only the first member of each class, so the numbers of all other members need not be written for a radius.
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

    /// Returns the number of scene numbers that are written for each radius.
    #[cfg(test)]
    pub(super) fn written(&self) -> usize {
        self.leaves.iter().map(Vec::len).sum()
    }

    /// Returns a copy of the scene for writing values into, and one scratch per radius.
    pub(super) fn scratch(&self) -> (Scene, Vec<RadiusScratch>) {
        (self.scene.clone(), self.radii.iter().map(|_| RadiusScratch::default()).collect())
    }

    /// Writes values of the learned keys, in the order of the keys, into the scene.
    pub(super) fn write(&self, values: &[f64], scene: &mut Scene) {
        set(&self.leaves, values, scene);
    }

    /// Returns the largest radius of the second moment over all combinations of contacts. `values` are those of the learned keys, and must already be written
    /// into `scene`. Where the second moment cannot be followed, the result is the square of the nominal radius, marked as nominal.
    pub(super) fn mean_square<const BOUND: bool>(
        &self,
        values: &[f64],
        scene: &mut Scene,
        scratch: &mut [RadiusScratch],
        watch: &dyn Watch,
    ) -> Result<Cell, AnalysisError> {
        // Without random links the second moment grows by the square of the spectral radius.
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
        // The full analysis reads every peer, not only the first member of each class.
        set(&self.others, values, scene);
        match mean_square_watched(scene, &Limits { watch, ..Limits::of_unknowns(usize::MAX) }) {
            Ok(found) => Ok(Cell { radius: found.radius, is_nominal: false }),
            Err(
                AnalysisError::ChanceWithoutMoments { .. }
                | AnalysisError::TooManyMoments { .. }
                | AnalysisError::OtherStrategy { .. }
                | AnalysisError::Turns { .. }
                | AnalysisError::Topology { .. }
                | AnalysisError::Operator { .. }
                | AnalysisError::SlowDevice { .. },
            ) => Ok(Cell { radius: self.radius::<BOUND>(scene, scratch).over(2), is_nominal: true }),
            Err(error) => Err(error),
        }
    }

    /// Returns the largest spectral radius over all combinations of contacts; 0 if there is no combination. Without `BOUND` the error is not worked out.
    pub(super) fn radius<const BOUND: bool>(&self, scene: &Scene, scratch: &mut [RadiusScratch]) -> Radius {
        let radii = self.radii.iter().zip(scratch).map(|(radius, scratch)| radius.radius::<BOUND>(scene, scratch));
        radii.reduce(worse::<BOUND>).unwrap_or(Radius { value: 0.0, error: 0.0 })
    }
}

/// Writes the value of each key into the numbers that the key sets.
fn set(leaves: &[Vec<Leaf>], values: &[f64], scene: &mut Scene) {
    for (leaves, value) in leaves.iter().zip(values) {
        for leaf in leaves {
            leaf.set(scene, *value);
        }
    }
}
