//! A scene that has been read once, in which the learned keys are written without reading it again.

use cohaptic_scene::Scene;

use super::leaves::{Leaf, Probe, learn};
use crate::plan::{Plan, PlanScratch, plans};
use crate::{AnalysisError, Radius};

/// A scene with learned keys.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) scene: Scene,
    /// For each learned key, the numbers that the radius depends on.
    leaves: Vec<Vec<Leaf>>,
    /// One for each combination of contacts.
    plans: Vec<Plan>,
}

impl Prepared {
    /// From scenes read with values for the learned keys; `None` if the keys do more than to set numbers.
    pub(super) fn new(mut probes: Vec<Probe>) -> Result<Option<Self>, AnalysisError> {
        let Some(mut leaves) = learn(&mut probes) else { return Ok(None) };
        let scenes: Vec<&Scene> = probes.iter().map(|probe| &probe.scene).collect();
        let plans = plans(&scenes)?;
        // Of each class only the first member is ever looked at.
        let mut looked_at: Vec<usize> = plans.iter().flat_map(|plan| plan.classes().iter().map(|class| class[0])).collect();
        looked_at.sort_unstable();
        looked_at.dedup();
        for leaves in &mut leaves {
            leaves.retain(|leaf| !matches!(leaf, Leaf::Peer(place, _) if looked_at.binary_search(place).is_err()));
        }
        let scene = probes.swap_remove(0).scene;
        Ok(Some(Self { scene, leaves, plans }))
    }

    pub(super) fn is_varied(&self) -> bool {
        !self.leaves.is_empty()
    }

    /// A scene of one's own to write in, and room for every plan.
    pub(super) fn scratch(&self) -> (Scene, Vec<PlanScratch>) {
        (self.scene.clone(), vec![PlanScratch::default(); self.plans.len()])
    }

    /// The largest radius of all combinations of contacts, with those values of the learned keys.
    pub(super) fn radius<const BOUND: bool>(&self, values: impl Iterator<Item = f64>, (scene, scratch): (&mut Scene, &mut [PlanScratch])) -> Radius {
        for (leaves, value) in self.leaves.iter().zip(values) {
            for leaf in leaves {
                leaf.set(scene, value);
            }
        }
        let radii = self.plans.iter().zip(scratch).map(|(plan, scratch)| plan.radius::<BOUND>(scene, scratch));
        let worst = |one: Radius, other: Radius| {
            if BOUND {
                one.or(other)
            } else if other.value > one.value || other.value.is_nan() {
                other
            } else {
                one
            }
        };
        radii.reduce(worst).unwrap_or(Radius { value: 0.0, error: 0.0 })
    }
}
