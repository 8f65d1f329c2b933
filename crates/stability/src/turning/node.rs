//! A peer whose copy turns, linearised at rest: six components of the copy, three or six of the device.

use cohaptic_peer::rotation::{Spin, Triple};
use cohaptic_peer::{Contact, Gains, Integrator, Plant, StepMap};
use cohaptic_scene::Scene;

use super::stress::Stress;
use crate::lifted::Body;
use crate::structure::linear_law;

/// A peer, or what a class of equal peers has in common. Angles are multiplied by [`Node::length`], and torques divided by it.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// p and θ.
    pub(super) copy: Vec<Body>,
    /// x, and θH if the device turns.
    pub(super) device: Vec<Body>,
    /// For each component of the device, the gains of its coupling to the copy.
    pub(super) coupling: Vec<Gains>,
    /// For each component of the device, the row of the copy's components that it is held to.
    pub(crate) grip: Vec<[f64; 6]>,
    pub(super) touching: bool,
    /// What draws each component of the copy back by its own state, and towards that of a sample.
    pub(super) own: [Gains; 6],
    pub(super) heard: [Gains; 6],
    /// By how much more a sample's velocity counts for each second of its age, up to the horizon.
    pub(super) ahead: [f64; 6],
    pub(super) horizon: f64,
    pub(super) compute_delay: bool,
    /// Whether an arm with a stiffness holds the device.
    pub(super) armed: bool,
    pub(super) grasp: Triple,
    /// What a load changes: rows of `grip` and gains of turns that it replaces are those of a node without.
    pub(super) stress: Option<Box<Stress>>,
    /// √(tr J/3m) \[m\].
    pub(crate) length: f64,
    /// How far a force moves the copy within a tick, over a second [m/(N·s)].
    pub(crate) mobility: f64,
}

impl Node {
    /// The peer in that place of a scene that turns.
    pub(super) fn of(scene: &Scene, place: usize) -> Self {
        let spec = &scene.peers[place];
        let config = scene.rotation_config(place).expect("the object turns");
        let law = linear_law(scene, place).expect("the laws of objects that turn are linear");
        let mass = scene.copy_mass();
        let length = (config.copy.inertia.iter().sum::<f64>() / (3.0 * mass)).sqrt();
        let square = length * length;
        let moves = |plant| Body::new(plant, scene.integrator, &spec.clock);
        let turns = |spin: &Spin, axis: usize| {
            let plant = Plant { mass: spin.inertia[axis] / square, damping: spin.damping[axis] / square, stiffness: 0.0 };
            Body::from_steps(&spec.clock, |span| turn(&plant, scene.integrator, config.steps, span))
        };
        let (copy_plant, device_plant) = (scene.copy_config(place).plant(), scene.device_plant(place));
        let copy = (0..3).map(|_| moves(copy_plant)).chain((0..3).map(|axis| turns(&config.copy, axis))).collect();
        let mut device: Vec<Body> = (0..3).map(|_| moves(device_plant)).collect();
        let mut coupling = vec![scene.coupling(place); 3];
        let [x, y, z] = config.grasp.map(|component| component / length);
        // −[r]·θ = θ×r.
        let mut grip = vec![[1.0, 0.0, 0.0, 0.0, z, -y], [0.0, 1.0, 0.0, -z, 0.0, x], [0.0, 0.0, 1.0, y, -x, 0.0]];
        if let Some(handle) = &config.device {
            device.extend((0..3).map(|axis| turns(&handle.handle, axis)));
            coupling.extend([over(handle.coupling, square); 3]);
            grip.extend((3..6).map(|axis| std::array::from_fn(|component| if component == axis { 1.0 } else { 0.0 })));
        }
        let turned = |axis: usize| over(Gains { stiffness: config.gains.stiffness[axis], damping: config.gains.damping[axis] }, square);
        let both = |translation: Gains| std::array::from_fn(|axis| if axis < 3 { translation } else { turned(axis - 3) });
        Self {
            copy,
            device,
            coupling,
            grip,
            touching: spec.contact == Contact::Grasp,
            own: both(law.force.own),
            heard: both(law.force.heard),
            ahead: std::array::from_fn(|axis| if axis < 3 { law.force.ahead } else { 0.0 }),
            horizon: law.horizon.unwrap_or(0.0),
            compute_delay: spec.compute_delay,
            armed: device_plant.stiffness > 0.0,
            grasp: config.grasp,
            stress: None,
            length,
            mobility: spec.clock.tick.as_secs_f64() / mass,
        }
    }

    /// How many states it has.
    pub(super) fn states(&self) -> usize {
        let pending = if self.compute_delay { 6 + if self.touching { self.device.len() } else { 0 } } else { 0 };
        12 + 2 * self.device.len() + pending
    }

    /// The components of a device that touches nothing and that nothing holds: where it is, nothing depends on.
    pub(super) fn loose(&self) -> impl Iterator<Item = usize> {
        let held = if self.armed { 3 } else { 0 };
        held..if self.touching { 0 } else { self.device.len() }
    }
}

/// Gains of an angle as those of a length.
fn over(gains: Gains, square: f64) -> Gains {
    Gains { stiffness: gains.stiffness / square, damping: gains.damping / square }
}

/// The linear part of a turn: as that of a translation, but for Euler's method, which is explicit for turns.
fn turn(plant: &Plant, integrator: Integrator, steps: u32, span: std::time::Duration) -> StepMap {
    match integrator {
        Integrator::Exact => plant.step(span, integrator),
        Integrator::RungeKutta4 { steps: within } => plant.step(span, Integrator::RungeKutta4 { steps: within.saturating_mul(steps) }),
        Integrator::SemiImplicitEuler { steps: within } => {
            let steps = within.saturating_mul(steps);
            let h = span.as_secs_f64() / f64::from(steps);
            let (decay, push) = (h * plant.damping / plant.mass, h / plant.mass);
            // Increments of angle and rate, by the rate and by the torque, of as many steps.
            let (mut angle, mut rate) = ([0.0, 0.0], [0.0, 0.0]);
            for _ in 0..steps {
                angle = [angle[0] + h * (1.0 + rate[0]), angle[1] + h * rate[1]];
                rate = [rate[0] - decay * (1.0 + rate[0]), rate[1] - decay * rate[1] + push];
            }
            StepMap::new([[0.0, angle[0]], [0.0, rate[0]]], [angle[1], rate[1]])
        }
    }
}
