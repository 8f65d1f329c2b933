//! One participant, tick by tick.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::tick::on_object;
use crate::wire::{DecodeError, MAX_LEN, Sample};
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
    held: Held<A>,
    /// Whether a sample has changed since the mean was computed.
    stale_mean: bool,
    next_sequence: u64,
    /// What the peer's own clock shows.
    local_time: Instant,
    computed: Acting<A>,
    applied: Acting<A>,
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
        if strategy.needs_ages() {
            held.keep_ages();
        }
        let local_time = Instant::ZERO;
        Self { config, device, object, strategy, held, stale_mean: false, next_sequence: 0, local_time, computed: none, applied: none }
    }

    /// Step 1: writes the sample that this peer sends now into `datagram` and gives its length. `local_time` is what the peer's own clock shows.
    #[inline]
    pub fn sample(&mut self, local_time: Instant, datagram: &mut [u8; MAX_LEN]) -> usize {
        let sequence = self.next_sequence;
        self.next_sequence = sequence.wrapping_add(1);
        let Self { config, object, .. } = self;
        Sample { session: config.session, sender: config.place, sequence, sent: local_time, state: *object.state() }.encode(config.axes, datagram)
    }

    /// Step 2: takes in a datagram from another peer.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] if it is not a sample for this peer; nothing changed.
    #[inline]
    pub fn handle_datagram(&mut self, datagram: &[u8]) -> Result<Reception, ReceiveError> {
        self.handle_sample(&Sample::decode(datagram, self.config.axes)?)
    }

    /// Step 2 with a datagram that was decoded already: many peers may receive the same one.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] if it is not a sample for this peer; nothing changed.
    #[inline]
    pub fn handle_sample(&mut self, sample: &Sample<A>) -> Result<Reception, ReceiveError> {
        if sample.session != self.config.session {
            return Err(ReceiveError::Session { found: sample.session });
        }
        let Some(place) = self.place_of(sample.sender) else { return Err(ReceiveError::Sender { sender: sample.sender }) };
        if self.held.accept(place, sample.sequence, sample.sent, sample.state) {
            self.stale_mean = true;
            Ok(Reception::Newest)
        } else {
            Ok(Reception::Stale)
        }
    }

    /// Step 3: computes the forces of this tick.
    #[inline(always)]
    pub fn compute(&mut self, now: Instant) -> Forces<A> {
        if self.stale_mean {
            self.held.refresh();
            self.stale_mean = false;
        }
        let own = self.object.state();
        let coupling = self.coupling_force(own);
        let command = self.strategy.command(&Context { now, local_time: self.local_time, own, held: &self.held });
        let mut on_object: [f64; A] = core::array::from_fn(|axis| on_object(coupling[axis], command.force[axis]));
        if let Some(enclosure) = &self.config.enclosure {
            let walls = enclosure.force(own);
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
        self.object.advance(span, self.applied.on_object);
        self.local_time = self.local_time.saturating_add(self.config.tick);
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

    /// How the device touches the copy.
    #[must_use]
    pub const fn contact(&self) -> Contact {
        self.config.contact
    }

    /// Changes how the device touches the copy, from the next tick on.
    pub const fn set_contact(&mut self, contact: Contact) {
        self.config.contact = contact;
    }

    /// The place of another peer among those that are held, in order with this peer left out; `None` if there is no such peer.
    #[inline(always)]
    pub(crate) fn place_of(&self, sender: u32) -> Option<usize> {
        let (sender, own) = (sender as usize, self.config.place as usize);
        let place = if sender < own { sender } else { sender.wrapping_sub(1) };
        (sender != own && place < self.held.len()).then_some(place)
    }

    /// What [`crate::Ages`] change: the peer's own state, what it holds, and whether a sample has changed since the mean was computed.
    pub(crate) const fn aged_parts(&mut self) -> (&State<A>, &mut Held<A>, &mut bool) {
        (self.object.state(), &mut self.held, &mut self.stale_mean)
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
