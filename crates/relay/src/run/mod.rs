//! The relay in real time: one thread that waits for sockets and for the next release.

mod ports;
mod report;

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::sync::mpsc::Receiver;

use cohaptic_realtime::udp::{BindError, EndpointConfig};
use cohaptic_realtime::{Clock as _, Lateness, MonotonicClock, Pacer, Pacing, Tolerance, Wishes, Woken, prepare_thread};
use cohaptic_units::Instant;
use cohaptic_wan::{LinkModel, NodeId};

use crate::config::{ConfigError, RelayConfig};
use crate::engine::Engine;
use ports::{Heard, Ports};

pub use report::{LinkReport, PortReport, Report, View};

/// Why there is no relay, or why it stopped.
#[derive(Debug, thiserror::Error)]
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
    density: Density,
    refused_changes: u64,
}

/// So long before a release, if it is awake by then, what leaves then is made ready, and sockets are not looked at any more. To make it ready takes less than a microsecond
/// once the processor has it at hand, and what comes in meanwhile is offered late.
const MADE_READY: Duration = Duration::from_micros(3);

/// What the kernel did not take is offered to it again after this.
const AGAIN: Duration = Duration::from_micros(500);

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
        Ok(Self { engine: Engine::new(config)?, ports, release: Lateness::new(), density: Density::new(), refused_changes: 0 })
    }

    /// Where it listens: each program's name and the port that stands for it; of a proxy, `listen`.
    pub fn ports(&self) -> impl Iterator<Item = (&str, SocketAddr)> {
        self.ports.addresses()
    }

    /// Runs once, in this thread, until `stop` is set (which is looked at as often as `look` is called), or until its end. `control` is looked at without
    /// waiting; `look` is called from time to time, and what it takes makes releases late.
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
        let (mut look_at, mut heard) = (Instant::ZERO, None);
        let mut pacer = Pacer::new(options.pacing);
        loop {
            // Arrivals first: then no unread datagram came before the instant that is let pass.
            let Heard { until, count } = match heard.take() {
                Some(heard) => heard,
                None => self.ports.receive(&mut self.engine, &clock)?,
            };
            self.ports.follow_clients(&mut self.engine);
            self.take_control(control, until);
            self.engine.handle_timeout(until);
            let is_more = self.ports.take_releases(&mut self.engine);
            let before = self.release.count();
            self.ports.send(&clock, &mut self.release);
            let now = clock.now();
            self.density.note(now, count as u64 + self.release.count() - before);
            let is_over = end.is_some_and(|end| now >= end);
            if now >= look_at || is_over {
                look(&View { now, engine: &self.engine, release: &self.release });
                look_at = now + options.look_every;
                if is_over || stop.load(Ordering::Relaxed) {
                    break;
                }
            }
            if !is_more {
                heard = self.wait(&clock, &mut pacer, end.map_or(look_at, |end| end.min(look_at)))?;
            }
        }
        let elapsed = clock.now().saturating_duration_since(Instant::ZERO);
        Ok(Report {
            elapsed,
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

    fn take_control(&mut self, control: &Receiver<Control>, now: Instant) {
        while let Ok(Control::SetLink { from, to, model }) = control.try_recv() {
            let changed = self.engine.set_link(now, from, to, *model);
            self.refused_changes += u64::from(changed.is_err());
        }
    }

    /// Waits until something is due or can be read; tells what was heard if it has listened meanwhile.
    fn wait(&mut self, clock: &MonotonicClock, pacer: &mut Pacer, look_at: Instant) -> io::Result<Option<Heard>> {
        if pacer.pacing() == Pacing::Sleep && self.density.is_dense() {
            // More comes and more is due than is worth a look each.
            clock.block(Some(clock.now() + Density::REST), &[])?;
            return Ok(None);
        }
        let due = self.engine.poll_timeout();
        let mut until = due.map_or(look_at, |due| due.min(look_at));
        if self.ports.has_waiting() {
            until = until.min(clock.now() + AGAIN);
        }
        if due != Some(until) {
            pacer.wait(clock, Some(until), &[self.ports.readable()])?;
            return Ok(None);
        }
        match pacer.approach(clock, due, &[self.ports.readable()])? {
            Woken::Deadline => self.meet(clock, until),
            Woken::Readable | Woken::Early => Ok(None),
        }
    }

    /// Something leaves at `due`, in a moment: looks at the sockets again and again, then makes ready what leaves, looks at nothing but the clock, and
    /// sends it.
    fn meet(&mut self, clock: &MonotonicClock, due: Instant) -> io::Result<Option<Heard>> {
        let ready_at = Instant::ZERO + due.saturating_duration_since(Instant::ZERO).saturating_sub(MADE_READY);
        let mut now = clock.now();
        while now < ready_at {
            let heard = self.ports.receive(&mut self.engine, clock)?;
            if heard.count > 0 {
                return Ok(Some(heard));
            }
            now = clock.now();
        }
        if now < due {
            // Nothing is due earlier, so that all of it leaves then. What comes in until then is offered then.
            self.engine.handle_timeout(due);
            self.ports.take_releases(&mut self.engine);
            while clock.now() < due {
                core::hint::spin_loop();
            }
            self.ports.send(clock, &mut self.release);
        }
        Ok(None)
    }
}

/// How much came in and left lately.
#[derive(Clone, Copy, Debug)]
struct Density {
    since: Instant,
    work: u64,
    is_dense: bool,
}

/// It is counted over at least so long.
const WINDOW: Duration = Duration::from_millis(1);

/// Datagrams a millisecond, in and out: 20,000 a second that pass.
const DENSE: u64 = 40;

impl Density {
    /// The time between two looks when it is dense, so that datagrams that leave together go in one call of the kernel. A datagram is later by as much at
    /// most; of 250,000 a second, each took 2.1 µs of processor time in place of 3.3 µs.
    const REST: Duration = Duration::from_micros(50);

    const fn new() -> Self {
        Self { since: Instant::ZERO, work: 0, is_dense: false }
    }

    /// That number came in or left.
    #[inline]
    fn note(&mut self, now: Instant, count: u64) {
        self.work += count;
        let span = now.saturating_duration_since(self.since);
        if span >= WINDOW {
            self.is_dense = u128::from(self.work) * WINDOW.as_nanos() >= u128::from(DENSE) * span.as_nanos();
            (self.since, self.work) = (now, 0);
        }
    }

    const fn is_dense(&self) -> bool {
        self.is_dense
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_dense_from_twenty_thousand_a_second_on_and_not_after_a_silence() {
        let mut density = Density::new();
        let mut now = 0;
        let mut pass = |micros: u64, count: u64| {
            for _ in 0..count {
                now += micros * 1000;
                // One in, one out.
                density.note(Instant::from_nanos(now), 2);
            }
            density.is_dense()
        };
        assert!(!pass(200, 100), "5,000 a second");
        assert!(pass(50, 100), "20,000 a second");
        assert!(!pass(10_000, 1));
        assert!(pass(4, 1000));
        assert!(!pass(60, 100));
    }
}
