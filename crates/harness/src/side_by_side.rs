//! Runs many scenes, those of one shape at the same time.

use cohaptic_scene::{Change, FromScene, Scene};

use crate::arrays::{self, Shape, WIDTH};
use crate::plan::{Model, Plan};
use crate::{NoObserver, Simulation, Summary};

/// Runs scenes without observers and returns their summaries in the order of the scenes, each the same to the bit as [`Simulation::run`] of that scene alone.
///
/// Consecutive scenes of one shape ([`same_shape`]) run up to eight at a time if this is faster: scenes with the same peers, ticks, duration, timeline and
/// delays that differ in seed, gains, masses, hands, jitter or loss. All other scenes run alone.
///
/// # Panics
///
/// If a scene needs events and has more than 23,170 peers; see [`crate::too_large`].
#[must_use]
pub fn run_side_by_side(scenes: &[Scene]) -> Vec<Summary> {
    let mut summaries = Vec::with_capacity(scenes.len());
    let mut rest = scenes;
    while let Some(first) = rest.first() {
        let shape = shape(first);
        // Only neighbours are combined, so the results keep the order of the scenes.
        let alike = rest.iter().take(WIDTH).take_while(|scene| shape.is_some() && self::shape(scene) == shape).count();
        if let Some((shape, _)) = shape.filter(|(shape, _)| shape.pays_side_by_side(alike)) {
            let (now, later) = rest.split_at(alike);
            summaries.extend(run_eight(now, shape));
            rest = later;
        } else {
            let Ok(summary) = Simulation::new(first, Model::Least).run(&mut NoObserver);
            summaries.push(summary);
            rest = &rest[1..];
        }
    }
    summaries
}

/// Returns whether two scenes can run side by side.
#[must_use]
pub fn same_shape(one: &Scene, other: &Scene) -> bool {
    shape(one).is_some_and(|shape_of_one| Some(shape_of_one) == shape(other))
}

/// Returns the shape and the timeline of a scene; `None` if the scene cannot run in arrays.
fn shape(scene: &Scene) -> Option<(Shape, &[Change])> {
    Shape::of(scene, &Plan::new(scene, Model::Least, false), &FromScene).ok().map(|(shape, _)| (shape, &scene.timeline[..]))
}

/// Runs up to eight scenes of one shape. The last scene fills the unused lanes; results of unused lanes are discarded.
fn run_eight(scenes: &[Scene], shape: Shape) -> Vec<Summary> {
    let lanes: [&Scene; WIDTH] = std::array::from_fn(|lane| &scenes[lane.min(scenes.len() - 1)]);
    let laws = lanes.map(|scene| scene.law(0).expect("scenes of a shape have a law"));
    let summaries = arrays::run_lanes(lanes, shape, laws, &mut |_| true);
    summaries.into_iter().take(scenes.len()).collect()
}
