//! The session: a [`LiveScene`] driven by the wall clock, and the socket to other programs, whose datagrams pass an
//! [`AdmissionControl`](crate::AdmissionControl).
//!
//! One thread does all work with a deadline. The thread sleeps until a deadline is due, or until a datagram arrives that may have to be sent on to another
//! program. The scene gets a logical instant with each event: the deadline itself, or the instant at which the kernel received the datagram. Files, live
//! control and the terminal have threads of their own.

mod config;
mod driven;
mod files;
mod motion;
mod outside;
mod recording;
mod rows;
mod status;
mod watch;

use std::ops::ControlFlow;
use std::time::Duration;

use cohaptic_device::Device;
use cohaptic_harness::live::LiveScene;
use cohaptic_realtime::{Clock as _, Driven as _, MonotonicClock, Schedule, drive, prepare_thread};
use cohaptic_scene::{LinkKeys, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use crate::OtherScene;

use motion::EndedPackets;
use outside::Outside;
use recording::{Recording, Stopped};
use watch::Watch;

pub(crate) use files::write_lateness;
pub(crate) use rows::TickCopy;

pub use config::{Recorded, SessionConfig, SessionError};
pub use motion::{EndedPacket, Motion};
pub use status::{Connection, LinkStatus, PeerStatus, Report, SocketCounts, Status};

/// Conductor of a session: observes the session, changes links, and ends the session. The session calls the conductor on the thread with the deadlines, so the
/// methods must neither wait nor take long.
pub trait Conductor {
    /// Returns whether the session goes on. Called about 50 times a second.
    fn keep_going(&mut self) -> bool;

    /// Returns the next change of a link, or `None` if no change is pending. Called until `None`, about 50 times a second.
    fn next_change(&mut self) -> Option<LinkChange>;

    /// Takes a snapshot of the session. Called about 17 times a second and once at the end, if [`Conductor::wants_status`].
    fn show(&mut self, status: Status);

    /// Takes a peer that asked with the fingerprint of another scene. Called at a look after such a hello, once for each different peer, address or fingerprint
    /// in a row.
    fn notice_other_scene(&mut self, _other: OtherScene) {}

    /// Returns whether [`Conductor::show`] is to be called. The answer must not change during the session.
    fn wants_status(&self) -> bool {
        true
    }

    /// Takes the motion of peers and packets. Called about 50 times a second and once at the end, if [`Conductor::wants_motion`].
    fn show_motion(&mut self, _motion: Motion) {}

    /// Returns whether [`Conductor::show_motion`] is to be called. The answer must not change during the session.
    fn wants_motion(&self) -> bool {
        false
    }
}

/// Change of a directed link, effective from the instant at which the session takes the change.
#[derive(Clone, Debug)]
pub struct LinkChange {
    /// Sender, as index of a peer in the scene.
    pub from: usize,
    /// Receiver, as index of a peer in the scene.
    pub to: usize,
    /// All keys of the link after the change, for the record.
    pub keys: LinkKeys,
    /// Model of the link made from `keys`.
    pub model: LinkModel,
}

/// Session ready to begin: the socket is bound and the files of the record are created.
#[derive(Debug)]
pub struct Session {
    live: LiveScene,
    /// Socket and admission. `None` in a scene without peers in other programs.
    outside: Option<Outside>,
    watch: Watch,
    config: SessionConfig,
    /// Number of peers of the scene.
    peers: usize,
    /// Clock of the run. Restarted when the run begins.
    clock: MonotonicClock,
    /// `true` if writing the record has failed.
    is_stopped: bool,
    /// Peer of another scene that the conductor was told last.
    told: Option<OtherScene>,
}

/// Time between two calls of [`Session::look`].
const LOOK: Duration = Duration::from_millis(20);
/// Number of looks per status. Making a status reads all links, so a status is made less often than a look.
const SHOW_EVERY: u32 = 3;

impl Session {
    /// Binds the socket, creates the files of the record, and makes the scene. `devices` returns the device of a peer of kind `falcon`, `inverse3` or
    /// `pointer`, given the index of the peer. A peer for which `devices` returns `None` counts as absent throughout.
    ///
    /// # Errors
    ///
    /// [`SessionError`] if the socket cannot be bound or would be open to strangers, if the admission control cannot be made, or if a file cannot be created.
    ///
    /// # Panics
    ///
    /// If the scene is [`cohaptic_harness::too_large`].
    pub fn open(scene: &Scene, config: SessionConfig, devices: impl FnMut(usize) -> Option<Box<dyn Device>>) -> Result<Self, SessionError> {
        let outside = Outside::open(scene, &config)?;
        let recording = config.out.as_deref().map(|folder| Recording::create(folder, scene, config.content.clone(), config.recorded)).transpose()?;
        let peers = scene.peers.len();
        let (live, watch, clock) = (LiveScene::new(scene, devices), Watch::new(scene, recording), MonotonicClock::start());
        Ok(Self { live, outside, watch, config, peers, clock, is_stopped: false, told: None })
    }

    /// Returns the local address of the socket. `None` in a scene without peers in other programs.
    #[must_use]
    pub fn address(&self) -> Option<std::net::SocketAddr> {
        self.outside.as_ref().map(Outside::address)
    }

    /// Runs the session on the calling thread until the scene ends or diverges, or until the conductor ends the session. Time begins with this call.
    ///
    /// The calling thread asks the system for the configured wishes, and keeps the granted wishes after the run. Give the session a thread of its own.
    ///
    /// # Errors
    ///
    /// [`SessionError`] if the system does not let the loop wait or receive, or if the record cannot be written. Rows recorded before the error are kept as
    /// far as possible.
    pub fn run(mut self, conductor: &mut impl Conductor) -> Result<Report, SessionError> {
        let prepared = prepare_thread(&self.config.wishes);
        self.clock = MonotonicClock::start();
        let driven = self.conduct(conductor);
        // `open` is the instant up to which logical time has passed. Nothing moves logical time after the loop.
        let behind = self.clock.now().saturating_duration_since(self.live.open());
        let summary = self.live.summary();
        // The record is finished before `driven` is looked at: after an error of the loop, the rows recorded so far are kept.
        let (files, pictures) = match self.watch.take_recording() {
            Some(recording) => recording.finish(&summary, &self.watch.ticks, &self.watch.releases)?,
            None => Default::default(),
        };
        driven?;
        Ok(Report {
            ticks: self.watch.ticks.summary(),
            late_ticks: self.watch.ticks.count_later_than(self.config.tolerance.limit),
            releases: self.watch.releases.summary(),
            validity: self.validity(),
            behind,
            seats: (0..self.peers).map(|peer| self.live.seat_stats(peer)).collect(),
            gates: (0..self.peers).map(|peer| self.live.gate_stats(peer)).collect(),
            admission: self.outside.as_ref().map(Outside::counts),
            other_scene: self.outside.as_ref().and_then(Outside::other_scene),
            connections: (0..self.peers).map(|peer| self.connection(peer)).collect(),
            prepared,
            files,
            pictures,
            measures: self.watch.measured(summary.duration),
            task: self.watch.task(&summary),
            summary,
        })
    }

    /// Drives the session to its end, and then shows the final state to the conductor. Not generic, so that the loop is compiled once, in this crate.
    fn conduct(&mut self, conductor: &mut dyn Conductor) -> Result<(), SessionError> {
        self.watch.is_shown = conductor.wants_status();
        self.watch.ended = conductor.wants_motion().then(Default::default);
        let (schedule, mut looks) = (Schedule { pacing: self.config.pacing, end: None, look_every: LOOK }, 0_u32);
        drive(self, &schedule, |session, now| {
            looks = looks.wrapping_add(1);
            let looked = session.look(conductor, now, looks.is_multiple_of(SHOW_EVERY));
            session.note(looked);
            if session.is_over() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        if self.is_stopped {
            // The writer of the record has failed. `Recording::finish` returns the writer's error.
            return Ok(());
        }
        if conductor.wants_status() {
            conductor.show(self.status());
        }
        if conductor.wants_motion() {
            conductor.show_motion(self.motion());
        }
        Ok(())
    }

    /// Remembers that the writer of the record has failed.
    fn note(&mut self, outcome: Result<(), Stopped>) {
        self.is_stopped |= outcome.is_err();
    }

    /// Applies the conductor's changes, ends the scene if the conductor says so, and shows the state: the motion at each look, the status if `show`.
    fn look(&mut self, conductor: &mut dyn Conductor, now: Instant, show: bool) -> Result<(), Stopped> {
        // Changes come before the question whether to go on, so that a change made just before the end is in the record.
        while let Some(LinkChange { from, to, keys, model }) = conductor.next_change() {
            self.live.set_link(now, (from, to), &keys, &model, &mut self.watch)?;
        }
        let other = self.outside.as_ref().and_then(Outside::other_scene);
        if let Some(other) = other.filter(|_| other != self.told) {
            self.told = Some(other);
            conductor.notice_other_scene(other);
        }
        // `stop` handles everything due until `now` first. Afterwards there is no deadline, and `is_over` ends the loop.
        if !conductor.keep_going() {
            self.live.set_clock(now);
            self.live.stop(now, &mut self.watch)?;
            return Ok(());
        }
        if show && conductor.wants_status() {
            conductor.show(self.status());
        }
        if conductor.wants_motion() {
            conductor.show_motion(self.motion());
        }
        Ok(())
    }

    /// Judges ticks and releases together against the tolerance.
    fn validity(&self) -> cohaptic_realtime::Validity {
        // A histogram can be merged only into another histogram, and both are still needed alone.
        let mut all = self.watch.ticks.clone();
        all.merge(&self.watch.releases);
        // Ticks are the ticks of the peers simulated here, and of Falcons; only peers in other programs are sent datagrams.
        let what = if self.watch.releases.count() > 0 { "ticks and datagrams" } else { "ticks" };
        self.config.tolerance.judge(&all, what)
    }

    fn peers(&self) -> Vec<PeerStatus> {
        let peer = |place| {
            let state = self.live.peer(place)?;
            Some(PeerStatus { state, force: self.watch.forces[place], seat: self.live.seat_stats(place), connection: self.connection(place) })
        };
        (0..self.peers).filter_map(peer).collect()
    }

    fn connection(&self, peer: usize) -> Option<Connection> {
        self.outside.as_ref().and_then(|outside| outside.connection(self.live.open(), peer))
    }

    fn motion(&mut self) -> Motion {
        let packets = self.watch.ended.as_mut().map(EndedPackets::take).unwrap_or_default();
        let now = self.live.open();
        Motion { elapsed: now.saturating_duration_since(Instant::ZERO), peers: self.peers(), task: self.watch.task_view(now), packets }
    }

    fn status(&self) -> Status {
        let places = 0..self.peers;
        let pairs = places.clone().flat_map(|from| places.clone().map(move |to| (from, to))).filter(|(from, to)| from != to);
        // `links` is a square matrix in rows, as in `Watch`: the row is the sender, the column the receiver.
        let link = |(from, to): (usize, usize)| {
            let carried = &self.watch.links[from * self.peers + to];
            let stats = self.live.link_stats(from, to)?;
            Some(LinkStatus { from, to, stats, delivered_bytes: carried.bytes, recent: carried.recent().to_vec() })
        };
        let elapsed = self.live.open().saturating_duration_since(Instant::ZERO);
        Status {
            elapsed,
            measures: self.watch.measured(elapsed),
            ticks: self.watch.ticks.summary(),
            releases: self.watch.releases.summary(),
            validity: self.validity(),
            peers: self.peers(),
            links: pairs.filter_map(link).collect(),
            admission: self.outside.as_ref().map(|outside| *outside.admission_stats()),
            other_scene: self.outside.as_ref().and_then(Outside::other_scene),
        }
    }
}
