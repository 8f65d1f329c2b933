//! Haptic devices: the trait, and the simulated device with the hand that moves it.

use alloc::boxed::Box;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::stepper::Stepper;
use crate::tick::on_device;
use crate::{ArmConfig, Clock, DeviceConfig, Hand, Integrator, Plant, Signal, State};

/// What a peer needs of a haptic device, simulated or real.
pub trait Device<const A: usize> {
    /// Position and velocity of the device at the present tick. It is asked several times a tick and must give the same answer each time.
    fn state(&self) -> State<A>;

    /// Holds the coupling force FC, which the device feels with the opposite sign, from `now` until the next tick, `span` later.
    ///
    /// A simulated device moves there. A real one sends the force to its motors and reads its state when it is next asked.
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

/// A device that nobody moves and that touches nothing: it stays where it is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RestingDevice<const A: usize> {
    /// Where it is.
    pub position: [f64; A],
}

impl<const A: usize> Device<A> for RestingDevice<A> {
    #[inline]
    fn state(&self) -> State<A> {
        State { position: self.position, velocity: [0.0; A] }
    }

    #[inline]
    fn advance(&mut self, _now: Instant, _span: Duration, _coupling_force: [f64; A]) {}
}

/// A simulated device: a damped mass, moved by a hand.
#[derive(Clone, Debug)]
pub struct SimulatedDevice<const A: usize> {
    state: State<A>,
    stepper: Stepper,
    hand: HandForce<A>,
}

/// The force of the hand that is held over a tick. The rest of an arm is part of the plant: see [`DeviceConfig::plant`].
#[derive(Clone, Debug)]
pub struct HandForce<const A: usize>(Kind<A>);

#[derive(Clone, Debug)]
enum Kind<const A: usize> {
    Constant([f64; A]),
    Force(Signal),
    Arm { arm: ArmConfig, follows: Signal },
}

impl DeviceConfig {
    /// The device with the arm that holds it, if the hand is one: the arm's mass moves with the device; its spring and damper end at the wanted motion, which
    /// enters as a held force.
    #[must_use]
    pub fn plant(self, hand: Option<&Hand>) -> Plant {
        let arm = hand.and_then(Hand::arm).unwrap_or(ArmConfig { mass: 0.0, damping: 0.0, stiffness: 0.0 });
        Plant { mass: self.mass + arm.mass, damping: self.damping + arm.damping, stiffness: arm.stiffness }
    }
}

impl<const A: usize> SimulatedDevice<A> {
    /// A device in that state with that hand; `None` is no hand.
    #[must_use]
    pub fn new(device: DeviceConfig, hand: Option<&Hand>, state: State<A>, integrator: Integrator, clock: &Clock) -> Self {
        Self { state, stepper: Stepper::new(device.plant(hand), integrator, clock), hand: HandForce::of(hand) }
    }

    /// Puts the device into that state.
    pub const fn set_state(&mut self, state: State<A>) {
        self.state = state;
    }

    /// Changes what the hand does. An arm stays the arm that the device was made with; only its wanted motion changes.
    pub fn set_hand(&mut self, hand: Option<&Hand>) {
        self.hand = HandForce::of(hand);
    }
}

impl<const A: usize> HandForce<A> {
    /// The force of that hand; `None` is no hand.
    #[must_use]
    pub fn of(hand: Option<&Hand>) -> Self {
        Self(match hand {
            None => Kind::Constant([0.0; A]),
            Some(Hand::Force(signal)) if signal.is_constant() => Kind::Constant(signal.value(Instant::ZERO)),
            Some(Hand::Force(signal)) => Kind::Force(signal.clone()),
            Some(Hand::Arm { arm, follows }) => Kind::Arm { arm: *arm, follows: follows.clone() },
        })
    }

    /// The force, if it is the same at all times.
    #[must_use]
    pub const fn constant(&self) -> Option<[f64; A]> {
        match &self.0 {
            Kind::Constant(force) => Some(*force),
            Kind::Force(_) | Kind::Arm { .. } => None,
        }
    }

    /// The force that is held from that instant over a tick \[N\].
    #[must_use]
    #[inline(always)]
    pub fn at(&self, now: Instant) -> [f64; A] {
        if let Kind::Constant(force) = &self.0 { *force } else { self.varying(now) }
    }

    #[inline(never)]
    fn varying(&self, now: Instant) -> [f64; A] {
        match &self.0 {
            Kind::Constant(force) => *force,
            Kind::Force(signal) => signal.value(now),
            Kind::Arm { arm, follows } => {
                let (wanted, speed) = (follows.value::<A>(now), follows.slope::<A>(now));
                core::array::from_fn(|axis| arm.stiffness * wanted[axis] + arm.damping * speed[axis])
            }
        }
    }
}

impl<const A: usize> Device<A> for SimulatedDevice<A> {
    #[inline]
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
