//! Haptic devices: the trait, and a simulated device in a simulated hand.

use alloc::boxed::Box;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::stepper::Stepper;
use crate::tick::on_device;
use crate::{ArmConfig, Clock, DeviceConfig, Hand, Integrator, Plant, Signal, State};

/// A haptic device, simulated or real, as a peer uses it.
pub trait Device<const A: usize> {
    /// Returns position and velocity of the device at the present tick. A peer asks several times per tick, and every answer of a tick must be the same.
    fn state(&self) -> State<A>;

    /// Holds the coupling force FC \[N\], which acts on the device with the opposite sign, from `now` until the next tick, `span` later.
    ///
    /// A simulated device moves to the next tick. A real device sends the force to its motors, and reads its state at the next call of [`Device::state`].
    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]);
}

impl<const A: usize, D: Device<A> + ?Sized> Device<A> for Box<D> {
    fn state(&self) -> State<A> {
        (**self).state()
    }

    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]) {
        (**self).advance(now, span, coupling_force);
    }
}

/// A device at a fixed position: no hand moves the device, and forces have no effect.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RestingDevice<const A: usize> {
    /// Position of the device \[m\].
    pub position: [f64; A],
}

impl<const A: usize> Device<A> for RestingDevice<A> {
    #[inline]
    fn state(&self) -> State<A> {
        State { position: self.position, velocity: [0.0; A] }
    }

    fn advance(&mut self, _now: Instant, _span: Duration, _coupling_force: [f64; A]) {}
}

/// A simulated device: a damped mass, moved by a hand.
#[derive(Clone, Debug)]
pub struct SimulatedDevice<const A: usize> {
    state: State<A>,
    stepper: Stepper,
    hand: HandForce<A>,
}

/// Force of the hand that is held over a tick. Mass, spring and damper of an arm are part of the plant: see [`DeviceConfig::plant`].
#[derive(Clone, Debug)]
pub struct HandForce<const A: usize>(Kind<A>);

#[derive(Clone, Debug)]
enum Kind<const A: usize> {
    /// A constant force \[N\]. No signal is evaluated at the ticks.
    Constant([f64; A]),
    /// A force \[N\] as a function of time.
    Force(Signal),
    /// The force of an arm's spring and damper at the wanted motion.
    Arm { arm: ArmConfig, follows: Signal },
}

impl DeviceConfig {
    /// Returns the plant of the device with the arm that holds it, if the hand is an arm. The arm's mass moves with the device. The arm's spring and damper
    /// end at the wanted motion, which acts as a held force.
    #[must_use]
    pub fn plant(self, hand: Option<&Hand>) -> Plant {
        let arm = hand.and_then(Hand::arm).unwrap_or(ArmConfig { mass: 0.0, damping: 0.0, stiffness: 0.0 });
        Plant { mass: self.mass + arm.mass, damping: self.damping + arm.damping, stiffness: arm.stiffness }
    }
}

impl<const A: usize> SimulatedDevice<A> {
    /// Returns a device in the state `state` with the hand `hand`; `None` without a hand.
    #[must_use]
    pub fn new(device: DeviceConfig, hand: Option<&Hand>, state: State<A>, integrator: Integrator, clock: &Clock) -> Self {
        Self { state, stepper: Stepper::new(device.plant(hand), integrator, clock), hand: HandForce::of(hand) }
    }

    /// Sets position and velocity of the device.
    pub const fn set_state(&mut self, state: State<A>) {
        self.state = state;
    }

    /// Lets the arm of an operator want the motion `wanted`, from now until the next call. Before the first call the operator exerts no force.
    pub fn want(&mut self, arm: &ArmConfig, wanted: &State<A>) {
        self.hand = HandForce(Kind::Constant(arm.force(wanted)));
    }

    /// Sets the hand. An arm stays the arm with which the device was made; only its wanted motion changes.
    pub fn set_hand(&mut self, hand: Option<&Hand>) {
        self.hand = HandForce::of(hand);
    }
}

impl<const A: usize> HandForce<A> {
    /// Returns the force of a hand; zero for `None`, and for an operator, whose force the driver sets at each tick: see [`SimulatedDevice::want`].
    #[must_use]
    pub fn of(hand: Option<&Hand>) -> Self {
        Self(match hand {
            None | Some(Hand::Operator { .. }) => Kind::Constant([0.0; A]),
            // A constant signal is evaluated here once, and costs nothing at the ticks.
            Some(Hand::Force(signal)) if signal.is_constant() => Kind::Constant(signal.value(Instant::ZERO)),
            Some(Hand::Force(signal)) => Kind::Force(signal.clone()),
            Some(Hand::Arm { arm, follows }) => Kind::Arm { arm: *arm, follows: follows.clone() },
        })
    }

    /// Returns the force \[N\] if it is constant.
    #[must_use]
    pub const fn constant(&self) -> Option<[f64; A]> {
        match &self.0 {
            Kind::Constant(force) => Some(*force),
            Kind::Force(_) | Kind::Arm { .. } => None,
        }
    }

    /// Returns the force \[N\] held over the tick from `now` on.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, now: Instant) -> [f64; A] {
        if let Kind::Constant(force) = &self.0 { *force } else { self.varying(now) }
    }

    /// Returns a force that depends on time \[N\]. Not inlined, so that the tick of a constant hand stays short.
    #[inline(never)]
    fn varying(&self, now: Instant) -> [f64; A] {
        match &self.0 {
            Kind::Constant(force) => *force,
            Kind::Force(signal) => signal.value(now),
            Kind::Arm { arm, follows } => {
                // Stiffness and damping of the arm already act in the plant, so only the wanted motion is left here.
                arm.force(&State { position: follows.value(now), velocity: follows.slope(now) })
            }
        }
    }
}

impl<const A: usize> Device<A> for SimulatedDevice<A> {
    fn state(&self) -> State<A> {
        self.state
    }

    #[inline(always)]
    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]) {
        let hand = self.hand.at(now);
        let force = core::array::from_fn(|axis| on_device(hand[axis], coupling_force[axis]));
        self.stepper.advance(&mut self.state, span, force);
    }
}
