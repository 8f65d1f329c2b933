//! The live scene as a state machine.

use std::fmt;
use std::time::Duration;

use cohaptic_device::Device;
use cohaptic_peer::State;
use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_scene::{Axes, LinkKeys, Scene};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkModel, LinkStats};

use crate::observer::{AnyObserver, Ended, Erased, Observer};
use crate::plan::{Model, Plan};
use crate::rows::{Input, InputRow, SendRow};
use crate::simulation::Simulation;
use crate::summary::{Ending, Summary};
use crate::world::live::{GateStats, Presence, RemotePeers, SampleError, SeatStats, Transmit, TurnState};
use crate::world::{Step, Watch, World};

const NANOSECOND: Duration = Duration::from_nanos(1);

/// A running session of a scene with or without remote peers.
///
/// The driver passes samples with [`LiveScene::handle_sample`], each with the logical instant of its arrival. [`LiveScene::poll_timeout`] returns the instant
/// at which to call [`LiveScene::handle_timeout`]. After every call the driver drains [`LiveScene::poll_transmit`]. A late call changes no result: everything
/// due is computed instant by instant, in the order of `docs/model.md`, with the instant at which it was due. Many short steps of time give the same result as
/// one long step.
///
/// Time is *open* from some instant on: everything before that instant has happened. An input takes effect at its own instant, before anything else at that
/// instant. If its instant has passed, the input takes effect at the first open instant.
#[derive(Debug)]
pub struct LiveScene {
    world: AnyWorld,
    /// Number of the session in samples.
    session: u64,
    /// Number of receivers of a sample.
    others: u64,
    /// First instant that has not happened.
    open: Instant,
    /// Ending; `None` while the session runs.
    ended: Option<Ending>,
}

/// A world with one axis, or with three axes for scenes of two or three axes.
enum AnyWorld {
    One(Box<World<1, BuiltInStrategy<1>, RemotePeers<1>>>),
    Three(Box<World<3, BuiltInStrategy<3>, RemotePeers<3>>>),
}

macro_rules! each {
    ($any:expr, $world:ident => $what:expr) => {
        match $any {
            AnyWorld::One($world) => $what,
            AnyWorld::Three($world) => $what,
        }
    };
}

/// State of a peer for display. Components beyond the axes of the scene are zero.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PeerState {
    /// Presence of the peer.
    pub presence: Presence,
    /// Instant at which the peer was last heard; `None` for a simulated peer, and before the first time.
    pub heard: Option<Instant>,
    /// State of the device at its latest tick; `None` for a peer in another process.
    pub device: Option<State<3>>,
    /// State of the copy of the object. For a peer in another process this is the state in its newest sample, or the initial state before the first.
    pub object: State<3>,
    /// Attitudes of copy and device; `None` if the object does not turn.
    pub turn: Option<TurnState>,
}

impl LiveScene {
    /// Returns the scene before its first instant. `devices` returns the device or pointer of the peer with the given index; `None` for a never present device.
    ///
    /// # Panics
    ///
    /// If the scene has more than 23,170 peers; see [`crate::too_large`].
    #[must_use]
    pub fn new(scene: &Scene, mut devices: impl FnMut(usize) -> Option<Box<dyn Device>>) -> Self {
        Self::with_devices(scene, &mut devices)
    }

    /// Like [`LiveScene::new`], compiled once here. With a generic closure, each crate with a session would compile the engine again.
    fn with_devices(scene: &Scene, devices: &mut dyn FnMut(usize) -> Option<Box<dyn Device>>) -> Self {
        // The plan assumes an observer of everything, because each call may pass a different observer.
        let plan = Plan::new(scene, Model::Least, true);
        let simulation = Simulation::new(scene, Model::Least);
        let world = match plan.axes {
            Axes::One => AnyWorld::One(Box::new(simulation.world(&plan, RemotePeers::new(scene)).seated(scene, devices).stopping_with_task(scene))),
            Axes::Two | Axes::Three => {
                AnyWorld::Three(Box::new(simulation.world(&plan, RemotePeers::new(scene)).seated(scene, devices).stopping_with_task(scene)))
            }
        };
        // The seed is the session number of peers: see `Scene::peer_config`.
        Self { world, session: scene.seed, others: scene.peers.len() as u64 - 1, open: Instant::ZERO, ended: None }
    }

    /// Takes a sample of a peer of kind `udp`, which arrived at `at`, and sends the sample over the links of that peer. Returns the instant at which the sample
    /// takes effect: `at`, or the first open instant if `at` has passed.
    ///
    /// The caller has verified the origin of the datagram; its content is checked here. A refused sample is counted and changes nothing else. Sequence numbers
    /// of a peer must rise, but may start again after a silence. The receivers see continuous numbers.
    ///
    /// # Errors
    ///
    /// The outer error is the error of the observer. The observer sees everything due before `at`, and the sample if taken. The inner error is the reason of a
    /// refusal.
    pub fn handle_sample<O: Observer>(
        &mut self,
        at: Instant,
        peer: usize,
        datagram: &[u8],
        observer: &mut O,
    ) -> Result<Result<Instant, SampleError>, O::Error> {
        Erased::run(observer, |observer| self.take_sample(at, peer, datagram, observer))
    }

    fn take_sample(
        &mut self,
        at: Instant,
        peer: usize,
        datagram: &[u8],
        observer: &mut AnyObserver<'_>,
    ) -> Result<Result<Instant, SampleError>, Ended> {
        let Some(counts) = self.come_in(at, observer)? else { return Ok(Err(SampleError::Ended)) };
        let session = self.session;
        if let Err(error) = each!(&mut self.world, world => world.take_sample(counts, peer, datagram, session)) {
            return Ok(Err(error));
        }
        let late = counts.saturating_duration_since(at);
        // An input at the instant handled last takes effect a nanosecond later, which is not counted as late.
        if late > NANOSECOND {
            each!(&mut self.world, world => world.note_late(peer, late));
        }
        if observer.wants_sends() {
            let size = Bytes::new(datagram.len() as u64);
            observer.on_send(&SendRow { at: counts, peer, packets: self.others, size })?;
        }
        // The row comes after the sample was taken, so a refused sample leaves no row in the record.
        observer.on_input(&InputRow { at: counts, what: Input::Sample { peer, datagram } })?;
        Ok(Ok(counts))
    }

    /// Changes a link from `at` on, or from the first open instant if `at` has passed. Returns the instant of the change; `None` without such a link or if
    /// the session has ended. `model` is the model of `keys`: see [`LinkKeys::model`]. Packets in flight keep their delay.
    ///
    /// # Errors
    ///
    /// The error of the observer. The observer sees everything due before `at`, and the change.
    pub fn set_link<O: Observer>(
        &mut self,
        at: Instant,
        ends: (usize, usize),
        keys: &LinkKeys,
        model: &LinkModel,
        observer: &mut O,
    ) -> Result<Option<Instant>, O::Error> {
        Erased::run(observer, |observer| self.take_link(at, ends, keys, model, observer))
    }

    fn take_link(
        &mut self,
        at: Instant,
        (from, to): (usize, usize),
        keys: &LinkKeys,
        model: &LinkModel,
        observer: &mut AnyObserver<'_>,
    ) -> Result<Option<Instant>, Ended> {
        if self.link_stats(from, to).is_none() {
            return Ok(None);
        }
        let Some(at) = self.come_in(at, observer)? else { return Ok(None) };
        each!(&mut self.world, world => world.take_link(at, from, to, model));
        observer.on_input(&InputRow { at, what: Input::Link { from, to, keys } })?;
        Ok(Some(at))
    }

    /// Sets the time on the clock by which the driver calls, for the gates of devices in hands: age of a reading, pause of the loop and change of force are
    /// those that the hand feels, also while late ticks are computed in quick succession. The clock changes no motion and no record. Without this call the
    /// logical time is the clock.
    pub fn set_clock(&mut self, clock: Instant) {
        each!(&mut self.world, world => world.set_clock(clock));
    }

    /// Computes everything due up to and including `now`.
    ///
    /// # Errors
    ///
    /// The error of the observer.
    pub fn handle_timeout<O: Observer>(&mut self, now: Instant, observer: &mut O) -> Result<(), O::Error> {
        Erased::run(observer, |observer| self.let_happen(now, observer))?;
        // `now` itself has happened, so the next open instant is one nanosecond later.
        self.open = self.open.max(now.saturating_add(NANOSECOND));
        Ok(())
    }

    /// Returns the instant of the next call of [`LiveScene::handle_timeout`], for a tick or for a peer in another process; `None` once the session has ended.
    /// Packets for simulated peers wait for the next tick, at which these peers read them.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.ended.is_some() { None } else { Some(each!(&self.world, world => world.next_wake())) }
    }

    /// Returns the next instant with an event; `None` once the session has ended.
    fn next_instant(&self) -> Option<Instant> {
        if self.ended.is_some() { None } else { Some(each!(&self.world, world => world.next_instant())) }
    }

    /// Removes and returns the next datagram for a peer of kind `udp`, present or not, in the order of arrival. A datagram takes memory until this call.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        each!(&mut self.world, world => world.next_transmit())
    }

    /// Ends the session after everything due up to and including `now`.
    ///
    /// # Errors
    ///
    /// The error of the observer.
    pub fn stop<O: Observer>(&mut self, now: Instant, observer: &mut O) -> Result<(), O::Error> {
        self.handle_timeout(now, observer)?;
        if self.ended.is_none() {
            // If `now` has passed, this is the last instant that has happened, not `now`.
            let at = Instant::from_nanos(self.open.as_nanos() - 1);
            observer.on_input(&InputRow { at, what: Input::End })?;
            self.end(Ending::Interrupted(at));
        }
        Ok(())
    }

    /// Returns the ending of the session; `None` while the session runs.
    #[must_use]
    pub const fn ended(&self) -> Option<Ending> {
        self.ended
    }

    /// Returns the first open instant. Everything before has happened.
    #[must_use]
    pub const fn open(&self) -> Instant {
        self.open
    }

    /// Returns the presence of a peer; `None` beyond the last peer.
    #[must_use]
    pub fn presence(&self, peer: usize) -> Option<Presence> {
        each!(&self.world, world => world.presence(peer, self.open))
    }

    /// Returns the counters of inputs of a remote peer; `None` for a simulated peer.
    #[must_use]
    pub fn seat_stats(&self, peer: usize) -> Option<SeatStats> {
        each!(&self.world, world => world.seat_stats(peer))
    }

    /// Returns the counters of the gate of a device in a hand; `None` for another peer, and for a device that is never present.
    #[must_use]
    pub fn gate_stats(&self, peer: usize) -> Option<GateStats> {
        each!(&self.world, world => world.gate_stats(peer))
    }

    /// Returns the counters of a link; `None` without such a link.
    #[must_use]
    pub fn link_stats(&self, from: usize, to: usize) -> Option<LinkStats> {
        each!(&self.world, world => world.link_stats(from, to))
    }

    /// Returns the state of a peer for display; `None` beyond the last peer.
    #[must_use]
    pub fn peer(&self, peer: usize) -> Option<PeerState> {
        let presence = self.presence(peer)?;
        each!(&self.world, world => {
            let (device, object) = world.states(peer)?;
            let device = device.map(|state| widen(&state));
            Some(PeerState { presence, heard: world.heard(peer), device, object: widen(&object), turn: world.turn(peer) })
        })
    }

    /// Returns the results so far. While the session runs, the ending is an interruption at the present instant.
    #[must_use]
    pub fn summary(&self) -> Summary {
        each!(&self.world, world => world.summary(self.ended.unwrap_or_else(|| Ending::Interrupted(world.now()))))
    }

    /// Computes everything before `at`, and returns the effective instant of an input of `at`; `None` if the session has ended by then.
    fn come_in(&mut self, at: Instant, observer: &mut AnyObserver<'_>) -> Result<Option<Instant>, Ended> {
        let at = at.max(self.open);
        // Up to the nanosecond before, because an input comes before everything else at its instant.
        if let Some(before) = at.as_nanos().checked_sub(1) {
            self.let_happen(Instant::from_nanos(before), observer)?;
        }
        self.open = at;
        // An input at or after the end of the scene is refused even before the end was computed.
        let is_open = self.ended.is_none() && at < each!(&self.world, world => world.end());
        Ok(is_open.then_some(at))
    }

    fn let_happen(&mut self, now: Instant, observer: &mut AnyObserver<'_>) -> Result<(), Ended> {
        let watch = Watch::of(observer);
        // An event may make a further event due, so the next instant is asked for again after each event.
        while let Some(at) = self.next_instant().filter(|at| *at <= now) {
            if let Step::Ended(ending) = each!(&mut self.world, world => world.happen(at, observer, watch))? {
                self.end(ending);
            }
        }
        Ok(())
    }

    fn end(&mut self, ending: Ending) {
        self.ended = Some(ending);
        // No force of the session may remain on a hand after the end.
        each!(&mut self.world, world => world.stop_devices(world.now()));
    }
}

fn widen<const A: usize>(state: &State<A>) -> State<3> {
    let widen = |values: &[f64; A]| core::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
    State { position: widen(&state.position), velocity: widen(&state.velocity) }
}

impl fmt::Debug for AnyWorld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        each!(self, world => write!(f, "a scene at {}", world.now()))
    }
}
