//! The live scene as a state machine.

use std::fmt;
use std::time::Duration;

use cohaptic_peer::State;
use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::{Axes, LinkKeys, Scene};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkModel, LinkStats};

use super::device::LiveDevice;
use super::inputs::{Input, InputRow};
use super::presence::{RemotePeers, Transmit};
use super::seat::{Presence, SampleError, SeatStats};
use crate::observer::{AnyObserver, Ended, Erased, Observer, SendRow};
use crate::plan::{Model, Plan};
use crate::simulation::Simulation;
use crate::summary::{Ending, Summary};
use crate::world::{Step, Watch, World};

const NANOSECOND: Duration = Duration::from_nanos(1);

/// A scene in the middle of a session, some of whose peers may be remote.
///
/// The driver hands in samples with [`LiveScene::handle_sample`], each with the logical instant at which it came, asks with [`LiveScene::poll_timeout`] when to
/// come back, calls [`LiveScene::handle_timeout`] then, and after every call drains [`LiveScene::poll_transmit`]. Being late costs nothing but lateness: what
/// was due happens instant by instant, in the order that `docs/model.md` lays down, and comes out with the instant at which it was due. In which steps the
/// driver lets time pass changes nothing but when it learns of things.
///
/// Time is *open* from some instant on: everything before it has happened. What comes in counts at its own instant, before anything else at that instant, or,
/// if that has passed, at the first one that is open.
#[derive(Debug)]
pub struct LiveScene {
    world: AnyWorld,
    session: u64,
    /// The receivers of a sample.
    others: u64,
    open: Instant,
    ended: Option<Ending>,
}

/// A world with one axis, or with three, which also simulates scenes of two.
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

/// One peer as it stands, for display. Components beyond the axes of the scene are zero.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PeerState {
    /// Whether it is there.
    pub presence: Presence,
    /// When it was last heard; `None` if it is simulated here, or never was.
    pub heard: Option<Instant>,
    /// Its device at its latest tick; `None` for a peer in another process.
    pub device: Option<State<3>>,
    /// Its copy of the object; for a peer in another process, what its newest sample says of it (where it begins, before the first).
    pub object: State<3>,
    /// How copy and device are turned; `None` if the object does not turn.
    pub turn: Option<TurnState>,
}

/// How one peer is turned, at the same instants as its [`PeerState`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TurnState {
    /// The attitude of its device; `None` for one that does not turn, or in another process.
    pub device: Option<Attitude>,
    /// The attitude of its copy.
    pub object: Attitude,
}

impl LiveScene {
    /// The scene at its beginning. `devices` gives the device of each peer of kind `falcon`, by its place; `None` is one that is never there.
    ///
    /// # Panics
    ///
    /// If the scene has more than 23,170 peers; see [`crate::too_large`].
    #[must_use]
    pub fn new(scene: &Scene, mut devices: impl FnMut(usize) -> Option<Box<dyn LiveDevice>>) -> Self {
        Self::with_devices(scene, &mut devices)
    }

    /// [`LiveScene::new`], compiled here once: for a function of any type, each crate that begins a session would compile the engine.
    fn with_devices(scene: &Scene, devices: &mut dyn FnMut(usize) -> Option<Box<dyn LiveDevice>>) -> Self {
        // The observer is not known yet, and may change.
        let plan = Plan::new(scene, Model::Least, true);
        let simulation = Simulation::new(scene, Model::Least);
        let world = match plan.axes {
            Axes::One => AnyWorld::One(Box::new(simulation.world(&plan, RemotePeers::new(scene)).seated(scene, devices))),
            Axes::Two | Axes::Three => AnyWorld::Three(Box::new(simulation.world(&plan, RemotePeers::new(scene)).seated(scene, devices))),
        };
        // The session that peers of the scene have: see `Scene::peer_config`.
        Self { world, session: scene.seed, others: scene.peers.len() as u64 - 1, open: Instant::ZERO, ended: None }
    }

    /// Takes a sample of a peer of kind `udp`, which came at `at`, and sends it on over the links of that peer. Gives the instant at which it counts: `at`, or
    /// the first that is open.
    ///
    /// The datagram is one of that peer for certain: the caller has made sure where it came from. It is checked all the same. A refused sample is counted
    /// and changes nothing. The peer's samples must have rising numbers; after a silence they may begin anew. For the others they are numbered on.
    ///
    /// # Errors
    ///
    /// The outer error is that of the observer, which sees all that is due before `at`, and the sample if it is taken; the inner one says why the sample was refused.
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
        // What comes at the very instant that was just handled is not late, but it counts behind it.
        if late > NANOSECOND {
            each!(&mut self.world, world => world.note_late(peer, late));
        }
        if observer.wants_sends() {
            let size = Bytes::new(datagram.len() as u64);
            observer.on_send(&SendRow { at: counts, peer, packets: self.others, size })?;
        }
        observer.on_input(&InputRow { at: counts, what: Input::Sample { peer, datagram } })?;
        Ok(Ok(counts))
    }

    /// Changes a link from `at` on, or from the first instant that is open, which it gives; `None` if there is no such link or the session has ended. `model` is
    /// that of `keys`: see [`LinkKeys::model`]. Packets on the way keep their delay.
    ///
    /// # Errors
    ///
    /// That of the observer, which sees all that is due before `at`, and the change.
    pub fn set_link<O: Observer>(
        &mut self,
        at: Instant,
        ends: (usize, usize),
        keys: &LinkKeys,
        model: &LinkModel,
        observer: &mut O,
    ) -> Result<Option<Instant>, O::Error> {
        let (from, to) = ends;
        if self.link_stats(from, to).is_none() {
            return Ok(None);
        }
        let Some(at) = Erased::run(observer, |observer| self.come_in(at, observer))? else { return Ok(None) };
        each!(&mut self.world, world => world.take_link(at, from, to, model));
        observer.on_input(&InputRow { at, what: Input::Link { from, to, keys } })?;
        Ok(Some(at))
    }

    /// Lets everything happen that is due up to and including `now`.
    ///
    /// # Errors
    ///
    /// That of the observer.
    pub fn handle_timeout<O: Observer>(&mut self, now: Instant, observer: &mut O) -> Result<(), O::Error> {
        Erased::run(observer, |observer| self.let_happen(now, observer))?;
        self.open = self.open.max(now.saturating_add(NANOSECOND));
        Ok(())
    }

    /// When [`LiveScene::handle_timeout`] must be called next, for a tick or for a peer in another process; `None` once the session has ended. What reaches
    /// peers that are simulated here in between waits for it: they look at ticks.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.ended.is_some() { None } else { Some(each!(&self.world, world => world.next_wake())) }
    }

    /// When anything happens next.
    fn next_instant(&self) -> Option<Instant> {
        if self.ended.is_some() { None } else { Some(each!(&self.world, world => world.next_instant())) }
    }

    /// The next datagram that the network has delivered to a peer of kind `udp`, whether or not that is there; in the order of arrival. Until it is fetched it
    /// takes memory.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        each!(&mut self.world, world => world.next_transmit())
    }

    /// Ends the session after everything that is due up to and including `now`.
    ///
    /// # Errors
    ///
    /// That of the observer.
    pub fn stop<O: Observer>(&mut self, now: Instant, observer: &mut O) -> Result<(), O::Error> {
        self.handle_timeout(now, observer)?;
        if self.ended.is_none() {
            // With a `now` that has passed, the last instant that has not.
            let at = Instant::from_nanos(self.open.as_nanos() - 1);
            observer.on_input(&InputRow { at, what: Input::End })?;
            self.end(Ending::Interrupted(at));
        }
        Ok(())
    }

    /// How the session has ended; `None` if it has not.
    #[must_use]
    pub const fn ended(&self) -> Option<Ending> {
        self.ended
    }

    /// The first instant that is open: everything before it has happened.
    #[must_use]
    pub const fn open(&self) -> Instant {
        self.open
    }

    /// Whether a peer is there; `None` beyond the last peer.
    #[must_use]
    pub fn presence(&self, peer: usize) -> Option<Presence> {
        each!(&self.world, world => world.presence(peer, self.open))
    }

    /// What came in at a peer that is remote; `None` for one that is simulated here.
    #[must_use]
    pub fn seat_stats(&self, peer: usize) -> Option<SeatStats> {
        each!(&self.world, world => world.seat_stats(peer))
    }

    /// The counters of a link; `None` if there is none.
    #[must_use]
    pub fn link_stats(&self, from: usize, to: usize) -> Option<LinkStats> {
        each!(&self.world, world => world.link_stats(from, to))
    }

    /// One peer as it stands; `None` beyond the last.
    #[must_use]
    pub fn peer(&self, peer: usize) -> Option<PeerState> {
        let presence = self.presence(peer)?;
        each!(&self.world, world => {
            let (device, object) = world.states(peer)?;
            let device = device.map(|state| widen(&state));
            Some(PeerState { presence, heard: world.heard(peer), device, object: widen(&object), turn: world.turn(peer) })
        })
    }

    /// What has come out so far; as if it were interrupted now, unless it has ended.
    #[must_use]
    pub fn summary(&self) -> Summary {
        each!(&self.world, world => world.summary(self.ended.unwrap_or_else(|| Ending::Interrupted(world.now()))))
    }

    /// Lets everything before `at` happen, and gives the instant at which what comes in at `at` counts; `None` if the session has ended by then.
    fn come_in(&mut self, at: Instant, observer: &mut AnyObserver<'_>) -> Result<Option<Instant>, Ended> {
        let at = at.max(self.open);
        if let Some(before) = at.as_nanos().checked_sub(1) {
            self.let_happen(Instant::from_nanos(before), observer)?;
        }
        self.open = at;
        let is_open = self.ended.is_none() && at < each!(&self.world, world => world.end());
        Ok(is_open.then_some(at))
    }

    fn let_happen(&mut self, now: Instant, observer: &mut AnyObserver<'_>) -> Result<(), Ended> {
        let watch = Watch::of(observer);
        while let Some(at) = self.next_instant().filter(|at| *at <= now) {
            if let Step::Ended(ending) = each!(&mut self.world, world => world.happen(at, observer, watch))? {
                self.end(ending);
            }
        }
        Ok(())
    }

    fn end(&mut self, ending: Ending) {
        self.ended = Some(ending);
        each!(&mut self.world, world => world.let_go(world.now()));
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
