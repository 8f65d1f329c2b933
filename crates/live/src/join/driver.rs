//! A joined peer by the wall clock: the loop of [`cohaptic_realtime::drive()`] around a [`JoinedPeer`], with the socket to the session.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::ops::ControlFlow;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_harness::live::GateStats;
use cohaptic_harness::record::RecordError;
use cohaptic_realtime::udp::{self, BindError, EndpointCounts, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{
    Clock as _, Driven, Lateness, LatenessSummary, MonotonicClock, Pacing, Prepared, Received, Schedule, Tolerance, Validity, Wishes, drive,
    prepare_thread,
};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::fitness::check;
use super::recording::Recording;
use super::{HeardSender, JoinedConfig, JoinedPeer, JoinedStatus, Mismatch, SeatTaken, Unfit};
use crate::{EntropyError, SystemEntropy};

/// Configuration of a joined peer by the wall clock.
#[derive(Clone, Debug)]
pub struct JoinConfig {
    /// Address of the session.
    pub session: SocketAddr,
    /// Key, fingerprint and label for the session.
    pub joined: JoinedConfig,
    /// `true` if a peer without a key may join a session at another computer.
    pub allow_remote: bool,
    /// Way of waiting for deadlines.
    pub pacing: Pacing,
    /// Requests to the system for the thread of the peer.
    pub wishes: Wishes,
    /// Largest lateness of ticks in a valid run.
    pub tolerance: Tolerance,
    /// Folder of the record; `None` if nothing is recorded.
    pub out: Option<PathBuf>,
    /// Time from tick 0 to the end. Before a welcome, the time counts from the beginning of the run. `None`: the run ends when the caller ends the run.
    pub length: Option<Duration>,
}

/// Reason why a peer cannot join, or cannot go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JoinError {
    /// Without a key the session at another computer could be anybody, and [`JoinConfig::allow_remote`] is not set.
    #[error(
        "whoever answers at {address} could pull at the device: expected a session key (--key-file), a session at this computer such as 127.0.0.1:7400, or \
         --allow-remote if every computer of the network may"
    )]
    NotLoopback {
        /// Address of the session.
        address: SocketAddr,
    },
    /// The peer of the scene cannot be computed at another computer.
    #[error(transparent)]
    Unfit(#[from] Unfit),
    /// The socket cannot be bound.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The session differs from the scene.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// Another program has the seat, and keeps the seat.
    #[error(transparent)]
    SeatTaken(#[from] SeatTaken),
    /// The record cannot be created or written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The system has no random bytes.
    #[error(transparent)]
    Entropy(#[from] EntropyError),
    /// The system does not let the loop wait, or refuses to receive.
    #[error("the peer cannot go on: {0}")]
    System(#[from] io::Error),
}

/// Report of an ended run of a joined peer.
#[derive(Debug)]
pub struct JoinReport {
    /// Figures at the end.
    pub status: JoinedStatus,
    /// Samples heard, indexed by peer of the scene.
    pub senders: Vec<HeardSender>,
    /// Lateness of the ticks.
    pub ticks: LatenessSummary,
    /// Ticks later than the tolerance.
    pub late_ticks: u64,
    /// Verdict on the ticks.
    pub validity: Validity,
    /// Duration of reading and holding the device, per tick; `None` for a simulated device.
    pub device: Option<LatenessSummary>,
    /// Forces that the gate of the device changed or made zero; `None` for a simulated device.
    pub gate: Option<GateStats>,
    /// Counts of the socket.
    pub socket: EndpointCounts,
    /// Wishes granted and refused by the system.
    pub prepared: Prepared,
    /// Paths of the files of the record.
    pub files: Vec<PathBuf>,
}

/// Joined peer ready to begin: the socket is bound and the files of the record are created.
#[derive(Debug)]
pub struct Join {
    peer: JoinedPeer,
    socket: UdpEndpoint,
    buffers: ReceiveBuffers,
    /// `true` if the last reading filled a whole batch, so that more datagrams may wait in the kernel.
    is_more: bool,
    clock: MonotonicClock,
    config: JoinConfig,
    recording: Option<Recording>,
    ticks: Lateness,
    /// Instant at which the loop woke up for the present event. The lateness of a tick is counted up to this instant.
    woken: Instant,
    device: Option<CallTimes>,
    /// Reason for the end of the loop, found where the loop takes no error.
    ended: Option<EndedBy>,
}

/// Reason for the end of the loop.
#[derive(Debug)]
enum EndedBy {
    Entropy(EntropyError),
    /// The writer of the record has failed; the record has the error.
    Record,
}

/// Receive buffer of the socket \[byte\], as in a session.
const RECEIVE_BUFFER: usize = 1 << 20;
/// Length of the buffer for a received datagram \[byte\]: longer than the longest datagram of the protocol, because a shorter buffer would cut a datagram.
const LARGEST: usize = 2048;
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(20);

impl Join {
    /// Checks scene and address before a device is opened.
    ///
    /// # Errors
    ///
    /// [`JoinError::NotLoopback`] and [`JoinError::Unfit`], as [`Join::open`].
    pub fn check(scene: &Scene, place: usize, config: &JoinConfig) -> Result<(), JoinError> {
        let address = config.session;
        if !address.ip().to_canonical().is_loopback() && config.joined.key.is_none() && !config.allow_remote {
            return Err(JoinError::NotLoopback { address });
        }
        Ok(check(scene, place)?)
    }

    /// Binds a socket, creates the files of the record and makes the peer at `place` of `scene`, with `device` in place of a simulated device.
    ///
    /// # Errors
    ///
    /// [`JoinError`] if the session is at another computer and the configuration has no key, if the peer cannot be computed here, if the system gives no
    /// socket, or if a file cannot be created.
    pub fn open(scene: &Scene, place: usize, config: JoinConfig, device: Option<Box<dyn Device>>) -> Result<Self, JoinError> {
        Self::check(scene, place, &config)?;
        let address = config.session;
        let is_here = address.ip().to_canonical().is_loopback();
        // Bound to the loopback interface where the session is there: nothing else can then send to the socket.
        let own = match address {
            SocketAddr::V4(_) => SocketAddr::from((if is_here { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED }, 0)),
            SocketAddr::V6(_) => SocketAddr::from((if is_here { Ipv6Addr::LOCALHOST } else { Ipv6Addr::UNSPECIFIED }, 0)),
        };
        let clock = MonotonicClock::start();
        let (device, times) = device.map_or((None, None), |device| {
            let times = CallTimes::default();
            let timed: Box<dyn Device> = Box::new(Timed { device, times: times.clone(), clock, reading: None });
            (Some(timed), Some(times))
        });
        let peer = JoinedPeer::new(scene.clone(), place, config.joined.clone(), device)?;
        let endpoint = udp::EndpointConfig { receive_buffer: RECEIVE_BUFFER, largest: LARGEST, joined: false, ..udp::EndpointConfig::default() };
        let socket = UdpEndpoint::bind(own, endpoint)?;
        let recording = config.out.as_deref().map(|folder| Recording::create(folder, scene)).transpose()?;
        Ok(Self {
            peer,
            socket,
            buffers: ReceiveBuffers::new(),
            is_more: false,
            clock,
            config,
            recording,
            ticks: Lateness::new(),
            woken: Instant::ZERO,
            device: times,
            ended: None,
        })
    }

    /// Runs the peer on the calling thread until its length is over, or until `look` breaks. `look` is called about 50 times a second and must not wait.
    ///
    /// # Errors
    ///
    /// [`JoinError`] if the session differs from the scene, if another program keeps the seat, if the record cannot be written, or if the system does not let
    /// the loop wait or receive.
    pub fn run(self, mut look: impl FnMut(&JoinedStatus) -> ControlFlow<()>) -> Result<JoinReport, JoinError> {
        self.run_looked_at(&mut look)
    }

    /// The loop of [`Join::run`], compiled once here. With a generic closure, each program would compile the loop again, at its own level of optimisation.
    fn run_looked_at(mut self, look: &mut dyn FnMut(&JoinedStatus) -> ControlFlow<()>) -> Result<JoinReport, JoinError> {
        let prepared = prepare_thread(&self.config.wishes);
        let schedule = Schedule { pacing: self.config.pacing, end: None, look_every: LOOK };
        let driven = drive(&mut self, &schedule, |join, now| look(&join.peer.status(now)));
        // The force ends before anything that takes time.
        self.peer.stop();
        let status = self.peer.status(self.clock.now());
        let Self { peer, socket, config, recording, ticks, device, ended, .. } = self;
        // The record is finished before errors of the loop are looked at: the rows so far are kept.
        let files = recording.map(|recording| recording.finish(&ticks)).transpose()?.unwrap_or_default();
        driven?;
        if let Some(EndedBy::Entropy(error)) = ended {
            return Err(error.into());
        }
        if let Some(mismatch) = peer.mismatch() {
            return Err(mismatch.clone().into());
        }
        if let Some(taken) = peer.seat_taken() {
            return Err(taken.into());
        }
        Ok(JoinReport {
            status,
            senders: peer.senders().to_vec(),
            ticks: ticks.summary(),
            late_ticks: ticks.count_later_than(config.tolerance.limit),
            validity: config.tolerance.judge(&ticks, "ticks"),
            device: device.map(|times| times.summary()),
            gate: peer.gate_stats().copied(),
            socket: *socket.counts(),
            prepared,
            files,
        })
    }
}

impl Join {
    /// Returns the end of the run: the length after tick 0 or, before a welcome, after the beginning. `None` for a run without a length.
    fn end(&self) -> Option<Instant> {
        let began = self.peer.began().unwrap_or(Instant::ZERO);
        self.config.length.map(|length| began.saturating_add(length))
    }
}

impl Driven for Join {
    type Clock = MonotonicClock;
    type Error = JoinError;

    /// `None`: a tick reads the device, and must not read the device before its time.
    const AHEAD: Option<Duration> = None;
    /// `false`: a rest between two readings would make ticks late.
    const RESTS: bool = false;

    fn clock(&self) -> &MonotonicClock {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        // Between two ticks samples can wait in the kernel, because they count from their arrival there. The welcome is awaited: tick 0 is its arrival.
        let is_awaited = self.is_more || self.peer.next_tick().is_none();
        is_awaited.then(|| self.socket.as_fd())
    }

    fn receive(&mut self, now: Instant) -> Result<Received, JoinError> {
        self.woken = now;
        let Self { socket, buffers, clock, peer, config, is_more, .. } = self;
        let count = socket.receive(buffers, clock, |datagram| {
            if datagram.from == config.session {
                peer.handle_datagram(datagram.at, datagram.bytes);
            }
        })?;
        // A batch with room left has emptied the socket.
        *is_more = count == UdpEndpoint::BATCH;
        Ok(Received { count, until: now })
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let due = self.peer.poll_timeout();
        Some(self.end().map_or(due, |end| due.min(end)))
    }

    /// Handles one deadline, so that datagrams from before the following deadline are read first.
    fn handle_timeout(&mut self, now: Instant) -> bool {
        // The tick at the end itself is not made, as in a session.
        if self.end().is_some_and(|end| self.peer.next_tick().is_some_and(|tick| tick >= end)) {
            return false;
        }
        let Self { peer, recording, ticks, woken, ended, .. } = self;
        let handled = peer.handle_timeout(now, &mut SystemEntropy, &mut |due, row| {
            ticks.record(woken.saturating_duration_since(due));
            if recording.as_ref().is_some_and(|recording| !recording.tick(row)) {
                *ended = Some(EndedBy::Record);
            }
        });
        if let Err(error) = handled {
            *ended = Some(EndedBy::Entropy(error));
        }
        false
    }

    fn send(&mut self) -> u64 {
        let mut count = 0;
        while let Some(outgoing) = self.peer.poll_transmit() {
            self.socket.queue(self.config.session, outgoing.bytes(), None);
            count += 1;
        }
        if count > 0 || self.socket.has_waiting() {
            self.socket.flush();
        }
        count
    }

    fn is_over(&self) -> bool {
        self.end().is_some_and(|end| self.clock.now() >= end)
            || self.ended.is_some()
            || self.peer.mismatch().is_some()
            || self.peer.seat_taken().is_some()
    }
}

/// Durations of the calls of a device, shared with the device in the peer.
#[derive(Clone, Debug, Default)]
struct CallTimes(Arc<Mutex<Lateness>>);

impl CallTimes {
    fn record(&self, span: Duration) {
        // Only the thread of the peer takes the lock while the peer runs, so that the lock never waits.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).record(span);
    }

    fn summary(&self) -> LatenessSummary {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).summary()
    }
}

/// Device with timed calls. The state machine of the peer knows no clock, so that the driver wraps the device.
struct Timed {
    device: Box<dyn Device>,
    times: CallTimes,
    clock: MonotonicClock,
    /// Duration of the reading at the present tick; `None` once the force of the tick is held, so that the zero force of a stop counts as no tick.
    reading: Option<Duration>,
}

impl Device for Timed {
    fn description(&self) -> Description {
        self.device.description()
    }

    fn stopper(&self) -> Stopper {
        self.device.stopper()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        let begin = self.clock.now();
        let state = self.device.read(now);
        self.reading = Some(self.clock.now().saturating_duration_since(begin));
        state
    }

    fn hold(&mut self, now: Instant, span: Duration, force: GatedForce) {
        let begin = self.clock.now();
        self.device.hold(now, span, force);
        if let Some(reading) = self.reading.take() {
            self.times.record(reading + self.clock.now().saturating_duration_since(begin));
        }
    }

    fn stop(&mut self) {
        self.device.stop();
    }
}

#[cfg(test)]
mod tests;
