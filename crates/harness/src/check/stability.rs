//! Stability of a scene by simulation: the fate of a small disturbance.
//!
//! The scene runs twice with the same hands, links and random numbers. In the second run every device and every copy begins displaced by up to a micrometre.
//! The difference of the two runs obeys the scene's autonomous dynamics (exactly, if the scene is linear), independent of the hands. The difference dies out if
//! the scene is stable and grows if the scene is unstable. Only *relative* displacements count: between copies, and between a device and its copy while both
//! touch. The position of all bodies together has no meaning for stability, because space has no origin.
//!
//! Limits: With random links the answer holds for the scene's seed, so this is almost-sure stability, not mean-square stability. The difference of two runs is
//! only as exact as positions are: for copies beyond 10⁶ m, rounding (10⁻¹⁰ m there) comes near the size of a disturbance that has died out.

use cohaptic_peer::Contact;
use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_scene::{Axes, Scene};
use cohaptic_units::Instant;

use super::Finding;
use crate::disturbance::Disturbance;
use crate::observer::{Erased, NoObserver};
use crate::plan::{Model, Plan};
use crate::simulation::{Simulation, questions_of};
use crate::world::{NoRemote, Step, Watch, World};

/// Fate of a disturbance.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Stability {
    /// The disturbance died out.
    Stable,
    /// The disturbance grew.
    Unstable,
    /// The disturbance neither clearly grew nor clearly died out within the scene's duration.
    Undecided {
        /// Largest relative displacement in the last quarter of the scene, divided by the largest in the second quarter.
        ratio: f64,
    },
    /// The run was interrupted.
    Interrupted,
}

impl Stability {
    /// Returns the finding for the expectation `stable`: `true` for a stable scene, `false` for an unstable one.
    #[must_use]
    pub(crate) fn finding(self, stable: bool) -> Finding {
        let passed = matches!((self, stable), (Self::Stable, true) | (Self::Unstable, false));
        let found = match self {
            Self::Stable => "a small disturbance dies out".to_owned(),
            Self::Unstable => "a small disturbance grows".to_owned(),
            Self::Undecided { ratio } => format!(
                "the scene's duration is too short to tell: from its second to its last quarter a small disturbance changes by a factor of {ratio:.3}; \
                 a longer duration decides"
            ),
            Self::Interrupted => "the simulation was interrupted".to_owned(),
        };
        Finding { passed, found, radius: None }
    }
}

/// Size of the disturbance \[m\].
const SIZE: f64 = 1e-6;
/// Factor of the initial size below which a disturbance has died out, whatever its course.
const DIED_OUT: f64 = 1e-3;
/// Factor of the initial size above which a disturbance has grown, even if walls or a one-sided contact bound its size later.
const GREW: f64 = 1e3;
/// Factor of change from the second to the last quarter of the scene from which a disturbance has grown or died out in all other cases.
const CLEARLY: f64 = 1.1;

/// Returns the fate of a small disturbance of the scene within its duration.
#[must_use]
pub fn stability(scene: &Scene, model: Model, mut keep_going: impl FnMut() -> bool) -> Stability {
    told_by_runs(scene, model, &mut keep_going)
}

/// Like [`stability`], compiled once here. With a generic closure, each calling crate would compile the engine again.
fn told_by_runs(scene: &Scene, model: Model, keep_going: &mut dyn FnMut() -> bool) -> Stability {
    let plan = Plan::new(scene, model, false);
    match plan.axes {
        Axes::One => follow(pair::<1>(scene, model, &plan), scene, keep_going),
        Axes::Two | Axes::Three => follow(pair::<3>(scene, model, &plan), scene, keep_going),
    }
}

fn pair<const A: usize>(scene: &Scene, model: Model, plan: &Plan) -> (World<A, BuiltInStrategy<A>>, World<A, BuiltInStrategy<A>>) {
    let disturbed = Simulation::disturbed(scene, model, Disturbance { size: SIZE });
    (Simulation::new(scene, model).world(plan, NoRemote), disturbed.world(plan, NoRemote))
}

/// Runs both worlds step by step, and compares their positions after each step.
fn follow<const A: usize>(
    (mut nominal, mut disturbed): (World<A, BuiltInStrategy<A>>, World<A, BuiltInStrategy<A>>),
    scene: &Scene,
    keep_going: &mut dyn FnMut() -> bool,
) -> Stability {
    let nothing = Watch::NOTHING;
    let duration = scene.duration.as_nanos();
    let quarter = |now: Instant| 4 * u128::from(now.as_nanos()) / duration;
    let initial = relative_displacement(&nominal, &disturbed);
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    let mut steps = 0_u64;
    let between_questions = u64::from(questions_of(scene));
    loop {
        let Ok((one, other)) =
            Erased::run(&mut NoObserver, |observer| Ok((nominal.step(1, observer, nothing)?, disturbed.step(1, observer, nothing)?)));
        if one == Step::Ticked(1) && other == Step::Ticked(1) {
            let size = relative_displacement(&nominal, &disturbed);
            // Only the second and the last quarter are compared: see `verdict`.
            match quarter(nominal.now()) {
                1 => early = early.max(size),
                3 => late = late.max(size),
                _ => {}
            }
            if !size.is_finite() {
                return Stability::Unstable;
            }
        } else if one != other || one != Step::Ended(crate::Ending::Complete) {
            // One of the two diverged, or both did.
            return Stability::Unstable;
        } else {
            return verdict(initial, early, late);
        }
        steps += 1;
        if steps.is_multiple_of(between_questions) && !keep_going() {
            return Stability::Interrupted;
        }
    }
}

fn verdict(initial: f64, early: f64, late: f64) -> Stability {
    // Growth below `DIED_OUT` is rounding: a disturbance that has died out may still fluctuate.
    if late > GREW * initial || late > CLEARLY * early && late > DIED_OUT * initial {
        Stability::Unstable
    } else if late < DIED_OUT * initial || CLEARLY * late < early {
        Stability::Stable
    } else {
        Stability::Undecided { ratio: late / early }
    }
}

/// Returns the largest difference between the two runs in a relative position along an axis \[m\].
fn relative_displacement<const A: usize>(nominal: &World<A, BuiltInStrategy<A>>, disturbed: &World<A, BuiltInStrategy<A>>) -> f64 {
    let (mut low, mut high, mut stretch) = ([f64::INFINITY; A], [f64::NEG_INFINITY; A], 0.0_f64);
    // Rotations between the two runs of each copy, in world axes, times the length that converts angles to distances \[m\].
    let (mut least, mut greatest) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (one, other) in nominal.bodies().zip(disturbed.bodies()) {
        for axis in 0..A {
            let copy = other.object[axis] - one.object[axis];
            // The device is compared with the grasped point, which differs from the centre if the copy turns.
            let device = (other.device[axis] - one.device[axis]) - (other.grasp[axis] - one.grasp[axis]);
            // A common displacement of all copies means nothing, so only the spread of the copies' displacements counts.
            low[axis] = low[axis].min(copy);
            high[axis] = high[axis].max(copy);
            let touches = match one.contact {
                Contact::Grasp => true,
                Contact::None => false,
                Contact::Push(direction) => direction.axis == axis,
            };
            if touches {
                stretch = stretch.max(device.abs());
            }
        }
        if let (Some(one), Some(other), contact) = (one.turns, other.turns, one.contact) {
            let copy = other.object.rotation_from(&one.object.orientation).map(|angle| angle * one.length);
            for axis in 0..3 {
                least[axis] = least[axis].min(copy[axis]);
                greatest[axis] = greatest[axis].max(copy[axis]);
            }
            if let (Some(before), Some(after), Contact::Grasp) = (one.device, other.device, contact) {
                let device = after.rotation_from(&before.orientation).map(|angle| angle * one.length);
                stretch = (0..3).map(|axis| (device[axis] - copy[axis]).abs()).fold(stretch, f64::max);
            }
        }
    }
    // Without turning copies the bounds are still infinite.
    let turned = if least[0].is_finite() { (0..3).map(|axis| greatest[axis] - least[axis]).fold(0.0, f64::max) } else { 0.0 };
    (0..A).map(|axis| high[axis] - low[axis]).fold(stretch.max(turned), f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_follow_the_stated_factors() {
        assert_eq!(verdict(1.0, 0.5, 0.4), Stability::Stable);
        assert_eq!(verdict(1.0, 0.4, 0.5), Stability::Unstable);
        assert!(matches!(verdict(1.0, 0.5, 0.5), Stability::Undecided { .. }));
        assert_eq!(verdict(1.0, 1e-9, 1e-8), Stability::Stable, "rounding noise is no growth");
        assert_eq!(verdict(1.0, 5000.0, 5000.0), Stability::Unstable, "bounded by walls, but grown");
    }
}
