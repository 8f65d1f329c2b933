//! The relay of TCP in real time: sockets and a clock around the engine, on one thread.
//!
//! The loop of [`cohaptic_realtime`] needs descriptors of Linux. This loop waits by mio, which has the readiness of every system. The longest part of a wait is
//! a wait of mio, whose resolution is a millisecond. In the last two milliseconds before a deadline the thread sleeps for at most [`REST`] at a time and asks
//! mio without waiting in between.

mod report;
mod sockets;

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant as Clock};

use cohaptic_linkfile::stream::StreamConfig;
use cohaptic_realtime::{Lateness, Tolerance};
use cohaptic_units::Instant;

use crate::config::StreamsConfig;
use crate::engine::{Engine, Event};
use sockets::Sockets;

pub use report::{LineReport, ProxyReport, Report, View};

/// Longest sleep before a deadline, during which arriving bytes wait (see the module).
const REST: Duration = Duration::from_micros(100);

/// Distance to a deadline from which on the thread sleeps in pieces of [`REST`]: twice the resolution of the waits of mio.
const NEAR: Duration = Duration::from_millis(2);

/// Reason why a relay could not start, or why a relay stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StreamsError {
    /// An address could not be listened at.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// Address for clients.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// A proxy would connect to a listening address of the relay, and every connection would make a further connection, without end.
    #[error("{to} is an address of the relay itself: expected the address of a program")]
    ToItself {
        /// Address of the program.
        to: SocketAddr,
    },
    /// The system refused to wait.
    #[error("the relay cannot go on: {0}")]
    System(#[from] io::Error),
}

/// Options of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Lateness of writes up to which the run is valid.
    pub tolerance: Tolerance,
    /// Length of the run; `None`: the run lasts until it is stopped.
    pub duration: Option<Duration>,
    /// Time between two calls of `look`.
    pub look_every: Duration,
}

impl Default for RunOptions {
    /// Returns: 1 ms of tolerance; no end; 20 looks per second.
    fn default() -> Self {
        Self { tolerance: Tolerance { limit: Duration::from_millis(1) }, duration: None, look_every: Duration::from_millis(50) }
    }
}

/// Message to a running relay: a change of one line, and of the faults of connections to come.
#[derive(Clone, Debug)]
pub struct Control {
    /// Index of the line: 2n is forth and 2n + 1 is back, of proxy n.
    pub line: usize,
    /// New stream.
    pub stream: Box<StreamConfig>,
}

/// Relay of TCP with open ports. Clients that connect before [`Streams::run`] wait in the system.
#[derive(Debug)]
pub struct Streams {
    engine: Engine,
    sockets: Sockets,
    /// Lateness of the first write of each batch of bytes.
    release: Lateness,
}

impl Streams {
    /// Opens the listening sockets.
    ///
    /// # Errors
    ///
    /// [`StreamsError::Listen`] if an address cannot be listened at, [`StreamsError::ToItself`] if a proxy would connect to the relay.
    pub fn bind(config: StreamsConfig) -> Result<Self, StreamsError> {
        let sockets = Sockets::listen(&config)?;
        Ok(Self { engine: Engine::new(config), sockets, release: Lateness::new() })
    }

    /// Returns the listening address of each proxy, in the order of the configuration.
    #[must_use]
    pub fn addresses(&self) -> &[SocketAddr] {
        self.sockets.addresses()
    }

    /// Runs the relay once, on the calling thread, until `stop` is set or until the end of `options.duration`. `stop` is read after each call of `look`, which is
    /// called about every `options.look_every` and once at the end; the time spent in `look` makes writes late. At the end all connections are closed.
    ///
    /// # Errors
    ///
    /// [`StreamsError::System`] if the system refuses to wait.
    pub fn run(
        &mut self,
        options: &RunOptions,
        control: &Receiver<Control>,
        stop: &AtomicBool,
        mut look: impl FnMut(&View<'_>),
    ) -> Result<Report, StreamsError> {
        self.run_looked_at(options, control, stop, &mut look)
    }

    /// The loop of [`Streams::run`], compiled once here. With a generic closure, each program would compile the loop again, at its own level of optimisation.
    fn run_looked_at(
        &mut self,
        options: &RunOptions,
        control: &Receiver<Control>,
        stop: &AtomicBool,
        look: &mut dyn FnMut(&View<'_>),
    ) -> Result<Report, StreamsError> {
        let begun = Clock::now();
        let clock = || Instant::ZERO.saturating_add(begun.elapsed());
        let end = options.duration.map(|duration| Instant::ZERO.saturating_add(duration));
        let mut look_at = Instant::ZERO;
        loop {
            self.sockets.serve(&mut self.engine, clock())?;
            while let Ok(Control { line, stream }) = control.try_recv() {
                // The only reason for a refusal is an index beyond the lines, taken by the maker of the message from the configuration.
                let _ = self.engine.set_stream(clock(), line, *stream);
            }
            self.engine.handle_timeout(clock());
            while let Some(event) = self.engine.poll_event() {
                if let Event::Ready(connection, side) = event {
                    self.sockets.write(&mut self.engine, connection, side, &clock, &mut self.release);
                } else {
                    self.sockets.handle(&mut self.engine, event);
                }
            }
            // Writing has made room, and ends readable before may wait for room.
            self.sockets.read(&mut self.engine, clock());
            let now = clock();
            if end.is_some_and(|end| now >= end) {
                break;
            }
            if now >= look_at {
                look(&self.view(now));
                if stop.load(Ordering::Relaxed) {
                    break;
                }
                look_at = now.saturating_add(options.look_every);
            }
            let due = self.engine.poll_timeout().into_iter().chain(self.sockets.poll_timeout(now)).min();
            let until = [Some(look_at), end, due].into_iter().flatten().min().unwrap_or(look_at);
            self.wait(due == Some(until), until.saturating_duration_since(clock()))?;
        }
        let now = clock();
        look(&self.view(now));
        Ok(Report::new(&self.engine, self.sockets.addresses(), now, &self.release, options.tolerance))
    }

    /// Waits for `span`, or until a socket is ready. `is_precise` says that the end of the wait is a deadline of bytes.
    fn wait(&mut self, is_precise: bool, span: Duration) -> Result<(), StreamsError> {
        if !is_precise {
            self.sockets.wait(span)?;
        } else if span > NEAR {
            // Rounded down by more than the resolution, so the wait of mio ends before the deadline.
            self.sockets.wait(span - NEAR / 2)?;
        } else if !self.sockets.wait(Duration::ZERO)? {
            std::thread::sleep(span.min(REST));
            self.sockets.wait(Duration::ZERO)?;
        }
        Ok(())
    }

    const fn view(&self, now: Instant) -> View<'_> {
        View { now, engine: &self.engine, release: &self.release }
    }
}
