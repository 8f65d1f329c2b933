//! The loop shared by all methods: the actions of two peers at a tick, in any number type. Forces are computed at ticks and held, as described in
//! docs/model.md.

use cohaptic_peer::coordination::{AveragePosition, Observation};
use cohaptic_peer::tick::{forces, grasp, on_device};
use cohaptic_peer::{Contact, Gains, Hand, Motion, Plant, Signal};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::advance::Advance;
use super::number::Number;
use super::scenes::{Along, MotionScene, TICK_NANOS};

/// Contact between a device and its copy, on one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Touch {
    Nothing,
    Grasp,
    /// A contact that pushes and cannot pull: 1 towards larger positions, −1 towards smaller positions.
    Push(f64),
}

/// Parameters of the two peers.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Pair {
    pub(crate) coupling: Gains,
    pub(crate) coordination: Gains,
    pub(crate) touch: [Touch; 2],
    /// Plants of the two devices with their arms, then of the two copies.
    pub(crate) plants: [Plant; 4],
    /// Force of each hand at each tick \[N\].
    pub(crate) hands: Vec<[f64; 2]>,
    /// Number of ticks between two samples.
    pub(crate) update: usize,
    /// Delay of a sample \[ticks\].
    pub(crate) delay: usize,
}

impl Pair {
    /// Returns the pair of a scene, for `ticks` ticks.
    pub(crate) fn of(motion: &MotionScene, scene: &Scene, ticks: usize) -> Self {
        let copy = scene.copy_config(0).plant();
        // Arms of these scenes are at rest at the wanted position, and exert no held force.
        let force = |peer: usize, at: Instant| match &scene.peers[peer].hand {
            Some(Hand::Force(signal)) => Signal::value::<1>(signal, at)[0],
            Some(Hand::Arm { .. } | Hand::Operator { .. }) | None => 0.0,
        };
        let touch = |peer: usize| match scene.peers[peer].contact {
            Contact::None => Touch::Nothing,
            Contact::Grasp => Touch::Grasp,
            Contact::Push(direction) => Touch::Push(if direction.positive { 1.0 } else { -1.0 }),
        };
        Self {
            coupling: scene.coupling(0),
            coordination: scene.coordination_gains(scene.coordination.gains, 0),
            touch: [touch(0), touch(1)],
            plants: [scene.device_plant(0), scene.device_plant(1), copy, copy],
            hands: (0..ticks).map(instant).map(|at| [force(0, at), force(1, at)]).collect(),
            update: motion.update,
            delay: motion.delay,
        }
    }

    /// Returns the loop without hands, with the gain `along` replaced: the stability of the loop depends on no hand.
    pub(crate) fn with<T: Number>(&self, along: Along, stiffness: T) -> Loop<T> {
        let mut gains = self.gains();
        match along {
            Along::Coupling => gains.coupling.stiffness = stiffness,
            Along::Coordination => gains.coordination.stiffness = stiffness,
        }
        gains
    }

    /// Returns the parameters of the loop of forces.
    pub(crate) fn gains<T: Number>(&self) -> Loop<T> {
        let exactly = |gains: Gains| gains.map(|gain| T::of(*gain));
        Loop { coupling: exactly(self.coupling), coordination: exactly(self.coordination), touch: self.touch, update: self.update, delay: self.delay }
    }
}

/// Returns the instant of a tick.
fn instant(tick: usize) -> Instant {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number of nanoseconds")]
    Instant::from_nanos(tick as u64 * TICK_NANOS as u64)
}

/// Parameters of the forces of a tick, besides the motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Loop<T> {
    pub(crate) coupling: Gains<T>,
    pub(crate) coordination: Gains<T>,
    pub(crate) touch: [Touch; 2],
    pub(crate) update: usize,
    pub(crate) delay: usize,
}

/// State of the two peers and of the samples on the way.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct World<T> {
    /// Motions of the two devices, then of the two copies.
    pub(crate) bodies: [Motion<T>; 4],
    /// Newest sample held by each peer from its partner.
    pub(crate) held: [Motion<T>; 2],
    /// Motions of the copies at the latest samplings: sample s at the index s modulo the length.
    pub(crate) sent: Vec<[Motion<T>; 2]>,
}

impl<T: Number> World<T> {
    /// Returns the state of rest at the origin.
    pub(crate) fn rest(gains: &Loop<T>) -> Self {
        let rest = Motion { position: T::of(0.0), velocity: T::of(0.0) };
        Self { bodies: [rest; 4], held: [rest; 2], sent: vec![[rest; 2]; gains.delay / gains.update + 1] }
    }

    /// Makes the tick `tick`: sampling, arrival, forces, and motion to the next tick.
    #[inline(always)]
    pub(crate) fn tick(&mut self, gains: &Loop<T>, movers: &[impl Advance<T>; 4], tick: usize, hands: [T; 2]) {
        let places = self.sent.len();
        if tick.is_multiple_of(gains.update) {
            self.sent[tick / gains.update % places] = [self.bodies[2], self.bodies[3]];
        }
        // A sample taken at this tick arrives at this tick for a delay of 0, so sampling comes first.
        if let Some(sending) = tick.checked_sub(gains.delay)
            && sending.is_multiple_of(gains.update)
        {
            let [left, right] = self.sent[sending / gains.update % places];
            self.held = [right, left];
        }
        // The law of the program, in the number type of this loop.
        let law = AveragePosition { gains: gains.coordination };
        for peer in 0..2 {
            let seen = Observation { own: self.bodies[2 + peer], past: self.bodies[2 + peer], mean: self.held[peer], lead: T::of(0.0) };
            let touch = |apart: Motion<T>| coupling_force(gains.touch[peer], &gains.coupling, apart);
            let (coupling, on_object) = forces(self.bodies[peer], touch, &seen, &law, &mut []);
            movers[peer].advance(&mut self.bodies[peer], on_device(hands[peer], coupling));
            // Both motions use the forces of the begin of the tick, because `forces` has computed them before.
            movers[2 + peer].advance(&mut self.bodies[2 + peer], on_object);
        }
    }
}

/// Returns FC \[N\] of a contact, like [`Contact::force_along`] in any number type.
#[inline(always)]
fn coupling_force<T: Number>(touch: Touch, coupling: &Gains<T>, apart: Motion<T>) -> T {
    let nothing = T::of(0.0);
    match touch {
        Touch::Nothing => nothing,
        Touch::Grasp => grasp(coupling, apart),
        Touch::Push(sign) => {
            let sign = T::of(sign);
            let inwards = Motion { position: sign * apart.position, velocity: sign * apart.velocity };
            if inwards.position <= nothing {
                return nothing;
            }
            let force = grasp(coupling, inwards);
            // The damper alone could pull; a contact only pushes.
            if force > nothing { sign * force } else { nothing }
        }
    }
}

/// Runs from rest, and shows the bodies after every tick.
#[inline(always)]
pub(crate) fn run<T: Number>(pair: &Pair, movers: &[impl Advance<T>; 4], mut show: impl FnMut(usize, &[Motion<T>; 4])) -> World<T> {
    let gains = pair.gains();
    let mut world = World::rest(&gains);
    for (tick, hands) in pair.hands.iter().enumerate() {
        world.tick(&gains, movers, tick, hands.map(T::of));
        show(tick, &world.bodies);
    }
    world
}

/// Returns the mechanical energy \[J\]: the motion of devices, arms and copies; the springs of arms and of couplings in contact; and the spring of the
/// coordination without delay, ½·KT·(xO1 − xO2)².
pub(crate) fn energy<T: Number>(pair: &Pair, bodies: &[Motion<T>; 4]) -> T {
    let mut twice = T::of(0.0);
    for (plant, body) in pair.plants.iter().zip(bodies) {
        twice = twice + T::of(plant.mass) * body.velocity * body.velocity + T::of(plant.stiffness) * body.position * body.position;
    }
    for peer in 0..2 {
        // A one-sided contact stores energy only while the device presses into the object.
        let depth = bodies[peer].position - bodies[2 + peer].position;
        let touches = match pair.touch[peer] {
            Touch::Nothing => false,
            Touch::Grasp => true,
            Touch::Push(sign) => T::of(sign) * depth > T::of(0.0),
        };
        if touches {
            twice = twice + T::of(pair.coupling.stiffness) * depth * depth;
        }
    }
    let apart = bodies[2].position - bodies[3].position;
    T::of(0.5) * (twice + T::of(pair.coordination.stiffness) * apart * apart)
}
