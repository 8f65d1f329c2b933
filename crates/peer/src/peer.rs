//! One participant, tick by tick.

use alloc::boxed::Box;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::coordination::{LawValues, Prediction, Role};
use crate::rotation::{Attitude, Rotation};
use crate::tick::on_object;
use crate::wire::{DecodeError, Extra, MAX_LEN, Sample, SampleKind};
use crate::{Contact, Context, Device, Enclosure, Gains, Held, ObjectCopy, State, Strategy};

/// What a peer is, apart from its device, its copy of the object and its strategy.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PeerConfig {
    /// The session: samples of another one are refused.
    pub session: u64,
    /// The place of this peer in the session, from 0.
    pub place: u32,
    /// How many axes a sample has, at most the A of the peer.
    pub axes: usize,
    /// How the device touches the copy.
    pub contact: Contact,
    /// KC and BC.
    pub coupling: Gains,
    /// The period of the tick on the peer's own clock, which shows 0 at the first one.
    pub tick: Duration,
    /// Whether forces are applied one tick after they were computed.
    pub compute_delay: bool,
    /// β, by how much the strategy damps the copy [N·s/m]; part of the copy's plant, and of FT on the record.
    pub own_damping: f64,
    /// The walls around the object, if there are any.
    pub enclosure: Option<Enclosure>,
}

/// One participant: a device, a coupling, a copy of the object, and a strategy that ties it to the others.
///
/// At each of its ticks the driver calls, in this order,
///
/// 1. [`Peer::sample`], if it is time to send,
/// 2. [`Peer::handle_datagram`] for every packet that has arrived, in the order of arrival,
/// 3. [`Peer::compute`], once,
/// 4. [`Peer::advance`], once, which moves the peer to its next tick under the forces just computed.
///
/// A peer does not know the time but by the instants it is given, and nothing of how datagrams travel.
#[derive(Clone, Debug)]
pub struct Peer<const A: usize, D, S> {
    config: PeerConfig,
    device: D,
    object: ObjectCopy<A>,
    strategy: S,
    /// What the strategy asks for beyond what every strategy has.
    asked: Asked,
    held: Held<A>,
    /// The part that turns, if the object has an inertia.
    rotation: Option<Box<Rotation>>,
    /// Whether a sample has changed since the mean was computed.
    stale_mean: bool,
    next_sequence: u64,
    /// What the peer's own clock shows.
    local_time: Instant,
    /// The period of the tick in nanoseconds, which are counted on at each tick.
    tick_nanos: u64,
    computed: Acting<A>,
    applied: Acting<A>,
}

/// What a strategy asks for beyond what every strategy has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Asked {
    kind: SampleKind,
    role: Role,
    prediction: bool,
    horizon: bool,
    /// Whether it asks for [`Peer::heard`].
    any: bool,
}

impl Asked {
    fn by<const A: usize>(strategy: &impl Strategy<A>) -> Self {
        let (kind, role, horizon) = (strategy.kind(), strategy.role(), strategy.horizon().is_some());
        let any = kind != SampleKind::State || role != Role::Copy || horizon;
        Self { kind, role, prediction: strategy.needs_prediction(), horizon, any }
    }
}

/// The forces that act over a tick: on the device, and in all on the copy.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Acting<const A: usize> {
    /// FC, which the device feels with the opposite sign \[N\].
    pub coupling: [f64; A],
    /// The sum of all forces on the copy but its own damping: FC − FT and the walls \[N\].
    pub on_object: [f64; A],
}

/// The forces computed at a tick, for the record.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Forces<const A: usize> {
    /// FC, the coupling force on the copy \[N\].
    pub coupling: [f64; A],
    /// FT, the coordination force, which acts on the copy with the opposite sign \[N\].
    pub coordination: [f64; A],
    /// The part of FT that is held over a tick \[N\]: all but what [`PeerConfig::own_damping`] adds.
    pub commanded: [f64; A],
    /// Where the strategy wants the copy to be.
    pub target: State<A>,
}

/// What became of a sample that was understood.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reception {
    /// It is the newest from its sender and is held from now on.
    Newest,
    /// It is late or repeated: nothing changed.
    Stale,
}

/// Why a datagram was refused. Nothing changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum ReceiveError {
    /// It is no sample.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// It belongs to another session.
    #[error("a sample of session {found:#x}")]
    Session {
        /// The session it belongs to.
        found: u64,
    },
    /// It is for another peer.
    #[error("a sample for peer {receiver}")]
    Receiver {
        /// The receiver that it names.
        receiver: u32,
    },
    /// It is from nobody else in this session.
    #[error("a sample from peer {sender}, which is not another peer of this session")]
    Sender {
        /// The sender that it names.
        sender: u32,
    },
}

impl<const A: usize, D: Device<A>, S: Strategy<A>> Peer<A, D, S> {
    /// A peer that holds the initial states of the others.
    #[must_use]
    pub fn new(config: PeerConfig, device: D, object: ObjectCopy<A>, strategy: S, mut held: Held<A>) -> Self {
        let none = Acting { coupling: [0.0; A], on_object: [0.0; A] };
        if let Some(horizon) = strategy.horizon() {
            held.keep_ages(horizon);
        }
        let (asked, local_time) = (Asked::by(&strategy), Instant::ZERO);
        let (rotation, stale_mean, next_sequence) = (None, false, 0);
        let tick_nanos = u64::try_from(config.tick.as_nanos()).unwrap_or(u64::MAX);
        let (computed, applied) = (none, none);
        Self { config, device, object, strategy, asked, held, rotation, stale_mean, next_sequence, local_time, tick_nanos, computed, applied }
    }

    /// The peer with a copy that turns, for a strategy that is a law: its samples carry attitudes.
    #[must_use]
    pub fn with_rotation(mut self, rotation: Rotation) -> Self {
        debug_assert!(self.asked.kind == SampleKind::State, "samples with attitudes have no extra numbers");
        self.rotation = Some(Box::new(rotation));
        (self.asked.kind, self.asked.any) = (SampleKind::Attitude, true);
        self
    }

    /// Step 1: writes the sample that this peer sends now into `datagram` and gives its length. `local_time` is what the peer's own clock shows.
    ///
    /// For a strategy whose samples are personal, see [`Peer::personal_samples`].
    #[inline(always)]
    pub fn sample(&mut self, local_time: Instant, datagram: &mut [u8; MAX_LEN]) -> usize {
        let sample = self.next_sample(local_time);
        let (kind, axes) = (self.asked.kind, self.config.axes);
        if kind == SampleKind::State {
            return sample.encode(axes, datagram);
        }
        let extra = Extra { receiver: 0, numbers: self.extra(0), attitude: self.attitude() };
        self.all_sent();
        sample.encode_as(kind, &extra, axes, datagram)
    }

    /// Step 1 for a strategy whose samples are personal: hands `send` the place of each receiver in the session and the datagram for it, each with a sequence
    /// number of its own.
    pub fn personal_samples(&mut self, local_time: Instant, mut send: impl FnMut(u32, &[u8])) {
        let Self { config: PeerConfig { place, axes, .. }, asked: Asked { kind, role, .. }, .. } = *self;
        let mut datagram = [0; MAX_LEN];
        for (other, receiver) in (0..).filter(|receiver| *receiver != place).take(self.held.len()).enumerate() {
            if matches!(role, Role::Client { server } if server != other) {
                continue;
            }
            let numbers = self.extra(other);
            let sample = self.next_sample(local_time);
            let len = sample.encode_as(kind, &Extra { receiver, numbers, ..Extra::NONE }, axes, &mut datagram);
            send(receiver, &datagram[..len]);
        }
        self.all_sent();
    }

    /// The sample that this peer sends now, without the extra numbers of its strategy.
    ///
    /// A driver that has no use for datagrams calls this, [`Peer::extra`] for each receiver if the strategy has a [kind](Peer::kind), and then
    /// [`Peer::all_sent`].
    #[inline]
    pub fn next_sample(&mut self, local_time: Instant) -> Sample<A> {
        let sequence = self.next_sequence;
        self.next_sequence = sequence.wrapping_add(1);
        let state = match self.asked.role {
            Role::Copy => *self.object.state(),
            Role::Client { .. } => self.device.state(),
        };
        Sample { session: self.config.session, sender: self.config.place, sequence, sent: local_time, state }
    }

    /// The extra numbers of the sample that is sent now to another peer, which counts in order with this peer left out; `receiver` is 0 where they are the
    /// same for all.
    #[inline]
    pub fn extra(&mut self, receiver: usize) -> [f64; A] {
        self.strategy.extra(receiver, self.object.state(), &self.held)
    }

    /// The attitude of the copy, for samples that carry one.
    #[must_use]
    pub fn attitude(&self) -> Attitude {
        self.rotation.as_ref().map_or(Attitude::REST, |rotation| *rotation.copy())
    }

    /// The samples of this tick have been made for all receivers.
    pub fn all_sent(&mut self) {
        self.strategy.sent(self.object.state());
    }

    /// What samples carry beyond the state.
    #[must_use]
    pub const fn kind(&self) -> SampleKind {
        self.asked.kind
    }

    /// Which part of the object the peer has.
    #[must_use]
    pub const fn role(&self) -> Role {
        self.asked.role
    }

    /// Step 2: takes in a datagram from another peer.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] if it is not a sample for this peer; nothing changed.
    #[inline]
    pub fn handle_datagram(&mut self, datagram: &[u8]) -> Result<Reception, ReceiveError> {
        let (sample, extra) = Sample::decode_as(datagram, self.asked.kind, self.config.axes)?;
        if self.asked.kind.is_personal() && extra.receiver != self.config.place {
            return Err(ReceiveError::Receiver { receiver: extra.receiver });
        }
        self.handle_extended(&sample, &extra)
    }

    /// Step 2 with a datagram that was decoded already: many peers may receive the same one.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] if it is not a sample for this peer; nothing changed.
    #[inline(always)]
    pub fn handle_sample(&mut self, sample: &Sample<A>) -> Result<Reception, ReceiveError> {
        if self.asked.kind != SampleKind::State {
            return self.handle_extended(sample, &Extra::NONE);
        }
        Ok(self.accept(sample)?.map_or(Reception::Stale, |_| Reception::Newest))
    }

    /// [`Peer::handle_sample`] with what a sample for this peer says beyond position and velocity.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] if it is not a sample for this peer; nothing changed.
    #[inline(always)]
    pub fn handle_extended(&mut self, sample: &Sample<A>, extra: &Extra<A>) -> Result<Reception, ReceiveError> {
        let Some(place) = self.accept(sample)? else { return Ok(Reception::Stale) };
        if self.asked.kind != SampleKind::State {
            self.strategy.accept(place, &extra.numbers);
            if let Some(rotation) = &mut self.rotation {
                rotation.hold(place, &extra.attitude);
            }
        }
        Ok(Reception::Newest)
    }

    /// Takes in position and velocity, and gives the place of their sender; `None` if they are not the newest.
    #[inline(always)]
    fn accept(&mut self, sample: &Sample<A>) -> Result<Option<usize>, ReceiveError> {
        if sample.session != self.config.session {
            return Err(ReceiveError::Session { found: sample.session });
        }
        let Some(place) = self.place_of(sample.sender) else { return Err(ReceiveError::Sender { sender: sample.sender }) };
        let is_newest = self.held.accept(place, sample.sequence, sample.sent, sample.state);
        self.stale_mean |= is_newest;
        Ok(is_newest.then_some(place))
    }

    /// Step 3: computes the forces of this tick, where the next one follows after the period of the tick.
    #[inline(always)]
    pub fn compute(&mut self, now: Instant) -> Forces<A> {
        self.compute_over(now, self.config.tick)
    }

    /// Step 3: computes the forces of this tick, where the next one follows after `span`.
    #[inline(always)]
    pub fn compute_over(&mut self, now: Instant, span: Duration) -> Forces<A> {
        if self.stale_mean {
            self.held.refresh();
            self.stale_mean = false;
        }
        let heard = if self.asked.any { self.heard() } else { None };
        let own = self.object.state();
        let coupling = heard.unwrap_or_else(|| self.coupling_force(own));
        let walls = self.config.enclosure.as_ref().map(|enclosure| enclosure.force(own));
        let ahead = if self.asked.prediction {
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
        if self.config.compute_delay {
            self.applied = core::mem::replace(&mut self.computed, computed);
        } else {
            self.applied = computed;
        }
        let damped = self.config.own_damping > 0.0;
        let recorded = |axis: usize| if damped { command.force[axis] + self.config.own_damping * own.velocity[axis] } else { command.force[axis] };
        Forces { coupling, coordination: core::array::from_fn(recorded), commanded: command.force, target: command.target }
    }

    /// Step 4: moves to the next tick, `span` after `now`.
    #[inline(always)]
    pub fn advance(&mut self, now: Instant, span: Duration) {
        self.device.advance(now, span, self.applied.coupling);
        if self.asked.role == Role::Copy {
            self.object.advance(span, self.applied.on_object);
        }
        if let Some(rotation) = &mut self.rotation {
            rotation.advance(now, span);
        }
        self.local_time = self.local_time.saturating_add_nanos(self.tick_nanos);
    }

    /// What the peer's own clock shows: 0 at its first tick, and a tick more at each one after it.
    #[must_use]
    pub const fn local_time(&self) -> Instant {
        self.local_time
    }

    /// Sets the peer's own clock.
    pub const fn set_local_time(&mut self, local_time: Instant) {
        self.local_time = local_time;
    }

    /// The device.
    #[must_use]
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The device, to change what its hand does.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// The copy of the object.
    #[must_use]
    #[inline]
    pub const fn object(&self) -> &ObjectCopy<A> {
        &self.object
    }

    /// The copy of the object, to put it into a state.
    pub const fn object_mut(&mut self) -> &mut ObjectCopy<A> {
        &mut self.object
    }

    /// The part that turns, if the object has an inertia.
    #[must_use]
    pub fn rotation(&self) -> Option<&Rotation> {
        self.rotation.as_deref()
    }

    /// The part that turns, to put it into a state or to change its gains.
    pub fn rotation_mut(&mut self) -> Option<&mut Rotation> {
        self.rotation.as_deref_mut()
    }

    /// Holds that state, sampled at `sent` on the sender's clock, from another peer (see [`Held::hold`]); the others count in order, with this peer left out.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    pub fn hold(&mut self, other: usize, sent: Instant, state: State<A>) {
        self.held.hold(other, sent, state);
        self.stale_mean = true;
    }

    /// Changes KC and BC, from the next tick on.
    pub const fn set_coupling(&mut self, coupling: Gains) {
        self.config.coupling = coupling;
    }

    /// The forces computed at the latest tick, which act over the next one if forces are applied one tick late.
    #[must_use]
    pub const fn computed(&self) -> &Acting<A> {
        &self.computed
    }

    /// The forces that act over the tick that begins now, as of the latest [`Peer::compute`].
    #[must_use]
    pub const fn applied(&self) -> &Acting<A> {
        &self.applied
    }

    /// Whether forces are applied one tick after they were computed.
    #[must_use]
    pub const fn compute_delay(&self) -> bool {
        self.config.compute_delay
    }

    /// Replaces the forces computed at the latest tick.
    pub const fn set_computed(&mut self, computed: Acting<A>) {
        self.computed = computed;
    }

    /// The strategy.
    #[must_use]
    pub const fn strategy(&self) -> &S {
        &self.strategy
    }

    /// The strategy, to change its gains.
    pub const fn strategy_mut(&mut self) -> &mut S {
        &mut self.strategy
    }

    /// New values of the parameters that the strategy has of its own, from the next tick on, with β as it is then [N·s/m] and the damping of the copy with β
    /// in it. Send times of samples are kept for a strategy that had a horizon when the peer was made.
    pub fn set_parameters(&mut self, own: &LawValues, own_damping: f64, damping: f64) {
        self.strategy.set_parameters(own);
        if let Some(horizon) = self.strategy.horizon() {
            self.held.set_horizon(horizon);
        }
        if own_damping.to_bits() != self.config.own_damping.to_bits() {
            self.config.own_damping = own_damping;
            self.object.set_damping(damping);
        }
    }

    /// β, by how much the strategy damps the copy [N·s/m].
    #[must_use]
    pub const fn own_damping(&self) -> f64 {
        self.config.own_damping
    }

    /// How the device touches the copy.
    #[must_use]
    pub const fn contact(&self) -> Contact {
        self.config.contact
    }

    /// Changes how the device touches the copy, from the next tick on.
    pub const fn set_contact(&mut self, contact: Contact) {
        self.config.contact = contact;
    }

    /// The place of another peer among those that are held; `None` if it is not heard.
    #[inline(always)]
    pub(crate) fn place_of(&self, sender: u32) -> Option<usize> {
        self.held.place_of(sender, self.config.place)
    }

    /// What [`crate::Ages`] change: the peer's own state, what it holds, whether a sample has changed since the mean was computed, and the part that turns.
    pub(crate) fn aged_parts(&mut self) -> (&State<A>, &mut Held<A>, &mut bool, Option<&mut Rotation>) {
        (self.object.state(), &mut self.held, &mut self.stale_mean, self.rotation.as_deref_mut())
    }

    /// Brings up to date what some strategies ask for and most do not, and gives the coupling force if it was heard of.
    fn heard(&mut self) -> Option<[f64; A]> {
        if self.asked.horizon {
            self.held.move_on(self.local_time);
        }
        if let Role::Client { server } = self.asked.role {
            self.object.set_state(*self.held.state(server).expect("the server is another peer"));
        }
        if let Some(rotation) = &mut self.rotation {
            let PeerConfig { contact, coupling, compute_delay, .. } = &self.config;
            return Some(rotation.compute(self.object.state(), &self.device.state(), *contact, coupling, *compute_delay));
        }
        self.strategy.heard_coupling()
    }

    #[inline]
    fn coupling_force(&self, object: &State<A>) -> [f64; A] {
        let PeerConfig { contact, coupling, .. } = self.config;
        if contact == Contact::None {
            return [0.0; A];
        }
        let device = self.device.state();
        core::array::from_fn(|axis| contact.force_along(axis, &coupling, device.along(axis).relative_to(object.along(axis))))
    }
}
