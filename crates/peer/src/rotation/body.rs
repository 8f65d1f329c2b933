//! Rotation of a peer: the copy, and the device if the device rotates.
//!
//! In: attitudes of other peers, and the translation of copy and device. Out: torques, the attitude of the copy, and FC at the grasped point. This module
//! does not know how attitudes travel.

use alloc::boxed::Box;
use core::array::from_fn;
use core::time::Duration;

use cohaptic_units::Instant;

use super::algebra::{add, by_component, subtract};
use super::alignment::{in_body_axes, lever, reaction};
use super::attitude::point_of;
use super::held::HeldAttitude;
use super::law::TurnLaw;
use super::{Attitude, HeldAttitudes, RotationStep, Spin, Triple, aligning_torque, turning_torque};
use crate::coordination::BuiltIn;
use crate::{Clock, Contact, Gains, Integrator, Signal, State};

/// Parameters of the rotation of a peer.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationConfig {
    /// Share of this copy in the object's inertia, and its damping.
    pub copy: Spin,
    /// Point of the copy that the device grasps, from the centre of mass in body axes \[m\].
    pub grasp: Triple,
    /// Gains KR [N·m/rad] and BR [N·m·s/rad] towards the mean of the other copies, about the body's axes.
    pub gains: Gains<Triple>,
    /// Rotation of the device; `None` for a device that does not rotate.
    pub device: Option<DeviceRotation>,
    /// Method between ticks, with its steps per tick for translations.
    pub integrator: Integrator,
    /// Steps per tick for rotations, at least 1, in addition to the steps of the integrator.
    pub steps: u32,
}

/// A device with six degrees of freedom.
#[derive(Clone, PartialEq, Debug)]
pub struct DeviceRotation {
    /// Inertia and damping of the device, in handle axes.
    pub handle: Spin,
    /// Gains KCR [N·m/rad] and BCR [N·m·s/rad] of the coupling.
    pub coupling: Gains,
    /// Torque of the hand in world axes \[N·m\].
    pub hand: Option<Signal>,
}

/// Torques of a tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Torques {
    /// Torque r×RᵀFC + τC of device and coupling on the copy, in body axes \[N·m\].
    pub coupling: Triple,
    /// Held part of τT in body axes \[N·m\], without the damping of the copy by the law. Acts on the copy with the opposite sign.
    pub coordination: Triple,
    /// Torque on the device in handle axes \[N·m\], without the torque of the hand.
    device: Triple,
}

impl Torques {
    const NONE: Self = Self { coupling: [0.0; 3], coordination: [0.0; 3], device: [0.0; 3] };
}

/// Rotation of a peer: attitudes of copy and device, held attitudes of other peers, and torques.
#[derive(Clone, Debug)]
pub struct Rotation {
    config: RotationConfig,
    /// Law with a memory or a lag; `None` if τT is the sum of spring and damper.
    law: Option<Box<TurnLaw>>,
    /// β about each axis [N·m·s/rad], part of the damping of the copy.
    own_damping: Triple,
    copy: Turning,
    device: Option<Turning>,
    held: HeldAttitudes,
    /// `true` if a held attitude has changed since the last computation of the means.
    stale: bool,
    computed: Torques,
    applied: Torques,
}

/// A rotating body and its steps for the spans between ticks.
#[derive(Clone, Debug)]
struct Turning {
    attitude: Attitude,
    spin: Spin,
    short: (Duration, RotationStep),
    long: (Duration, RotationStep),
}

impl Turning {
    fn new(attitude: Attitude, spin: Spin, config: &RotationConfig, clock: &Clock) -> Self {
        let (short, long) = clock.spans();
        let step = |span| (span, spin.step(span, config.integrator, config.steps));
        Self { attitude, spin, short: step(short), long: step(long) }
    }

    #[inline]
    fn advance(&mut self, span: Duration, torque: Triple, config: &RotationConfig) {
        let other;
        let step = if span == self.short.0 {
            &self.short.1
        } else if span == self.long.0 {
            &self.long.1
        } else {
            // A span of another clock: the driver that passes it pays for a new step at each call.
            other = self.spin.step(span, config.integrator, config.steps);
            &other
        };
        step.advance(&mut self.attitude, torque);
    }

    /// Sets the damping [N·m·s/rad], from the next step on.
    fn set_damping(&mut self, damping: Triple, config: &RotationConfig) {
        self.spin.damping = damping;
        for (span, step) in [&mut self.short, &mut self.long] {
            *step = self.spin.step(*span, config.integrator, config.steps);
        }
    }
}

/// Returns the A components as three; missing components are zero.
fn triple<const A: usize>(components: &[f64; A]) -> Triple {
    from_fn(|axis| components.get(axis).copied().unwrap_or(0.0))
}

impl Rotation {
    /// Returns the rotation of a peer that holds the initial attitudes `held` of other peers. Copy and device begin with `attitude`.
    #[must_use]
    pub fn new(config: RotationConfig, attitude: Attitude, held: HeldAttitudes, clock: &Clock) -> Self {
        let copy = Turning::new(attitude, config.copy, &config, clock);
        let device = config.device.as_ref().map(|device| Turning::new(attitude, device.handle, &config, clock));
        // Without `with_law` the torque is the sum of spring and damper.
        let (law, own_damping) = (None, [0.0; 3]);
        Self { law, own_damping, copy, device, held, stale: false, computed: Torques::NONE, applied: Torques::NONE, config }
    }

    /// Adds the law that makes τT from the torques of spring and damper; without a law τT is their sum. `law` has gains of 1, because
    /// [`RotationConfig::gains`] are already in these torques. `own_damping` is β about each axis [N·m·s/rad], the damping of the copy by the law: part of
    /// the damping in [`RotationConfig::copy`], and of τT in the record.
    #[must_use]
    pub fn with_law(mut self, law: &BuiltIn, own_damping: Triple) -> Self {
        self.law = TurnLaw::is_needed(law).then(|| Box::new(TurnLaw::new(*law)));
        self.own_damping = own_damping;
        self
    }

    /// Sets the parameters of the law of [`Rotation::with_law`], from the next tick on. `damping` is the damping of the copy, with β included [N·m·s/rad].
    pub fn set_law(&mut self, law: &BuiltIn, own_damping: Triple, damping: Triple) {
        // A known law keeps its memory; a new law begins with an empty memory.
        match &mut self.law {
            Some(known) => known.set(*law),
            None => self.law = TurnLaw::is_needed(law).then(|| Box::new(TurnLaw::new(*law))),
        }
        self.own_damping = own_damping;
        self.config.copy.damping = damping;
        self.copy.set_damping(damping, &self.config);
    }

    /// Returns whether the attitudes of copy and device are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.copy.attitude.is_finite() && self.device.as_ref().is_none_or(|device| device.attitude.is_finite())
    }

    /// Returns the attitude of the copy.
    #[must_use]
    pub const fn copy(&self) -> &Attitude {
        &self.copy.attitude
    }

    /// Returns the attitude of the device; `None` for a device that does not rotate.
    #[must_use]
    pub fn device(&self) -> Option<&Attitude> {
        self.device.as_ref().map(|device| &device.attitude)
    }

    /// Returns the torques computed at the latest tick, for the record.
    #[must_use]
    pub const fn computed(&self) -> &Torques {
        &self.computed
    }

    /// Returns the torques over the tick from now on.
    #[must_use]
    pub const fn applied(&self) -> &Torques {
        &self.applied
    }

    /// Returns τT of the latest tick with the share of β, in body axes \[N·m\].
    #[must_use]
    pub fn coordination_torque(&self) -> Triple {
        add(self.computed.coordination, by_component(self.own_damping, self.copy.attitude.rate))
    }

    /// Returns β about each axis [N·m·s/rad].
    #[must_use]
    pub const fn own_damping(&self) -> Triple {
        self.own_damping
    }

    /// Returns the integral of the copy's angular velocity in body axes over the step to the next tick \[rad\]. Valid between [`crate::Peer::compute`] and
    /// [`crate::Peer::advance`].
    #[must_use]
    pub fn travel(&self, span: Duration) -> Triple {
        let step = self.copy.spin.step(span, self.config.integrator, self.config.steps);
        // On a copy of the attitude: a question about the step must not take the step.
        let mut body = self.copy.attitude;
        step.travel(&mut body, self.on_copy())
    }

    /// Returns the torque held on the copy over the tick that begins now, without damping, in body axes \[N·m\].
    #[must_use]
    pub fn on_copy(&self) -> Triple {
        subtract(self.applied.coupling, self.applied.coordination)
    }

    /// Returns the parameters of the rotation.
    #[must_use]
    pub const fn config(&self) -> &RotationConfig {
        &self.config
    }

    /// Sets KR and BR, from the next tick on.
    pub const fn set_gains(&mut self, gains: Gains<Triple>) {
        self.config.gains = gains;
    }

    /// Sets the torque of the hand \[N·m\]. No effect on a device that does not rotate.
    pub fn set_hand(&mut self, hand: Option<Signal>) {
        if let Some(device) = &mut self.config.device {
            device.hand = hand;
        }
    }

    /// Sets the attitude of the copy.
    pub const fn set_copy(&mut self, attitude: Attitude) {
        self.copy.attitude = attitude;
    }

    /// Sets the attitude of the device. No effect on a device that does not rotate.
    pub const fn set_device(&mut self, attitude: Attitude) {
        if let Some(device) = &mut self.device {
            device.attitude = attitude;
        }
    }

    /// Holds an attitude of the peer with index `other` in the order of peers without this peer.
    pub fn hold(&mut self, other: usize, attitude: &Attitude) {
        self.held.hold(other, attitude);
        self.stale = true;
    }

    /// Returns the own attitude in the form of a held attitude.
    pub(crate) fn own_held(&self) -> HeldAttitude {
        HeldAttitude::of(&self.copy.attitude)
    }

    pub(crate) fn held(&self, other: usize) -> HeldAttitude {
        self.held.at(other)
    }

    pub(crate) fn replace_held(&mut self, other: usize, held: HeldAttitude) {
        self.held.replace(other, held);
    }

    /// Computes the means of the held attitudes, around the own attitude if `around` is given.
    pub(crate) fn refresh_held(&mut self, around: Option<&HeldAttitude>) {
        match around {
            Some(own) => self.held.refresh_around(own),
            None => self.held.refresh(),
        }
        self.stale = false;
    }

    /// Computes the torques of this tick, and returns the coupling force FC \[N\]. `late`: whether torques act one tick after their computation.
    ///
    /// τC is zero unless the contact is a grasp: a frictionless finger exerts no torque of its own.
    pub(crate) fn compute<const A: usize>(
        &mut self,
        centre: &State<A>,
        device: &State<A>,
        contact: Contact,
        coupling: &Gains,
        late: bool,
    ) -> [f64; A] {
        if core::mem::take(&mut self.stale) {
            self.held.refresh();
        }
        let RotationConfig { grasp, gains, .. } = &self.config;
        let (matrix, rate) = (self.copy.attitude.matrix(), self.copy.attitude.rate);
        // The coupling acts at the grasped point, not at the centre of mass.
        let at = point_of(&matrix, rate, *grasp, centre);
        let force: [f64; A] = from_fn(|axis| contact.force_along(axis, coupling, device.along(axis).relative_to(at.along(axis))));
        let lever = lever(&matrix, *grasp, triple(&force));
        let (own, mean) = ((&matrix, rate), self.held.mean());
        // A law with a memory or a lag must be called exactly once per tick.
        let coordination = match &mut self.law {
            Some(law) => law.torque(own, mean, gains),
            None => aligning_torque(own, mean, gains),
        };
        let mut torques = Torques { coupling: lever, coordination, device: [0.0; 3] };
        if let (Some(handle), Some(DeviceRotation { coupling, .. }), Contact::Grasp) = (&self.device, &self.config.device, contact) {
            let turned = handle.attitude.matrix();
            let torque = turning_torque((&matrix, rate), (&turned, handle.attitude.rate), coupling);
            torques.coupling = add(lever, torque);
            // The device feels the opposite torque, in its own axes.
            torques.device = reaction(&matrix, &turned, torque);
        }
        // As for forces: with a compute delay the torques of the tick before act now.
        self.applied = if late { core::mem::replace(&mut self.computed, torques) } else { torques };
        self.computed = torques;
        force
    }

    /// Moves to the next tick under the applied torques, which are held in body axes.
    pub(crate) fn advance(&mut self, now: Instant, span: Duration) {
        self.copy.advance(span, self.on_copy(), &self.config);
        if let Some(device) = &mut self.device {
            // The hand's torque is given in world axes and held in handle axes over the tick.
            let hand = self.config.device.as_ref().and_then(|device| device.hand.as_ref());
            let hand = hand.map_or([0.0; 3], |hand| in_body_axes(&device.attitude.matrix(), hand.value::<3>(now)));
            device.advance(span, add(hand, self.applied.device), &self.config);
        }
    }
}
