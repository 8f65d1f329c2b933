//! State machine of a joined peer: datagrams and instants go in; datagrams, forces on the device and rows of ticks come out.

use std::collections::VecDeque;
use std::time::Duration;

use cohaptic_harness::live::{GateStats, GatedDevice};
use cohaptic_harness::{StateRow, TickRow, TurnRow};
use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{Clock, Gains, Held, LastSent, ObjectCopy, Peer, SendWhen, SimulatedDevice, State};
use cohaptic_scene::{FromScene, PeerKind, Scene, Strategies};
use cohaptic_units::Instant;

use super::device::JoinedDevice;
use super::fitness::{check, compare};
use super::others::Others;
use super::seat::{Notices, SeatTaken};
use super::{HeardSender, Mismatch, Unfit};
use crate::client::{Client, ClientConfig, Heard, SILENCE, SessionInfo};
use crate::{Entropy, EntropyError, Label, MAX_DATAGRAM, Place, SessionKey};

/// Fade of the coupling of a simulated device. The coupling of a device in a hand has the `silence.fade` of the peer.
const FADE: Duration = Duration::from_millis(250);

/// Identity of a joined peer.
#[derive(Clone, Debug)]
pub struct JoinedConfig {
    /// Session key. `None` for a session without a key.
    pub key: Option<SessionKey>,
    /// Fingerprint of the scene, for hellos.
    pub scene: u64,
    /// Label of the device, for hellos.
    pub label: Label,
    /// Silence after which the session gives the seat of a program to another program; see [`stale_after`](crate::stale_after).
    pub stale_after: Duration,
}

/// Datagram for the session.
#[derive(Clone, Copy, Debug)]
pub struct Outgoing {
    buffer: [u8; MAX_DATAGRAM],
    len: usize,
}

impl Outgoing {
    /// Returns the bytes of the datagram.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.buffer[..self.len]
    }
}

/// Peer of a live session, computed at another computer than the session: the same device, coupling and law as in a peer of the session itself.
///
/// Pass each received datagram to [`JoinedPeer::handle_datagram`] with the instant of its arrival, call [`JoinedPeer::handle_timeout`] at the instant of
/// [`JoinedPeer::poll_timeout`], and send the datagrams of [`JoinedPeer::poll_transmit`]. All instants are on one clock of this computer, and must not go
/// back. Tick 0 is the welcome of the session or, without a key, the first call of `handle_timeout`.
///
/// A tick has the order of a session: the peer sends a sample, takes the samples received by the instant of the tick, computes the forces,
/// and moves. While a device in a hand cannot be read, nothing is sent, so that the session fades the peer by its rule of silence. While the session is silent
/// for a second, the coupling is zero; when either comes back, the coupling rises from zero over the fade of the peer.
#[derive(Debug)]
pub struct JoinedPeer {
    client: Client,
    peer: Peer<3, JoinedDevice, BuiltInStrategy<3>>,
    /// Scene with the kind of this peer at this computer.
    scene: Scene,
    place: usize,
    clock: Clock,
    /// Number of the next tick.
    tick: u64,
    /// Instant of tick 0; `None` before the welcome.
    began: Option<Instant>,
    /// Number of the next tick with a sample, and ticks from sample to sample.
    next_send: (u64, u64),
    last_sent: Option<LastSent<3>>,
    /// Number of the next datagram with a sample.
    sequence: u64,
    /// Samples for the next tick, with the instants of arrival.
    arrived: VecDeque<(Instant, Sample<3>, Extra<3>)>,
    outgoing: VecDeque<Outgoing>,
    /// Further peers elsewhere.
    others: Others,
    coupling: Coupling,
    /// Senders, indexed by peer of the scene. The entry of this peer stays empty.
    senders: Vec<HeardSender>,
    sent: u64,
    /// Silences of the session so far.
    silences: u64,
    mismatch: Option<Mismatch>,
    notices: Notices,
}

/// Coupling between device and copy over time.
#[derive(Clone, Copy, Debug)]
struct Coupling {
    gains: Gains,
    fade: Duration,
    /// `true` if the device could be read at the latest tick.
    device: bool,
    /// `true` if the session was heard of late.
    session: bool,
    /// Beginning of the rise to the whole coupling; `None` if the coupling was whole from the beginning.
    rises: Option<Instant>,
}

impl Coupling {
    const fn is_there(&self) -> bool {
        self.device && self.session
    }

    /// Notes the presence of device and session at a tick.
    fn attend(&mut self, now: Instant, device: bool, session: bool) {
        let was_there = self.is_there();
        (self.device, self.session) = (device, session);
        if self.is_there() && !was_there {
            self.rises = Some(now);
        }
    }

    /// Returns the gains at an instant. Zero at once without device or session: a user must not feel a force towards an outdated state.
    fn at(&self, now: Instant) -> Gains {
        let risen = |since: Instant| (now.saturating_duration_since(since).as_secs_f64() / self.fade.as_secs_f64()).min(1.0);
        let weight = if self.is_there() { self.rises.map_or(1.0, risen) } else { 0.0 };
        self.gains.scaled(weight)
    }
}

impl JoinedPeer {
    /// Returns the peer at `place` of `scene` before its first datagram. The kind of the peer in `scene` is the kind at this computer: `simulated`, or a
    /// kind with a device in a hand, passed as `device`.
    ///
    /// # Errors
    ///
    /// [`Unfit`] if the peer cannot be computed at another computer.
    ///
    /// # Panics
    ///
    /// If `place` is no peer of the scene.
    pub fn new(scene: Scene, place: usize, config: JoinedConfig, device: Option<Box<dyn cohaptic_device::Device>>) -> Result<Self, Unfit> {
        check(&scene, place)?;
        // The clock of this computer is what it is: a clock in the scene stands for it in virtual time. The scene keeps its clocks, because automatic
        // parameters of the law are those of the session, whose peers may all have the same offset and drift.
        let clock = Clock::regular(scene.peers[place].clock.tick);
        let spec = &scene.peers[place];
        let start = scene.initial_device(place);
        let (in_hand, device) = match device {
            Some(device) => (true, JoinedDevice::InHand { device: Box::new(GatedDevice::new(device, clock.tick)), read: start, is_coupled: false }),
            None => (false, JoinedDevice::Simulated(SimulatedDevice::new(spec.device, spec.hand.as_ref(), start, scene.integrator, &clock))),
        };
        let object = ObjectCopy::new(scene.copy_config(place), scene.initial_state(place), scene.integrator, &clock);
        let held = Held::new((0..scene.peers.len()).filter(|other| *other != place).map(|other| scene.initial_state(other)));
        let mut peer = Peer::new(scene.peer_config(place), device, object, FromScene.strategy(&scene, place), held);
        if in_hand {
            peer.set_exchange(spec.exchange_in_hand());
        }
        if let Some(rotation) = scene.rotation_of(place) {
            peer = peer.with_rotation(rotation);
        }
        let (session, seat) = (scene.seed, Place(u32::try_from(place).expect("a scene has fewer than 2^32 peers")));
        let peers = u32::try_from(scene.peers.len()).expect("a scene has fewer than 2^32 peers");
        let info = SessionInfo { axes: scene.axes.count(), peers, tick: clock.tick, update: scene.coordination.update };
        let way = match config.key {
            Some(key) => ClientConfig::Keyed { session, place: seat, key },
            None => ClientConfig::Keyless { session, place: seat, info },
        };
        let fade = scene.peers[place].kind.silence().map_or(FADE, |silence| silence.fade);
        let coupling = Coupling { gains: scene.coupling(place), fade, device: !in_hand, session: true, rises: None };
        let others = Others::of(&scene, place);
        let senders = vec![HeardSender::default(); scene.peers.len()];
        let next_send = (spec.phase, scene.samples_every(place));
        Ok(Self {
            client: Client::new(way, Instant::ZERO).with_kind(scene.sample_kind()).introduced(config.scene, config.label),
            peer,
            scene,
            place,
            clock,
            tick: 0,
            began: None,
            next_send,
            last_sent: None,
            sequence: 0,
            arrived: VecDeque::new(),
            outgoing: VecDeque::new(),
            others,
            coupling,
            senders,
            sent: 0,
            silences: 0,
            mismatch: None,
            notices: Notices::new(config.stale_after),
        })
    }

    /// Returns the instant at which [`JoinedPeer::handle_timeout`] has to be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Instant {
        let hello = self.client.poll_timeout();
        self.next_tick().map_or(hello, |tick| tick.min(hello))
    }

    /// Returns the instant of the next tick. `None` before the welcome. Without a key the first tick is due at once.
    #[must_use]
    pub fn next_tick(&self) -> Option<Instant> {
        match self.began {
            Some(began) => Some(began.saturating_add(self.clock.local_time(self.tick).saturating_duration_since(Instant::ZERO))),
            None => self.is_keyless().then_some(Instant::ZERO),
        }
    }

    /// Returns the instant of tick 0; `None` before the welcome.
    #[must_use]
    pub const fn began(&self) -> Option<Instant> {
        self.began
    }

    const fn is_keyless(&self) -> bool {
        // Without a key the parameters of the session are known from the beginning, and no welcome ever comes.
        self.client.info().is_some() && self.client.joinings() == 0
    }

    /// Takes a datagram from the address of the session, received at `at`. A datagram for another program changes nothing.
    pub fn handle_datagram(&mut self, at: Instant, datagram: &[u8]) {
        match self.client.handle_datagram(at, datagram) {
            Heard::Welcome => {
                self.began.get_or_insert(at);
                if let Some(welcome) = self.client.welcome() {
                    self.mismatch = compare(&self.scene, self.place, welcome).err();
                }
            }
            Heard::Newest(sample) => {
                // The client admits senders of the scene only.
                let Some(sender) = self.senders.get_mut(sample.sender as usize) else { return };
                sender.take(at, sample.sequence, sample.sent);
                self.notices.end();
                // A session that was started again counts from 0. The peer sees numbers that go on, or it would take the samples for stale.
                let sample = Sample { session: self.scene.seed, sequence: sender.taken, ..sample };
                self.arrived.push_back((at, sample, *self.client.extra()));
            }
            Heard::Late(sample) => {
                if let Some(sender) = self.senders.get_mut(sample.sender as usize) {
                    sender.come_late();
                }
            }
            Heard::Taken => self.notices.hear(at),
            Heard::Ignored => {}
        }
    }

    /// Makes everything due at `now`: a hello, and at most one tick. A late call gives the forces of the instant at which the tick was due. `observer` gets
    /// the row of the tick, in time since tick 0.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if the system has no random bytes for a hello.
    pub fn handle_timeout(
        &mut self,
        now: Instant,
        entropy: &mut impl Entropy,
        observer: &mut impl FnMut(Instant, &TickRow<'_>),
    ) -> Result<(), EntropyError> {
        if let Some(hello) = self.client.poll_hello(now, entropy)? {
            let mut buffer = [0; MAX_DATAGRAM];
            buffer[..hello.len()].copy_from_slice(&hello);
            self.outgoing.push_back(Outgoing { buffer, len: hello.len() });
        }
        if self.began.is_none() && self.is_keyless() {
            self.began = Some(now);
        }
        if let Some(due) = self.next_tick().filter(|due| *due <= now) {
            self.act(due, now, observer);
        }
        Ok(())
    }

    /// Returns the next datagram for the session.
    pub fn poll_transmit(&mut self) -> Option<Outgoing> {
        self.outgoing.pop_front()
    }

    /// Makes the tick due at `due`. `now`: the time, at `due` or later.
    fn act(&mut self, due: Instant, now: Instant, observer: &mut impl FnMut(Instant, &TickRow<'_>)) {
        // Signals of the hand and send times are on the peer's own clock, which shows 0 at tick 0.
        let local = self.clock.local_time(self.tick);
        if self.tick == self.next_send.0 {
            self.next_send.0 += self.next_send.1;
            self.send(local);
        }
        while self.arrived.front().is_some_and(|(at, ..)| *at <= due) {
            let Some((at, sample, extra)) = self.arrived.pop_front() else { break };
            let since = Instant::ZERO.saturating_add(at.saturating_duration_since(self.began.unwrap_or(at)));
            // The client has checked session and sender, and numbers rise.
            let received = self.others.take_in(local, since, (&sample, &extra), &mut self.peer);
            debug_assert!(received.is_ok(), "{received:?}");
        }
        let axes = self.scene.axes.count();
        let is_heard = due < self.heard_last().saturating_add(SILENCE);
        self.silences += u64::from(self.coupling.session && !is_heard);
        let device = self.peer.device_mut().attend(local, now, axes);
        self.coupling.attend(local, device, is_heard);
        self.peer.device_mut().couple(self.coupling.is_there());
        self.peer.set_coupling(self.coupling.at(local));
        self.others.tell(local, &mut self.peer);
        let forces = self.peer.compute_over(local, self.clock.tick);
        let (device, object) = (cohaptic_peer::Device::state(self.peer.device()), *self.peer.object().state());
        let rotation = self.peer.rotation();
        let torque = rotation.map(|rotation| rotation.coordination_torque());
        let row = TickRow {
            at: local,
            peer: self.place,
            device: row(&device, axes),
            object: row(&object, axes),
            target: row(&forces.target, axes),
            coupling_force: &forces.coupling[..axes],
            coordination_force: &forces.coordination[..axes],
            turn: rotation.zip(torque.as_ref()).map(|(rotation, torque)| TurnRow {
                object: rotation.copy(),
                device: rotation.device(),
                coupling_torque: &rotation.computed().coupling,
                coordination_torque: torque,
            }),
        };
        observer(due, &row);
        self.peer.advance(local, self.clock.tick);
        self.tick += 1;
    }

    /// Returns the arrival of the newest sample of any peer, or tick 0.
    fn heard_last(&self) -> Instant {
        let began = self.began.unwrap_or(Instant::ZERO);
        self.senders.iter().filter_map(|sender| sender.latest).fold(began, Instant::max)
    }

    /// Makes the datagrams with the sample of this peer: a single datagram, or one per receiver if samples are personal. Nothing is sent without a device.
    fn send(&mut self, local: Instant) {
        let own = *self.peer.object().state();
        if !self.coupling.device || !self.is_worth_sending(local, &own) {
            return;
        }
        self.last_sent = Some(LastSent { at: local, state: own });
        let (kind, sample) = (self.peer.kind(), self.peer.next_sample(local));
        let others = if kind.is_personal() { self.scene.peers.len() - 1 } else { 1 };
        for other in 0..others {
            // The law counts the other peers without this one; datagrams count all peers.
            let receiver = if kind.is_personal() { other + usize::from(other >= self.place) } else { 0 };
            let numbers = if kind == SampleKind::State { [0.0; 3] } else { self.peer.extra(other) };
            let extra = Extra { receiver: u32::try_from(receiver).unwrap_or(u32::MAX), numbers, attitude: self.peer.attitude() };
            let numbered = Sample { sequence: self.sequence, ..sample };
            let mut plain = [0; MAX_LEN];
            let len = numbered.encode_as(kind, &extra, self.scene.axes.count(), &mut plain);
            let mut buffer = [0; MAX_DATAGRAM];
            if let Some(len) = self.client.seal(&plain[..len], &mut buffer) {
                self.outgoing.push_back(Outgoing { buffer, len });
                (self.sequence, self.sent) = (self.sequence + 1, self.sent + 1);
            }
        }
        if kind != SampleKind::State {
            self.peer.all_sent();
        }
    }

    /// Returns whether the dead bands of the scene let the present sample pass.
    fn is_worth_sending(&self, local: Instant, own: &State<3>) -> bool {
        let when: Option<&SendWhen> = self.scene.coordination.send_when.as_ref();
        when.is_none_or(|when| when.is_due(self.last_sent.as_ref(), local, own, None))
    }

    /// Stops the device for good. A drop of the peer does the same.
    pub fn stop(&mut self) {
        let local = self.clock.local_time(self.tick);
        self.peer.device_mut().stop(local);
    }

    /// Returns the forces that the gate of the device changed or made zero; `None` for a simulated device.
    #[must_use]
    pub fn gate_stats(&self) -> Option<&GateStats> {
        self.peer.device().gate_stats()
    }

    /// Returns the difference between the session and the scene. `None` if the latest welcome fits, and before the first.
    #[must_use]
    pub const fn mismatch(&self) -> Option<&Mismatch> {
        self.mismatch.as_ref()
    }

    /// Returns the error that another program keeps the seat of this peer, after notices for longer than a vanished program holds a seat. `None` before.
    #[must_use]
    pub fn seat_taken(&self) -> Option<SeatTaken> {
        let (place, patience) = (self.place, self.notices.patience());
        self.notices.is_for_good().then(|| SeatTaken { place, name: self.scene.peers[place].name.clone(), patience })
    }

    /// Returns the figures of the peer at `now`.
    #[must_use]
    pub fn status(&self, now: Instant) -> JoinedStatus {
        let others = self.senders.iter().enumerate().filter(|(place, _)| *place != self.place).map(|(_, sender)| sender);
        let latest = others.clone().filter_map(|sender| sender.latest).max();
        JoinedStatus {
            began: self.began,
            elapsed: self.began.map_or(Duration::ZERO, |began| now.saturating_duration_since(began)),
            ticks: self.tick,
            joinings: self.client.joinings(),
            sent: self.sent,
            taken: others.clone().map(|sender| sender.taken).sum(),
            lost: others.map(HeardSender::lost).sum(),
            age: latest.map(|latest| now.saturating_duration_since(latest)),
            is_device_there: self.coupling.device,
            is_session_there: self.began.is_some() && self.coupling.session,
            is_seat_taken: self.notices.is_taken(now),
            silences: self.silences,
            device: cohaptic_peer::Device::state(self.peer.device()),
            object: *self.peer.object().state(),
            attitude: self.peer.rotation().map(|rotation| *rotation.copy()),
            force: self.peer.applied().coupling,
        }
    }

    /// Returns the samples heard, indexed by peer of the scene.
    #[must_use]
    pub fn senders(&self) -> &[HeardSender] {
        &self.senders
    }

    /// Returns the kind of this peer at this computer.
    #[must_use]
    pub fn kind(&self) -> &PeerKind {
        &self.scene.peers[self.place].kind
    }
}

/// Figures of a joined peer at an instant.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct JoinedStatus {
    /// Instant of tick 0; `None` before the welcome.
    pub began: Option<Instant>,
    /// Time since tick 0.
    pub elapsed: Duration,
    /// Ticks made.
    pub ticks: u64,
    /// Welcomes taken.
    pub joinings: u64,
    /// Samples sent.
    pub sent: u64,
    /// Samples taken from all senders.
    pub taken: u64,
    /// Samples lost on the way, from all senders.
    pub lost: u64,
    /// Time since the newest sample came; `None` before the first.
    pub age: Option<Duration>,
    /// `true` if the device could be read at the latest tick.
    pub is_device_there: bool,
    /// `true` if a peer of the session was heard within the last second.
    pub is_session_there: bool,
    /// `true` if the session said within the last second that another program has the seat.
    pub is_seat_taken: bool,
    /// Silences of the session of at least a second.
    pub silences: u64,
    /// State of the device.
    pub device: State<3>,
    /// State of the copy.
    pub object: State<3>,
    /// Attitude of the copy; `None` if the object does not turn.
    pub attitude: Option<Attitude>,
    /// Coupling force FC \[N\]. Acts on the hand with the opposite sign.
    pub force: [f64; 3],
}

fn row(state: &State<3>, axes: usize) -> StateRow<'_> {
    StateRow { position: &state.position[..axes], velocity: &state.velocity[..axes] }
}
