//! Linear equations of a peer whose copy turns: six components of the copy, three or six of the device.

use cohaptic_peer::rotation::{Matrix3, Spin, Triple};
use cohaptic_peer::{Contact, Gains, Integrator, Plant, StepMap};
use cohaptic_scene::Scene;

use crate::lifted::Body;
use crate::structure::linear_law;

/// Equations of a peer, or of any peer of a class of equal peers. Angles are multiplied by [`Node::length`], and torques divided by that length.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Step maps of the copy's components, p and θ.
    pub(super) copy: Vec<Body>,
    /// Step maps of the device's components: x, and θH if the device turns.
    pub(super) device: Vec<Body>,
    /// Gains of the coupling to the copy, indexed by component of the device.
    pub(super) coupling: Vec<Gains>,
    /// Combination of the copy's components to which the coupling ties a component of the device, indexed by that component.
    pub(crate) grip: Vec<[f64; 6]>,
    /// True if the device holds the copy.
    pub(super) touching: bool,
    /// Gains of the restoring force by the copy's own state, indexed by component of the copy.
    pub(super) own: [Gains; 6],
    /// Gains of the force towards a held sample, indexed by component of the copy.
    pub(super) heard: [Gains; 6],
    /// Growth of the gain of a sample's velocity per second of the sample's age, indexed by component of the copy.
    pub(super) ahead: [f64; 6],
    /// Age above which a sample is not extrapolated further \[s\]; 0 for a law without a horizon.
    pub(super) horizon: f64,
    /// True if the peer applies its forces a tick late.
    pub(super) compute_delay: bool,
    /// True if an arm with a stiffness holds the device.
    pub(super) armed: bool,
    /// Grasp point in body axes \[m\].
    pub(super) grasp: Triple,
    /// Changes of the equations by a load. The gains of turns that these changes replace are zero in the node.
    pub(super) stress: Option<Box<Stress>>,
    /// Length √(tr J/3m) by which angles are multiplied \[m\].
    pub(crate) length: f64,
    /// Span of a tick divided by the mass of the copy [m/(N·s)]: the change of the copy's velocity in a tick per force.
    pub(crate) mobility: f64,
}

/// Changes of a node's equations by a load, in the units of the node's states.
#[derive(Clone, Debug)]
pub(super) struct Stress {
    /// Torque on the copy per turn of the copy, without the coupling torque of the device.
    pub(super) own: Matrix3,
    /// Torque on the copy per turn and per angular velocity of a held sample, indexed by the peer that sent the sample.
    pub(super) heard: Vec<[Matrix3; 2]>,
    /// Coupling torque; `None` if the device has no attitude or touches nothing.
    pub(super) twist: Option<Twist>,
}

/// Coupling torque τC between copy and device, and its reaction on a device that turns.
#[derive(Clone, Debug)]
pub(super) struct Twist {
    /// Change of τC per turn of the copy, turn of the device, angular velocity of the copy, and angular velocity of the device.
    pub(super) by: [Matrix3; 4],
    /// Torque on the device per change of τC, turn of the copy, and turn of the device.
    pub(super) back: [Matrix3; 3],
    /// Torque of the hand on the device per turn of the device.
    pub(super) hand: Matrix3,
}

impl Node {
    /// Returns the node of the peer with the index `place` in a scene whose object turns, without a load.
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

    /// Returns the number of states of the node, samples not included.
    pub(super) fn states(&self) -> usize {
        let pending = if self.compute_delay { 6 + if self.touching { self.device.len() } else { 0 } } else { 0 };
        12 + 2 * self.device.len() + pending
    }

    /// Returns the components of the device on whose positions no force depends: those of a device that touches nothing, except translations held by an arm.
    pub(super) fn loose(&self) -> impl Iterator<Item = usize> {
        let held = if self.armed { 3 } else { 0 };
        held..if self.touching { 0 } else { self.device.len() }
    }
}

/// Converts the gains of an angle to gains of a length; `square` is the square of the node's length.
fn over(gains: Gains, square: f64) -> Gains {
    Gains { stiffness: gains.stiffness / square, damping: gains.damping / square }
}

/// Returns the step map of a small turn. It is the step map of a translation except for Euler's method, which is explicit for turns.
fn turn(plant: &Plant, integrator: Integrator, steps: u32, span: std::time::Duration) -> StepMap {
    match integrator {
        Integrator::Exact => plant.step(span, integrator),
        Integrator::RungeKutta4 { steps: within } => plant.step(span, Integrator::RungeKutta4 { steps: within.saturating_mul(steps) }),
        Integrator::SemiImplicitEuler { steps: within } => {
            let steps = within.saturating_mul(steps);
            let h = span.as_secs_f64() / f64::from(steps);
            let (decay, push) = (h * plant.damping / plant.mass, h / plant.mass);
            // Increments of angle and rate after some steps, each per initial rate and per torque. Increments keep the digits that a difference from 1 would
            // lose.
            let (mut angle, mut rate) = ([0.0, 0.0], [0.0, 0.0]);
            for _ in 0..steps {
                angle = [angle[0] + h * (1.0 + rate[0]), angle[1] + h * rate[1]];
                rate = [rate[0] - decay * (1.0 + rate[0]), rate[1] - decay * rate[1] + push];
            }
            StepMap::new([[0.0, angle[0]], [0.0, rate[0]]], [angle[1], rate[1]])
        }
    }
}
