//! The relay in real time: sockets and a clock around the engine, on one thread, in the loop of [`cohaptic_realtime::drive()`].

mod ports;
mod report;

use core::ops::ControlFlow;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::os::fd::BorrowedFd;
use std::sync::mpsc::Receiver;

use cohaptic_realtime::udp::{BindError, EndpointConfig};
use cohaptic_realtime::{Clock as _, Driven, Lateness, MonotonicClock, Pacing, Received, Schedule, Tolerance, Wishes, drive, prepare_thread};
use cohaptic_units::Instant;
use cohaptic_wan::{LinkModel, NodeId};

use crate::config::{ConfigError, RelayConfig};
use crate::engine::Engine;
use ports::Ports;

pub use report::{LinkReport, PortReport, Report, View};

/// Reason why a relay could not start, or why a relay stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RelayError {
    /// The configuration is refused.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A port could not be opened.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The system refused to wait or to read.
    #[error("the relay cannot go on: {0}")]
    System(#[from] io::Error),
}

/// Options of a run without effect on the fates of datagrams.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Way to wait for the next release.
    pub pacing: Pacing,
    /// Requests of the thread to the system, such as a real-time priority.
    pub wishes: Wishes,
    /// Lateness of releases up to which the run is valid.
    pub tolerance: Tolerance,
    /// Length of the run, from the call of [`Relay::run`]; `None`: the run lasts until it is stopped.
    pub duration: Option<Duration>,
    /// Time between two calls of `look`.
    pub look_every: Duration,
}

impl Default for RunOptions {
    /// Returns: sleeping; priority and locked memory if the system grants them; 1 ms of tolerance; no end; 20 looks per second.
    fn default() -> Self {
        Self {
            pacing: Pacing::Sleep,
            wishes: Wishes::default(),
            tolerance: Tolerance { limit: Duration::from_millis(1) },
            duration: None,
            look_every: Duration::from_millis(50),
        }
    }
}

/// Message to a running relay.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Control {
    /// Changes the model of a link, from the instant at which the relay reads the message.
    SetLink {
        /// Sending node of the link.
        from: NodeId,
        /// Receiving node of the link.
        to: NodeId,
        /// New model of the link.
        model: Box<LinkModel>,
    },
}

/// Relay with open ports. Datagrams that arrive before [`Relay::run`] wait in the kernel.
#[derive(Debug)]
pub struct Relay {
    engine: Engine,
    ports: Ports,
    /// Release error of every datagram handed to the kernel.
    release: Lateness,
    /// Messages that named a link outside of the network.
    refused_changes: u64,
}

impl Relay {
    /// Opens the ports.
    ///
    /// # Errors
    ///
    /// [`RelayError`] if the configuration is refused, if the relay would send to a port of its own, or if a port cannot be opened.
    pub fn bind(config: RelayConfig, port: EndpointConfig) -> Result<Self, RelayError> {
        // Checked twice. Before the ports are opened, because another program that holds the port would hide the fault behind an error of `bind`; afterwards,
        // because port numbers chosen by the system are known only then.
        config.check_targets(&config.ports())?;
        let ports = Ports::open(&config, port)?;
        config.check_targets(&ports.addresses().map(|(_, address)| address).collect::<Vec<_>>())?;
        Ok(Self { engine: Engine::new(config)?, ports, release: Lateness::new(), refused_changes: 0 })
    }

    /// Returns the name of each program with the relay's address for the program; for a proxy, `listen` with the listening address.
    pub fn ports(&self) -> impl Iterator<Item = (&str, SocketAddr)> {
        self.ports.addresses()
    }

    /// Runs the relay once, on the calling thread, until `stop` is set or until the end of `options.duration`. `stop` is read after each call of `look`.
    /// Messages in `control` are read without waiting. `look` is called about every `options.look_every` and once at the end; the time spent in `look` makes
    /// releases late.
    ///
    /// The sockets stay open until the relay is dropped: closing the sockets of hundreds of clients can take longer than making the report.
    ///
    /// # Errors
    ///
    /// [`RelayError::System`] if the system refuses to wait or to read.
    pub fn run(
        &mut self,
        options: &RunOptions,
        control: &Receiver<Control>,
        stop: &AtomicBool,
        mut look: impl FnMut(&View<'_>),
    ) -> Result<Report, RelayError> {
        self.run_looked_at(options, control, stop, &mut look)
    }

    /// The loop of [`Relay::run`], compiled once here. With a generic closure, each program would compile the loop again, at its own level of optimisation.
    fn run_looked_at(
        &mut self,
        options: &RunOptions,
        control: &Receiver<Control>,
        stop: &AtomicBool,
        look: &mut dyn FnMut(&View<'_>),
    ) -> Result<Report, RelayError> {
        let prepared = prepare_thread(&options.wishes);
        let clock = MonotonicClock::start();
        let end = options.duration.map(|duration| Instant::ZERO.saturating_add(duration));
        let schedule = Schedule { pacing: options.pacing, end, look_every: options.look_every };
        drive(&mut Running { relay: self, control, clock }, &schedule, |Running { relay, .. }, now| {
            look(&relay.view(now));
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let now = clock.now();
        // The loop may end between two looks, by `options.duration`: the last look shows the state of the report.
        look(&self.view(now));
        Ok(Report {
            elapsed: now.saturating_duration_since(Instant::ZERO),
            prepared,
            links: report::links(&self.engine),
            ports: self.ports.report(),
            intake: *self.engine.counts(),
            clamped: self.engine.clamped().clone(),
            held: self.engine.held(),
            without_socket: self.ports.without_socket(),
            refused_changes: self.refused_changes,
            validity: options.tolerance.judge(&self.release, "datagrams"),
            release: self.release.clone(),
        })
    }

    /// Returns the state for a look.
    const fn view(&self, now: Instant) -> View<'_> {
        View { now, engine: &self.engine, release: &self.release }
    }
}

/// Relay during its run, with the channel of its user and the clock of the run.
struct Running<'a> {
    relay: &'a mut Relay,
    control: &'a Receiver<Control>,
    clock: MonotonicClock,
}

/// Delay until the kernel is offered again a datagram for which the send buffer of a socket had no room.
const AGAIN: Duration = Duration::from_micros(500);

impl Driven for Running<'_> {
    type Clock = MonotonicClock;
    type Error = io::Error;

    /// A little longer than the making of a release takes. A datagram that arrives in the last 3 µs before a release is read after the release, and so is
    /// offered late.
    const AHEAD: Option<Duration> = Some(Duration::from_micros(3));
    const RESTS: bool = true;

    fn clock(&self) -> &MonotonicClock {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        [self.relay.ports.readable()]
    }

    fn receive(&mut self, now: Instant) -> io::Result<Received> {
        let Relay { engine, ports, .. } = &mut *self.relay;
        let received = ports.receive(engine, &self.clock, now)?;
        // Sockets of new clients are opened before releases are taken from the engine, because a release names the client's port.
        ports.follow_clients(engine);
        Ok(received)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        // The send buffer of a socket announces no room to this loop, so the loop tries again after a while.
        let again = self.relay.ports.has_waiting().then(|| self.clock.now() + AGAIN);
        self.relay.engine.poll_timeout().into_iter().chain(again).min()
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        let Relay { engine, ports, refused_changes, .. } = &mut *self.relay;
        // Messages take effect before the releases of this round.
        while let Ok(Control::SetLink { from, to, model }) = self.control.try_recv() {
            *refused_changes += u64::from(engine.set_link(now, from, to, *model).is_err());
        }
        engine.handle_timeout(now);
        ports.take_releases(engine)
    }

    fn send(&mut self) -> u64 {
        let Relay { ports, release, .. } = &mut *self.relay;
        let before = release.count();
        ports.send(&self.clock, release);
        release.count() - before
    }
}
