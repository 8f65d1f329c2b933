//! The relay in real time: one thread, in the loop of [`cohaptic_realtime::drive()`].

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

/// Why there is no relay, or why it stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RelayError {
    /// There is no such relay.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A port could not be had.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The system refused to wait or to read.
    #[error("the relay cannot go on: {0}")]
    System(#[from] io::Error),
}

/// How to run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// How to wait for the next release.
    pub pacing: Pacing,
    /// What the thread asks of the system.
    pub wishes: Wishes,
    /// How late releases may be for the run to be valid.
    pub tolerance: Tolerance,
    /// When to end by itself.
    pub duration: Option<Duration>,
    /// How often it is looked at.
    pub look_every: Duration,
}

impl Default for RunOptions {
    /// Sleeping, with priority and locked memory if the system grants them, 1 ms, until it is stopped, looked at 20 times a second.
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

/// What may be said to a relay while it runs.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Control {
    /// A link becomes another one, from when it is heard on.
    SetLink {
        /// Its sender.
        from: NodeId,
        /// Its receiver.
        to: NodeId,
        /// What it becomes.
        model: Box<LinkModel>,
    },
}

/// A relay whose ports are open: what comes to them waits until it runs.
#[derive(Debug)]
pub struct Relay {
    engine: Engine,
    ports: Ports,
    release: Lateness,
    refused_changes: u64,
}

impl Relay {
    /// Opens the ports.
    ///
    /// # Errors
    ///
    /// [`RelayError`] if there is no such relay, if it would send to a port of its own, or if a port cannot be had.
    pub fn bind(config: RelayConfig, port: EndpointConfig) -> Result<Self, RelayError> {
        // Before the ports are opened, because a program that has the port already would hide the fault; after it for a port that the system chose.
        config.check_targets(&config.ports())?;
        let ports = Ports::open(&config, port)?;
        config.check_targets(&ports.addresses().map(|(_, address)| address).collect::<Vec<_>>())?;
        Ok(Self { engine: Engine::new(config)?, ports, release: Lateness::new(), refused_changes: 0 })
    }

    /// Where it listens: each program's name and the port that stands for it; of a proxy, `listen`.
    pub fn ports(&self) -> impl Iterator<Item = (&str, SocketAddr)> {
        self.ports.addresses()
    }

    /// Runs once, in this thread, until `stop` is set (which is looked at as often as `look` is called), or until its end. `control` is looked at without
    /// waiting; `look` is called from time to time and once at the end, and what it takes makes releases late.
    ///
    /// The sockets stay open until the relay is dropped: to close those of hundreds of clients can take longer than to make the report.
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
        let prepared = prepare_thread(&options.wishes);
        let clock = MonotonicClock::start();
        let end = options.duration.map(|duration| Instant::ZERO.saturating_add(duration));
        let schedule = Schedule { pacing: options.pacing, end, look_every: options.look_every };
        drive(&mut Running { relay: self, control, clock }, &schedule, |Running { relay, .. }, now| {
            look(&relay.view(now));
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let now = clock.now();
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
            validity: options.tolerance.judge(&self.release),
            release: self.release.clone(),
        })
    }

    const fn view(&self, now: Instant) -> View<'_> {
        View { now, engine: &self.engine, release: &self.release }
    }
}

/// A relay in the middle of its run.
struct Running<'a> {
    relay: &'a mut Relay,
    control: &'a Receiver<Control>,
    clock: MonotonicClock,
}

/// The kernel is offered again what it did not take, after this time.
const AGAIN: Duration = Duration::from_micros(500);

impl Driven for Running<'_> {
    type Clock = MonotonicClock;
    type Error = io::Error;

    /// To make a release ready takes less than a microsecond once the processor has it at hand. What comes in meanwhile is offered late.
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
        ports.follow_clients(engine);
        Ok(received)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let again = self.relay.ports.has_waiting().then(|| self.clock.now() + AGAIN);
        self.relay.engine.poll_timeout().into_iter().chain(again).min()
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        let Relay { engine, ports, refused_changes, .. } = &mut *self.relay;
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
