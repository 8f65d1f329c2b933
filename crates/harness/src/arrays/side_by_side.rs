//! Many runs, those of one shape at the same time.

use cohaptic_scene::{Axes, FromScene, Scene, Strategies};

use super::eight::WIDTH;
use super::{Arrays, Shape};
use crate::plan::{Model, Plan};
use crate::{NoObserver, Simulation, Summary};

/// Runs scenes that nobody watches, and gives what came out of each, in their order: the same to the bit as [`Simulation::run`] of each alone.
///
/// Neighbours of one shape ([`same_shape`]) are run eight at a time, a number of each in one register: scenes with the same peers, ticks, duration and delays
/// that differ in their seed, in gains, masses, hands, jitter or loss. Others are run alone.
///
/// # Panics
///
/// If a scene is [too large](crate::too_large).
#[must_use]
pub fn run_side_by_side(scenes: &[Scene]) -> Vec<Summary> {
    let mut summaries = Vec::with_capacity(scenes.len());
    let mut rest = scenes;
    while let Some(first) = rest.first() {
        let alike = rest.iter().take(WIDTH).take_while(|scene| same_shape(first, scene)).count().max(1);
        let (now, later) = rest.split_at(alike);
        // Three in eight lanes cost less than three alone.
        if alike >= 3 {
            summaries.extend(run_eight(now));
        } else {
            summaries.extend(now.iter().map(|scene| {
                let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
                summary
            }));
        }
        rest = later;
    }
    summaries
}

/// Whether two scenes can be run side by side.
#[must_use]
pub fn same_shape(one: &Scene, other: &Scene) -> bool {
    let shape = |scene| Shape::of(scene, &Plan::new(scene, Model::Least, false), &FromScene).map(|(shape, _)| shape);
    shape(one).is_some_and(|shape_of_one| Some(shape_of_one) == shape(other))
}

/// Runs up to eight scenes of one shape; the last one fills the lanes that are left.
fn run_eight(scenes: &[Scene]) -> Vec<Summary> {
    let lanes: [&Scene; WIDTH] = std::array::from_fn(|lane| &scenes[lane.min(scenes.len() - 1)]);
    let plan = Plan::new(lanes[0], Model::Least, false);
    let (shape, _) = Shape::of(lanes[0], &plan, &FromScene).expect("scenes that are alike have a shape");
    let gains = lanes.map(|scene| FromScene.towards_mean(scene).expect("scenes that are alike have a shape"));
    let summaries = match plan.axes {
        Axes::One => Arrays::<1, WIDTH>::new(lanes, shape, gains).run(|_| true),
        Axes::Two => Arrays::<2, WIDTH>::new(lanes, shape, gains).run(|_| true),
        Axes::Three => Arrays::<3, WIDTH>::new(lanes, shape, gains).run(|_| true),
    };
    summaries.into_iter().take(scenes.len()).collect()
}
