//! Many runs, those of one shape at the same time.

use cohaptic_peer::EXACT_FROM;
use cohaptic_scene::{Change, FromScene, Scene};

use super::Shape;
use super::lanes::WIDTH;
use super::shape::Way;
use crate::plan::{Model, Plan};
use crate::{NoObserver, Simulation, Summary};

/// Runs scenes that nobody watches, and gives what came out of each, in their order: the same to the bit as [`Simulation::run`] of each alone.
///
/// Neighbours of one shape ([`same_shape`]) are run eight at a time where that pays, a number of each in one register: scenes with the same peers, ticks,
/// duration, timeline and delays that differ in their seed, in gains, masses, hands, jitter or loss. Others are run alone.
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
        let alike = rest.iter().take(WIDTH).take_while(|scene| shape.is_some() && self::shape(scene) == shape).count();
        if let Some((shape, _)) = shape.filter(|(shape, _)| pays(shape, alike)) {
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

/// Whether that number of scenes of a shape is run faster in eight lanes than one after the other.
///
/// Lanes that nobody needs cost what the others do. Where samples travel together, eight runs of three peers take a third of the time of eight alone, of ten
/// peers half of it. Where each packet has an arrival of its own, that is most of the work and done for each run by itself: eight runs of three peers take
/// half, of ten peers five sixths, and from sixteen peers on more than alone, since eight times the samples in flight do not fit into the nearest cache.
/// Exact means are those of one run.
fn pays(shape: &Shape, alike: usize) -> bool {
    if shape.delay.is_some() { alike >= 5 && shape.peers <= EXACT_FROM } else { alike >= 7 && shape.peers <= 12 && shape.way == Way::Direct }
}

/// Whether two scenes can be run side by side.
#[must_use]
pub fn same_shape(one: &Scene, other: &Scene) -> bool {
    shape(one).is_some_and(|shape_of_one| Some(shape_of_one) == shape(other))
}

/// The shape of a scene that can be run in arrays, and what changes on its way.
fn shape(scene: &Scene) -> Option<(Shape, &[Change])> {
    Shape::of(scene, &Plan::new(scene, Model::Least, false), &FromScene).ok().map(|(shape, _)| (shape, &scene.timeline[..]))
}

/// Runs up to eight scenes of one shape; the last one fills the lanes that are left.
fn run_eight(scenes: &[Scene], shape: Shape) -> Vec<Summary> {
    let lanes: [&Scene; WIDTH] = std::array::from_fn(|lane| &scenes[lane.min(scenes.len() - 1)]);
    let laws = lanes.map(|scene| scene.law(0).expect("scenes of a shape have a law"));
    let summaries = super::run_lanes(lanes, shape, laws, &mut |_| true);
    summaries.into_iter().take(scenes.len()).collect()
}
