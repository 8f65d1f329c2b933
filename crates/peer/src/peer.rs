//! One participant, tick by tick.
//!
//! In: datagrams of other peers, instants, and the state of the device. Out: datagrams of this peer, and the forces of each tick. This module knows neither
//! how datagrams travel nor how late the packets are.

mod receiving;

use alloc::boxed::Box;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::coordination::{LawValues, Prediction, Role};
use crate::increments::Increments;
use crate::operator::Seen;
use crate::rotation::{Attitude, Rotation};
use crate::tick::on_object;
use crate::wire::{Extra, MAX_LEN, Sample, SampleKind};
use crate::{Contact, Context, Device, Enclosure, Exchange, Exchanged, Gains, Held, ObjectCopy, State, Strategy};

pub use receiving::{ReceiveError, Reception};

/// Parameters of a peer, apart from device, copy of the object and strategy.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PeerConfig {
    /// Number of the session. Samples of other sessions are refused.
    pub session: u64,
    /// Place of this peer in the session, counted from 0.
    pub place: u32,
    /// Number of axes in a sample, 1 to 3 and at most the A of the peer.
    pub axes: usize,
    /// Contact between device and copy.
    pub contact: Contact,
    /// Gains KC [N/m] and BC [N·s/m] of the virtual coupling.
    pub coupling: Gains,
    /// Period of the tick on the peer's own clock, which shows 0 at the first tick.
    pub tick: Duration,
    /// `true` if forces have a compute delay: each force acts a tick after its computation.
    pub compute_delay: bool,
    /// Ticks at which the peer reads the device and gives the device a new force.
    pub exchange: Exchange,
    /// β [N·s/m], the damping of the copy by the strategy. Part of the copy's plant, and added to FT in the record.
    pub own_damping: f64,
    /// Walls around the object; `None` without walls.
    pub enclosure: Option<Enclosure>,
}

/// A participant: a device, a coupling, a copy of the object, and a strategy between this copy and the copies of other peers.
///
/// At each of its ticks the driver calls, in this order,
///
/// 1. [`Peer::sample`], if it is time to send,
/// 2. [`Peer::handle_datagram`] for every packet that has arrived, in the order of arrival,
/// 3. [`Peer::compute`], once,
/// 4. [`Peer::advance`], once, which moves the peer to its next tick under the forces just computed.
///
/// A peer has no clock: each step takes the instant from the driver.
#[derive(Clone, Debug)]
pub struct Peer<const A: usize, D, S> {
    config: PeerConfig,
    device: D,
    object: ObjectCopy<A>,
    strategy: S,
    /// Answers of the strategy that were asked once, in [`Peer::new`].
    asked: Asked,
    /// `true` if a tick has none of its optional parts: see [`Peer::is_without_parts`].
    is_plain: bool,
    /// `true` if the contact is a grasp, the most frequent contact.
    is_grasping: bool,
    held: Held<A>,
    /// Sum of the displacements of each sender. The positions in `held` are these sums. `None` for a peer without sums. Boxed, because only a server of clients
    /// that send displacements has sums.
    increments: Option<Box<Increments<A>>>,
    /// Rotation of copy and device, for an object with an inertia. Boxed, because most scenes do not rotate.
    rotation: Option<Box<Rotation>>,
    /// State between two exchanges with the device; `None` with [`Exchange::EACH_TICK`]. Boxed, because most devices exchange at each tick.
    exchanged: Option<Box<Exchanged<A>>>,
    /// `true` if a sample has changed since the last computation of the mean.
    stale_mean: bool,
    next_sequence: u64,
    /// Time on the peer's own clock: 0 at the first tick.
    local_time: Instant,
    /// Period of the tick \[ns\], added to `local_time` at each tick.
    tick_nanos: u64,
    /// Forces computed at the latest tick.
    computed: Acting<A>,
    /// Forces that act over the present tick: `computed` of this tick, or of the tick before with a compute delay.
    applied: Acting<A>,
}

/// Answers of a strategy about its needs beyond position and velocity.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Asked {
    kind: SampleKind,
    role: Role,
    prediction: bool,
    horizon: bool,
    /// `true` if [`Peer::heard`] has anything to do at a tick.
    any: bool,
}

impl Asked {
    fn by<const A: usize>(strategy: &impl Strategy<A>) -> Self {
        let (kind, role, horizon) = (strategy.kind(), strategy.role(), strategy.horizon().is_some());
        let any = kind != SampleKind::State || role != Role::Copy || horizon;
        Self { kind, role, prediction: strategy.needs_prediction(), horizon, any }
    }
}

/// Forces that act over a tick: the coupling force on the device, and the sum of forces on the copy.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Acting<const A: usize> {
    /// FC \[N\], of the latest exchange if the device keeps a force for several ticks. Acts on the device with the opposite sign.
    pub coupling: [f64; A],
    /// Sum of all forces on the copy except its own damping \[N\]: FC − FT and the walls.
    pub on_object: [f64; A],
}

/// Forces computed at a tick, for the record.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Forces<const A: usize> {
    /// FC, the coupling force on the copy \[N\].
    pub coupling: [f64; A],
    /// FT, the coordination force, which acts on the copy with the opposite sign \[N\].
    pub coordination: [f64; A],
    /// Part of FT that is held over a tick \[N\]: FT without the share of [`PeerConfig::own_damping`].
    pub commanded: [f64; A],
    /// State to which the strategy draws the copy.
    pub target: State<A>,
}

impl<const A: usize, D: Device<A>, S: Strategy<A>> Peer<A, D, S> {
    /// Returns a peer that holds the initial states `held` of the other peers.
    #[must_use]
    pub fn new(config: PeerConfig, device: D, object: ObjectCopy<A>, strategy: S, mut held: Held<A>) -> Self {
        let none = Acting { coupling: [0.0; A], on_object: [0.0; A] };
        // Lead and age of samples cost time at each tick, so only a strategy with a horizon pays for them.
        if let Some(horizon) = strategy.horizon() {
            held.keep_ages(horizon);
        }
        // The answers of the strategy are asked once: calls through a boxed strategy at every tick would repeat them.
        let (asked, local_time) = (Asked::by(&strategy), Instant::ZERO);
        let sums = asked.kind == SampleKind::Increment && asked.role == Role::Copy;
        let states = (0..held.len()).filter_map(|place| held.state(place).copied());
        let increments = sums.then(|| Box::new(Increments::new(states)));
        let (rotation, stale_mean, next_sequence) = (None, false, 0);
        let exchanged = (config.exchange != Exchange::EACH_TICK).then(|| Box::new(Exchanged::new(device.state())));
        let tick_nanos = u64::try_from(config.tick.as_nanos()).unwrap_or(u64::MAX);
        let (computed, applied) = (none, none);
        let is_grasping = matches!(config.contact, Contact::Grasp);
        let mut peer = Self {
            config,
            device,
            object,
            strategy,
            asked,
            is_plain: false,
            is_grasping,
            held,
            increments,
            rotation,
            exchanged,
            stale_mean,
            next_sequence,
            local_time,
            tick_nanos,
            computed,
            applied,
        };
        peer.is_plain = peer.is_without_parts();
        peer
    }

    /// Returns whether a tick of this peer has none of the parts that few peers have: walls, a compute delay, exchanges with a slow device, a rotation, and what
    /// a strategy asks for beyond the mean of the samples.
    fn is_without_parts(&self) -> bool {
        let PeerConfig { enclosure, compute_delay, .. } = &self.config;
        let Asked { prediction, any, .. } = self.asked;
        !(any || prediction || *compute_delay || enclosure.is_some() || self.exchanged.is_some() || self.rotation.is_some())
    }

    /// Adds a rotating copy. The samples of such a peer carry attitudes, so its strategy must be a law without extra numbers. Torques have no exchanges, so the
    /// peer must exchange with its device at each tick.
    #[must_use]
    pub fn with_rotation(mut self, rotation: Rotation) -> Self {
        debug_assert!(self.asked.kind == SampleKind::State, "samples with attitudes have no extra numbers");
        debug_assert!(self.exchanged.is_none(), "torques act at each tick");
        self.rotation = Some(Box::new(rotation));
        (self.asked.kind, self.asked.any) = (SampleKind::Attitude, true);
        self.is_plain = self.is_without_parts();
        self
    }

    /// Step 1: writes the present sample of this peer into `datagram` and returns its length \[byte\]. `local_time` is the time on the peer's own clock.
    ///
    /// A strategy with personal samples needs [`Peer::next_sample`] for each receiver instead, [`Peer::extra`], and [`Peer::all_sent`] after the last receiver.
    #[inline(always)]
    pub fn sample(&mut self, local_time: Instant, datagram: &mut [u8; MAX_LEN]) -> usize {
        let sample = self.next_sample(local_time);
        let (kind, axes) = (self.asked.kind, self.config.axes);
        // Laws have no extra numbers, and `Strategy::sent` is not called for them.
        if kind == SampleKind::State {
            return sample.encode(axes, datagram);
        }
        let extra = Extra { receiver: 0, numbers: self.extra(0), attitude: self.attitude() };
        self.all_sent();
        sample.encode_as(kind, &extra, axes, datagram)
    }

    /// Returns the present sample of this peer, without the extra numbers of its strategy, and counts its sequence number.
    ///
    /// A driver without datagrams calls this method, [`Peer::extra`] for each receiver if the strategy has a [kind](Peer::kind), and then [`Peer::all_sent`].
    #[inline]
    pub fn next_sample(&mut self, local_time: Instant) -> Sample<A> {
        let sequence = self.next_sequence;
        self.next_sequence = sequence.wrapping_add(1);
        Sample { session: self.config.session, sender: self.config.place, sequence, sent: local_time, state: self.sampled() }
    }

    /// Returns the state in the present sample: the state of the copy or, for a client, the state of the device.
    #[inline]
    fn sampled(&self) -> State<A> {
        match self.asked.role {
            Role::Copy => *self.object.state(),
            Role::Client { .. } => self.device.state(),
        }
    }

    /// Returns the extra numbers of the present sample for `receiver`, an index into the other peers in their order without this peer; 0 for kinds that are
    /// equal for all receivers.
    #[inline]
    pub fn extra(&mut self, receiver: usize) -> [f64; A] {
        self.strategy.extra(receiver, &self.sampled(), &self.held)
    }

    /// Returns the attitude of the copy, or [`Attitude::REST`] without rotation.
    #[must_use]
    pub fn attitude(&self) -> Attitude {
        self.rotation.as_ref().map_or(Attitude::REST, |rotation| *rotation.copy())
    }

    /// Tells the strategy that the samples of this tick are complete for all receivers.
    pub fn all_sent(&mut self) {
        self.strategy.sent(&self.sampled());
    }

    /// Returns the kind of data in samples beyond position and velocity.
    #[must_use]
    pub const fn kind(&self) -> SampleKind {
        self.asked.kind
    }

    /// Returns the role of the peer: owner of a copy, or client of a server.
    #[must_use]
    pub const fn role(&self) -> Role {
        self.asked.role
    }

    /// Step 3: computes the forces of this tick. The next tick follows after [`PeerConfig::tick`].
    #[inline(always)]
    pub fn compute(&mut self, now: Instant) -> Forces<A> {
        self.compute_over(now, self.config.tick)
    }

    /// Step 3: computes the forces of this tick. The next tick follows after `span`.
    #[inline(always)]
    pub fn compute_over(&mut self, now: Instant, span: Duration) -> Forces<A> {
        // One test takes the place of a test for each optional part, which most peers do not have (`benches/peers`, rows of watched packets).
        if self.is_plain { self.compute_as::<true>(now, span) } else { self.compute_with_parts(now, span) }
    }

    /// Computes the forces of a tick with optional parts. Not inlined, so that the frequent case stays small, and cold, so that its code lies in one piece.
    #[cold]
    #[inline(never)]
    fn compute_with_parts(&mut self, now: Instant, span: Duration) -> Forces<A> {
        self.compute_as::<false>(now, span)
    }

    /// Computes the forces of a tick. With `PLAIN` the peer has no optional part, so that the compiler leaves out the tests of the parts.
    #[inline(always)]
    fn compute_as<const PLAIN: bool>(&mut self, now: Instant, span: Duration) -> Forces<A> {
        // One mean for all samples of a tick: several samples may arrive between two ticks.
        if self.stale_mean {
            self.held.refresh();
            self.stale_mean = false;
        }
        let mut exchanged = self.exchanged.as_mut().filter(|_| !PLAIN);
        if let Some(exchanged) = &mut exchanged {
            exchanged.read(self.config.exchange, self.device.state());
        }
        let reading = exchanged.as_ref().map_or_else(|| self.device.state(), |exchanged| exchanged.reading);
        // Before the copy is read: a client takes its copy from the newest sample of the server.
        let heard = if !PLAIN && self.asked.any { self.heard() } else { None };
        let own = self.object.state();
        let coupling = heard.unwrap_or_else(|| self.coupling_force(&reading, own));
        let walls = self.config.enclosure.as_ref().filter(|_| !PLAIN).map(|enclosure| enclosure.force(own));
        // The prediction needs the coupling and the walls of this tick, so it follows both.
        let ahead = if !PLAIN && self.asked.prediction {
            let walls = walls.unwrap_or([0.0; A]);
            self.object.ahead(span, core::array::from_fn(|axis| coupling[axis] + walls[axis]))
        } else {
            Prediction::REST
        };
        let command = self.strategy.command(&Context { now, local_time: self.local_time, own, held: &self.held, ahead });
        let mut on_object: [f64; A] = core::array::from_fn(|axis| on_object(coupling[axis], command.force[axis]));
        if let Some(walls) = walls {
            for axis in 0..A {
                on_object[axis] += walls[axis];
            }
        }
        let computed = Acting { coupling, on_object };
        // With a compute delay the forces of the tick before act now, and the new forces wait one tick.
        if !PLAIN && self.config.compute_delay {
            self.applied = core::mem::replace(&mut self.computed, computed);
        } else {
            self.applied = computed;
        }
        // The copy feels FC of each tick, because both are parts of one program; the device keeps FC of its latest exchange.
        if let Some(exchanged) = self.exchanged.as_mut().filter(|_| !PLAIN) {
            self.applied.coupling = exchanged.hold(self.config.exchange, self.applied.coupling);
        }
        // β is part of the copy's plant and acts between ticks too; only the record adds it to FT.
        let damped = self.config.own_damping > 0.0;
        let recorded = |axis: usize| if damped { command.force[axis] + self.config.own_damping * own.velocity[axis] } else { command.force[axis] };
        Forces { coupling, coordination: core::array::from_fn(recorded), commanded: command.force, target: command.target }
    }

    /// Step 4: moves to the next tick, `span` after `now`.
    #[inline(always)]
    pub fn advance(&mut self, now: Instant, span: Duration) {
        self.advance_as::<false>(now, span);
    }

    /// Moves to the next tick. With `PLAIN` the peer has no optional part.
    #[inline(always)]
    fn advance_as<const PLAIN: bool>(&mut self, now: Instant, span: Duration) {
        self.device.advance(now, span, self.applied.coupling);
        // The copy of a client is the state of the server, without dynamics.
        if PLAIN || self.asked.role == Role::Copy {
            self.object.advance(span, self.applied.on_object);
        }
        if let Some(rotation) = self.rotation.as_mut().filter(|_| !PLAIN) {
            rotation.advance(now, span);
        }
        self.local_time = self.local_time.saturating_add_nanos(self.tick_nanos);
    }

    /// Steps 3 and 4: [`Peer::compute_over`] and [`Peer::advance`], with one test for optional parts. Returns the position of the copy at the tick, before the
    /// motion \[m\].
    #[inline(always)]
    pub fn tick(&mut self, now: Instant, span: Duration) -> [f64; A] {
        if self.is_plain { self.tick_as::<true>(now, span) } else { self.tick_with_parts(now, span) }
    }

    /// Computes and moves with optional parts. Not inlined and cold, like [`Peer::compute_with_parts`].
    #[cold]
    #[inline(never)]
    fn tick_with_parts(&mut self, now: Instant, span: Duration) -> [f64; A] {
        self.tick_as::<false>(now, span)
    }

    #[inline(always)]
    fn tick_as<const PLAIN: bool>(&mut self, now: Instant, span: Duration) -> [f64; A] {
        self.compute_as::<PLAIN>(now, span);
        // Read after the forces: a client has taken its copy from the server by then.
        let position = self.object.state().position;
        self.advance_as::<PLAIN>(now, span);
        position
    }

    /// Returns the time on the peer's own clock: 0 at the first tick, and one period more at each following tick.
    #[must_use]
    pub const fn local_time(&self) -> Instant {
        self.local_time
    }

    /// Sets the peer's own clock.
    pub const fn set_local_time(&mut self, local_time: Instant) {
        self.local_time = local_time;
    }

    /// Returns the device.
    #[must_use]
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// Returns the device, for a change of its hand.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// Returns the copy of the object.
    #[must_use]
    pub const fn object(&self) -> &ObjectCopy<A> {
        &self.object
    }

    /// Returns the copy of the object, for a change of its state.
    pub const fn object_mut(&mut self) -> &mut ObjectCopy<A> {
        &mut self.object
    }

    /// Returns the position at which the user of this peer sees the object at a tick, after the packets of the tick were taken in \[m\]. `None` if the user
    /// sees a peer that this peer does not hear.
    #[must_use]
    pub fn seen(&self, of: Seen) -> Option<[f64; A]> {
        match (of, self.asked.role) {
            (Seen::Own, Role::Copy) => Some(self.object.state().position),
            // The copy of a client takes this state when the forces of the tick are computed.
            (Seen::Own, Role::Client { server }) => self.held.state(server).map(|state| state.position),
            (Seen::Peer(sender), _) => {
                let place = self.place_of(u32::try_from(sender).ok()?)?;
                self.held.sent_state(place).map(|state| state.position)
            }
        }
    }

    /// Returns the rotation of copy and device; `None` for an object without inertia.
    #[must_use]
    pub fn rotation(&self) -> Option<&Rotation> {
        self.rotation.as_deref()
    }

    /// Returns the rotation of copy and device, for a change of its state or gains.
    pub fn rotation_mut(&mut self) -> Option<&mut Rotation> {
        self.rotation.as_deref_mut()
    }

    /// Holds `state` for the other peer with index `other`, sampled at `sent` on the clock of that peer, as if nothing had ever arrived from it: any
    /// sample is newer. The index counts the other peers in their order, without this peer.
    ///
    /// # Panics
    ///
    /// If the index `other` is out of range.
    pub fn hold(&mut self, other: usize, sent: Instant, state: State<A>) {
        self.held.hold(other, sent, state);
        if let Some(increments) = &mut self.increments {
            increments.restart(other, state);
        }
        self.stale_mean = true;
    }

    /// Sets KC and BC, from the next tick on.
    pub const fn set_coupling(&mut self, coupling: Gains) {
        self.config.coupling = coupling;
    }

    /// Returns the forces computed at the latest tick. With a compute delay they act over the next tick.
    #[must_use]
    pub const fn computed(&self) -> &Acting<A> {
        &self.computed
    }

    /// Returns the forces that act over the tick that begins now, as of the latest [`Peer::compute`].
    #[must_use]
    pub const fn applied(&self) -> &Acting<A> {
        &self.applied
    }

    /// Returns whether forces have a compute delay of a tick.
    #[must_use]
    pub const fn compute_delay(&self) -> bool {
        self.config.compute_delay
    }

    /// Returns readings and force between two exchanges with the device; `None` with [`Exchange::EACH_TICK`].
    #[must_use]
    pub fn exchanged(&self) -> Option<&Exchanged<A>> {
        self.exchanged.as_deref()
    }

    /// Replaces the exchanges with the device, for a device whose readings are late by themselves. The next tick has an exchange.
    pub fn set_exchange(&mut self, exchange: Exchange) {
        self.config.exchange = exchange;
        self.exchanged = (exchange != Exchange::EACH_TICK).then(|| Box::new(Exchanged::new(self.device.state())));
        self.is_plain = self.is_without_parts();
    }

    /// Replaces readings and force between two exchanges. Without effect with [`Exchange::EACH_TICK`].
    pub fn set_exchanged(&mut self, exchanged: Exchanged<A>) {
        if let Some(present) = &mut self.exchanged {
            **present = exchanged;
        }
    }

    /// Replaces the forces computed at the latest tick.
    pub const fn set_computed(&mut self, computed: Acting<A>) {
        self.computed = computed;
    }

    /// Returns the strategy.
    #[must_use]
    pub const fn strategy(&self) -> &S {
        &self.strategy
    }

    /// Returns the strategy, for a change of its gains.
    pub const fn strategy_mut(&mut self) -> &mut S {
        &mut self.strategy
    }

    /// Sets the parameters `own` of the strategy from the next tick on, with the new β `own_damping` [N·s/m] and the new `damping` of the copy, which
    /// contains β [N·s/m]. A new horizon takes effect only for a strategy that had a horizon in [`Peer::new`], because send times are not kept otherwise.
    pub fn set_parameters(&mut self, own: &LawValues, own_damping: f64, damping: f64) {
        self.strategy.set_parameters(own);
        if let Some(horizon) = self.strategy.horizon() {
            self.held.set_horizon(horizon);
        }
        // New step maps cost matrix exponentials: only a changed β needs them.
        if own_damping.to_bits() != self.config.own_damping.to_bits() {
            self.config.own_damping = own_damping;
            self.object.set_damping(damping);
        }
    }

    /// Returns β [N·s/m], the damping of the copy by the strategy.
    #[must_use]
    pub const fn own_damping(&self) -> f64 {
        self.config.own_damping
    }

    /// Returns the contact between device and copy.
    #[must_use]
    pub const fn contact(&self) -> Contact {
        self.config.contact
    }

    /// Sets the contact between device and copy, from the next tick on.
    pub const fn set_contact(&mut self, contact: Contact) {
        self.config.contact = contact;
        self.is_grasping = matches!(contact, Contact::Grasp);
    }

    /// Returns the parts that [`crate::Ages`] change: own state, held samples, the flag of a stale mean, and the rotation.
    pub(crate) fn aged_parts(&mut self) -> (&State<A>, &mut Held<A>, &mut bool, Option<&mut Rotation>) {
        (self.object.state(), &mut self.held, &mut self.stale_mean, self.rotation.as_deref_mut())
    }

    /// Updates the lead, the state of a client and the torques for the strategies that need them. Returns FC \[N\] if this peer does not compute FC from
    /// device and copy.
    fn heard(&mut self) -> Option<[f64; A]> {
        // Moves the held samples to now, for a strategy that extrapolates.
        if self.asked.horizon {
            self.held.move_on(self.local_time);
        }
        // A client has no copy of its own: the newest state of the server is its copy.
        if let Role::Client { server } = self.asked.role {
            self.object.set_state(*self.held.state(server).expect("the server is another peer"));
        }
        // A grasp away from the centre of mass needs the attitude, so the rotation computes FC together with the torques.
        if let Some(rotation) = &mut self.rotation {
            let PeerConfig { contact, coupling, compute_delay, .. } = &self.config;
            return Some(rotation.compute(self.object.state(), &self.device.state(), *contact, coupling, *compute_delay));
        }
        self.strategy.heard_coupling()
    }

    /// Returns FC \[N\] for a reading of the device and the state of the copy.
    #[inline(always)]
    fn coupling_force(&self, device: &State<A>, object: &State<A>) -> [f64; A] {
        let PeerConfig { contact, coupling, .. } = &self.config;
        let force = |contact: Contact, axis| contact.force_along(axis, coupling, device.along(axis).relative_to(object.along(axis)));
        // The most frequent contact is tested first, by a flag of its own: a comparison of the contact would become a part of the choice below, and the
        // discriminant of all contacts is computed from two bytes. With a constant contact, the compiler leaves out the other contacts.
        if self.is_grasping {
            return core::array::from_fn(|axis| force(Contact::Grasp, axis));
        }
        match contact {
            // The force is zero on every axis, whatever the state of the device is.
            Contact::None => [0.0; A],
            Contact::Grasp | Contact::Push(_) => core::array::from_fn(|axis| force(*contact, axis)),
        }
    }
}
