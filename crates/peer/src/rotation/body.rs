//! The part of a peer that turns: its copy, and its device if that turns too.

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

/// What the turning part of a peer is.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationConfig {
    /// This copy: its share of the object's inertia, and its damping.
    pub copy: Spin,
    /// Where the device grasps it, from the centre of mass in body axes \[m\].
    pub grasp: Triple,
    /// KR [N·m/rad] and BR [N·m·s/rad] on the mean of the others, about the body's axes.
    pub gains: Gains<Triple>,
    /// The device, if it turns.
    pub device: Option<DeviceRotation>,
    /// How motion between ticks is computed, and by how many steps a tick.
    pub integrator: Integrator,
    /// Steps a tick, at least 1.
    pub steps: u32,
}

/// A device with six degrees of freedom.
#[derive(Clone, PartialEq, Debug)]
pub struct DeviceRotation {
    /// Its inertia and damping, in handle axes.
    pub handle: Spin,
    /// KCR [N·m/rad] and BCR [N·m·s/rad].
    pub coupling: Gains,
    /// The torque of the hand in world axes \[N·m\].
    pub hand: Option<Signal>,
}

/// The torques of a tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Torques {
    /// r×RᵀFC + τC, which device and coupling exert on the copy, in body axes \[N·m\].
    pub coupling: Triple,
    /// The held part of τT, which acts on the copy with the opposite sign, in body axes \[N·m\]: all but what the law's damping of the copy adds.
    pub coordination: Triple,
    /// The torque on the device but that of the hand, in handle axes \[N·m\].
    device: Triple,
}

impl Torques {
    const NONE: Self = Self { coupling: [0.0; 3], coordination: [0.0; 3], device: [0.0; 3] };
}

/// The turning part of a peer.
#[derive(Clone, Debug)]
pub struct Rotation {
    config: RotationConfig,
    /// The law, if it is more than the sum of spring and damper.
    law: Option<Box<TurnLaw>>,
    /// β about each axis [N·m·s/rad], part of the damping of the copy.
    own_damping: Triple,
    copy: Turning,
    device: Option<Turning>,
    held: HeldAttitudes,
    stale: bool,
    computed: Torques,
    applied: Torques,
}

/// A body and its steps for the spans between ticks.
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
            other = self.spin.step(span, config.integrator, config.steps);
            &other
        };
        step.advance(&mut self.attitude, torque);
    }

    /// Another damping [N·m·s/rad], from the next step on.
    fn set_damping(&mut self, damping: Triple, config: &RotationConfig) {
        self.spin.damping = damping;
        for (span, step) in [&mut self.short, &mut self.long] {
            *step = self.spin.step(*span, config.integrator, config.steps);
        }
    }
}

/// Three components of A of them; the others are zero.
fn triple<const A: usize>(components: &[f64; A]) -> Triple {
    from_fn(|axis| components.get(axis).copied().unwrap_or(0.0))
}

impl Rotation {
    /// The turning part of a peer that holds the initial attitudes of the others. Copy and device begin with `attitude`.
    #[must_use]
    pub fn new(config: RotationConfig, attitude: Attitude, held: HeldAttitudes, clock: &Clock) -> Self {
        let copy = Turning::new(attitude, config.copy, &config, clock);
        let device = config.device.as_ref().map(|device| Turning::new(attitude, device.handle, &config, clock));
        let (law, own_damping) = (None, [0.0; 3]);
        Self { law, own_damping, copy, device, held, stale: false, computed: Torques::NONE, applied: Torques::NONE, config }
    }

    /// With the law that makes τT from the torques of spring and damper; without one it is their sum. `law`: with gains of one, as [`RotationConfig::gains`] are in
    /// these torques. `own_damping`: β about each axis [N·m·s/rad], by how much the law damps the copy; part of the damping in [`RotationConfig::copy`], and of τT on
    /// the record.
    #[must_use]
    pub fn with_law(mut self, law: &BuiltIn, own_damping: Triple) -> Self {
        self.law = TurnLaw::is_needed(law).then(|| Box::new(TurnLaw::new(*law)));
        self.own_damping = own_damping;
        self
    }

    /// Other parameters of the law of [`Rotation::with_law`], from the next tick on. `damping`: of the copy, with β in it [N·m·s/rad].
    pub fn set_law(&mut self, law: &BuiltIn, own_damping: Triple, damping: Triple) {
        match &mut self.law {
            Some(known) => known.set(*law),
            None => self.law = TurnLaw::is_needed(law).then(|| Box::new(TurnLaw::new(*law))),
        }
        self.own_damping = own_damping;
        self.config.copy.damping = damping;
        self.copy.set_damping(damping, &self.config);
    }

    /// Whether all that turns is a finite number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.copy.attitude.is_finite() && self.device.as_ref().is_none_or(|device| device.attitude.is_finite())
    }

    /// The attitude of the copy.
    #[must_use]
    pub const fn copy(&self) -> &Attitude {
        &self.copy.attitude
    }

    /// The attitude of the device, if it turns.
    #[must_use]
    pub fn device(&self) -> Option<&Attitude> {
        self.device.as_ref().map(|device| &device.attitude)
    }

    /// The torques computed at the latest tick, for the record.
    #[must_use]
    pub const fn computed(&self) -> &Torques {
        &self.computed
    }

    /// The torques that act over the tick that begins now.
    #[must_use]
    pub const fn applied(&self) -> &Torques {
        &self.applied
    }

    /// τT of the latest tick, with what β adds, in body axes \[N·m\].
    #[must_use]
    pub fn coordination_torque(&self) -> Triple {
        add(self.computed.coordination, by_component(self.own_damping, self.copy.attitude.rate))
    }

    /// β about each axis [N·m·s/rad].
    #[must_use]
    pub const fn own_damping(&self) -> Triple {
        self.own_damping
    }

    /// The integral of the angular velocity of the copy in its axes over the step to the next tick \[rad\], between [`crate::Peer::compute`] and [`crate::Peer::advance`].
    #[must_use]
    pub fn travel(&self, span: Duration) -> Triple {
        let step = self.copy.spin.step(span, self.config.integrator, self.config.steps);
        let mut body = self.copy.attitude;
        step.travel(&mut body, self.on_copy())
    }

    /// The torque that is held on the copy over the tick that begins now, without its damping, in body axes \[N·m\].
    #[must_use]
    pub fn on_copy(&self) -> Triple {
        subtract(self.applied.coupling, self.applied.coordination)
    }

    /// What the peer is.
    #[must_use]
    pub const fn config(&self) -> &RotationConfig {
        &self.config
    }

    /// Changes KR and BR, from the next tick on.
    pub const fn set_gains(&mut self, gains: Gains<Triple>) {
        self.config.gains = gains;
    }

    /// Changes the torque of the hand \[N·m\], if the device turns.
    pub fn set_hand(&mut self, hand: Option<Signal>) {
        if let Some(device) = &mut self.config.device {
            device.hand = hand;
        }
    }

    /// Puts the copy into that attitude.
    pub const fn set_copy(&mut self, attitude: Attitude) {
        self.copy.attitude = attitude;
    }

    /// Puts the device into that attitude, if it turns.
    pub const fn set_device(&mut self, attitude: Attitude) {
        if let Some(device) = &mut self.device {
            device.attitude = attitude;
        }
    }

    /// Holds an attitude of another peer.
    pub fn hold(&mut self, other: usize, attitude: &Attitude) {
        self.held.hold(other, attitude);
        self.stale = true;
    }

    /// The own attitude as another peer would hold it.
    pub(crate) fn own_held(&self) -> HeldAttitude {
        HeldAttitude::of(&self.copy.attitude)
    }

    pub(crate) fn held(&self, other: usize) -> HeldAttitude {
        self.held.at(other)
    }

    pub(crate) fn replace_held(&mut self, other: usize, held: HeldAttitude) {
        self.held.replace(other, held);
    }

    /// Computes the means of the held attitudes anew, around the own one if it is given.
    pub(crate) fn refresh_held(&mut self, around: Option<&HeldAttitude>) {
        match around {
            Some(own) => self.held.refresh_around(own),
            None => self.held.refresh(),
        }
        self.stale = false;
    }

    /// Computes the torques of this tick, and gives the coupling force.
    ///
    /// A frictionless finger turns nothing by itself, and a device that does not grasp the copy does not either: then τC is zero.
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
        let at = point_of(&matrix, rate, *grasp, centre);
        let force: [f64; A] = from_fn(|axis| contact.force_along(axis, coupling, device.along(axis).relative_to(at.along(axis))));
        let lever = lever(&matrix, *grasp, triple(&force));
        let (own, mean) = ((&matrix, rate), self.held.mean());
        let coordination = match &mut self.law {
            Some(law) => law.torque(own, mean, gains),
            None => aligning_torque(own, mean, gains),
        };
        let mut torques = Torques { coupling: lever, coordination, device: [0.0; 3] };
        if let (Some(handle), Some(DeviceRotation { coupling, .. }), Contact::Grasp) = (&self.device, &self.config.device, contact) {
            let turned = handle.attitude.matrix();
            let torque = turning_torque((&matrix, rate), (&turned, handle.attitude.rate), coupling);
            torques.coupling = add(lever, torque);
            torques.device = reaction(&matrix, &turned, torque);
        }
        self.applied = if late { core::mem::replace(&mut self.computed, torques) } else { torques };
        self.computed = torques;
        force
    }

    /// Moves to the next tick under the torques that act over it, which are held in body axes.
    pub(crate) fn advance(&mut self, now: Instant, span: Duration) {
        self.copy.advance(span, self.on_copy(), &self.config);
        if let Some(device) = &mut self.device {
            let hand = self.config.device.as_ref().and_then(|device| device.hand.as_ref());
            let hand = hand.map_or([0.0; 3], |hand| in_body_axes(&device.attitude.matrix(), hand.value::<3>(now)));
            device.advance(span, add(hand, self.applied.device), &self.config);
        }
    }
}
