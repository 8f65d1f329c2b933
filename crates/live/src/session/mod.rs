//! The session itself: a [`LiveScene`] driven by the wall clock, with a socket behind its [`AdmissionControl`](crate::AdmissionControl).
//!
//! One thread does everything that has to be on time. It sleeps until something is due or a datagram comes in that may be for another program, and tells the
//! scene the logical instant of either: that at which it was due, or that at which the kernel saw it. Files, live control and the terminal have threads of their own.

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

use cohaptic_harness::live::{LiveDevice, LiveScene};
use cohaptic_realtime::{Clock as _, Driven as _, MonotonicClock, Schedule, drive, prepare_thread};
use cohaptic_scene::{LinkKeys, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use motion::EndedPackets;
use outside::Outside;
use recording::{Recording, Stopped};
use watch::Watch;

pub use config::{Recorded, SessionConfig, SessionError};
pub use motion::{EndedPacket, Motion};
pub use status::{LinkStatus, PeerStatus, Report, SocketCounts, Status};

/// The conductor of a session: looks on while it runs, changes links, and ends it. Called on the thread that has to be on time: calls must neither wait nor take long.
pub trait Conductor {
    /// Whether to go on. Asked at least 50 times a second.
    fn keep_going(&mut self) -> bool;

    /// The next change of a link, if somebody wants one.
    fn next_change(&mut self) -> Option<LinkChange>;

    /// The session as it stands, about 20 times a second, if [`Conductor::wants_status`].
    fn show(&mut self, status: Status);

    /// Whether anybody looks on. The answer must stay.
    fn wants_status(&self) -> bool {
        true
    }

    /// What moves, about 50 times a second, and at the end, if [`Conductor::wants_motion`].
    fn show_motion(&mut self, _motion: Motion) {}

    /// Whether anybody looks on so closely. The answer must stay.
    fn wants_motion(&self) -> bool {
        false
    }
}

/// A link from now on.
#[derive(Clone, Debug)]
pub struct LinkChange {
    /// The sender's place in the scene.
    pub from: usize,
    /// The receiver's place in the scene.
    pub to: usize,
    /// All its keys.
    pub keys: LinkKeys,
    /// The model that they make.
    pub model: LinkModel,
}

/// A session that is ready to begin: its socket is open and its files are made.
#[derive(Debug)]
pub struct Session {
    live: LiveScene,
    outside: Option<Outside>,
    watch: Watch,
    config: SessionConfig,
    peers: usize,
    /// The clock of the run, which begins with the run.
    clock: MonotonicClock,
    /// Whether the record can no longer be written.
    is_stopped: bool,
}

/// So often the conductor is asked, and shown the session.
const LOOK: Duration = Duration::from_millis(20);
const SHOW_EVERY: u32 = 3;

impl Session {
    /// Opens what the session needs. `devices` gives the device of each peer of kind `falcon`, by its place; `None` is one that is never there.
    ///
    /// # Errors
    ///
    /// [`SessionError`] if the socket cannot be had or may not be, or a file cannot be made.
    ///
    /// # Panics
    ///
    /// If the scene is [`cohaptic_harness::too_large`].
    pub fn open(scene: &Scene, config: SessionConfig, devices: impl FnMut(usize) -> Option<Box<dyn LiveDevice>>) -> Result<Self, SessionError> {
        let outside = Outside::open(scene, &config)?;
        let recording = config.out.as_deref().map(|folder| Recording::create(folder, scene, config.content.clone(), config.recorded)).transpose()?;
        let peers = scene.peers.len();
        let (live, watch, clock) = (LiveScene::new(scene, devices), Watch::new(scene, recording), MonotonicClock::start());
        Ok(Self { live, outside, watch, config, peers, clock, is_stopped: false })
    }

    /// Where the session listens; `None` in a scene without peers in other programs.
    #[must_use]
    pub fn address(&self) -> Option<std::net::SocketAddr> {
        self.outside.as_ref().map(Outside::address)
    }

    /// Runs the session on the calling thread until the scene ends, diverges, or the conductor ends it. Time begins with this call.
    ///
    /// The thread asks the system for what the configuration wishes, and keeps what it is granted: give it one of its own.
    ///
    /// # Errors
    ///
    /// [`SessionError`] if the system does not let it go on, or the record cannot be written. What was recorded until then is kept as far as it can be.
    pub fn run(mut self, conductor: &mut impl Conductor) -> Result<Report, SessionError> {
        let prepared = prepare_thread(&self.config.wishes);
        self.clock = MonotonicClock::start();
        let driven = self.conduct(conductor);
        let behind = self.clock.now().saturating_duration_since(self.live.open());
        let summary = self.live.summary();
        let files = match self.watch.take_recording() {
            Some(recording) => recording.finish(&summary, &self.watch.ticks, &self.watch.releases)?,
            None => Vec::new(),
        };
        driven?;
        Ok(Report {
            ticks: self.watch.ticks.summary(),
            late_ticks: self.watch.ticks.count_later_than(self.config.tolerance.limit),
            releases: self.watch.releases.summary(),
            validity: self.validity(),
            behind,
            seats: (0..self.peers).map(|peer| self.live.seat_stats(peer)).collect(),
            admission: self.outside.as_ref().map(Outside::counts),
            prepared,
            files,
            measures: self.watch.measured(summary.duration),
            summary,
        })
    }

    fn conduct(&mut self, conductor: &mut impl Conductor) -> Result<(), SessionError> {
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
            // The record cannot be written: its end says why.
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

    fn note(&mut self, outcome: Result<(), Stopped>) {
        self.is_stopped |= outcome.is_err();
    }

    fn look(&mut self, conductor: &mut impl Conductor, now: Instant, show: bool) -> Result<(), Stopped> {
        while let Some(LinkChange { from, to, keys, model }) = conductor.next_change() {
            self.live.set_link(now, (from, to), &keys, &model, &mut self.watch)?;
        }
        if !conductor.keep_going() {
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

    fn validity(&self) -> cohaptic_realtime::Validity {
        let mut all = self.watch.ticks.clone();
        all.merge(&self.watch.releases);
        self.config.tolerance.judge(&all)
    }

    fn peers(&self) -> Vec<PeerStatus> {
        let peer = |place| {
            let state = self.live.peer(place)?;
            Some(PeerStatus { state, force: self.watch.forces[place], seat: self.live.seat_stats(place) })
        };
        (0..self.peers).filter_map(peer).collect()
    }

    fn motion(&mut self) -> Motion {
        let packets = self.watch.ended.as_mut().map(EndedPackets::take).unwrap_or_default();
        Motion { elapsed: self.live.open().saturating_duration_since(Instant::ZERO), peers: self.peers(), packets }
    }

    fn status(&self) -> Status {
        let places = 0..self.peers;
        let pairs = places.clone().flat_map(|from| places.clone().map(move |to| (from, to))).filter(|(from, to)| from != to);
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
        }
    }
}
