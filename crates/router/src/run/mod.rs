//! The router in real time: one thread reads both devices and writes departing packets, in the loop of [`cohaptic_realtime::drive()`].

mod counts;

use std::io;
use std::ops::ControlFlow;
use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::{Clock, Driven, Lateness, LatenessSummary, MonotonicClock, Pacing, Received, Schedule, drive};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use crate::engine::{Departure, Engine, NoSuchLink};
use crate::packet::Packet;
use crate::side::{AnyDevice, Device, OpenError};
pub use counts::{Report, Written};

/// Router between two devices.
#[derive(Debug)]
pub struct Router<D = AnyDevice, C = MonotonicClock> {
    engine: Engine,
    /// Devices of the left and of the right side.
    devices: [D; 2],
    clock: C,
    pacing: Pacing,
    /// Release error of every packet handed to a device.
    release: Lateness,
    /// Packets handed to the devices, indexed by side.
    written: [Written; 2],
    /// Packets of the current reading, empty between readings.
    incoming: Vec<Packet>,
    /// Packets from the engine, indexed by the side of their departure.
    leaving: [Leaving; 2],
}

/// Packets for one device, with their logical departures. Both vectors have the same length.
#[derive(Debug, Default)]
struct Leaving {
    packets: Vec<Arc<Packet>>,
    at: Vec<Instant>,
}

/// Reason why a router stopped by itself.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A device gives no more packets.
    #[error("{}: cannot read the device: {source}", side.name())]
    Device {
        /// Side of the device.
        side: Side,
        /// Error of the system.
        source: io::Error,
    },
    /// The system does not let the thread wait.
    #[error("cannot wait: {0}")]
    Wait(#[from] io::Error),
}

/// Approximate time to read a packet and to deal with it.
const READING: Duration = Duration::from_micros(10);

/// Packets read from one device before departures are written and the other device gets its turn.
const IN_TURN: usize = 64;

impl Router {
    /// Opens both devices. The clock of the run starts with this call.
    ///
    /// # Errors
    ///
    /// [`OpenError`] with the side, the failed step and the error of the system.
    pub fn open(file: &RouterFile, pacing: Pacing) -> Result<Self, OpenError> {
        let devices = AnyDevice::open_both(&file.left, &file.right)?;
        Ok(Self::with(file, devices, MonotonicClock::start(), pacing))
    }

    /// Calls [`Router::run`], compiled once in this crate for the devices of the system. As a generic function, `run` is compiled again by each program, at the
    /// program's level of optimisation.
    ///
    /// # Errors
    ///
    /// As [`Router::run`].
    pub fn route(&mut self, stop: &AtomicBool, until: Option<Instant>, every: Duration, look: &mut dyn FnMut(&mut Self)) -> Result<(), RunError> {
        self.run(stop, until, every, look)
    }
}

impl<D: Device, C: Clock> Router<D, C> {
    /// Returns a router between the given devices, left and right, with the given clock. The devices named in the file are ignored.
    #[must_use]
    pub fn with(file: &RouterFile, devices: [D; 2], clock: C, pacing: Pacing) -> Self {
        let (written, leaving) = ([Written::default(); 2], [Leaving::default(), Leaving::default()]);
        Self { engine: Engine::new(file), devices, clock, pacing, release: Lateness::new(), written, incoming: Vec::new(), leaving }
    }

    /// Routes packets until `stop` is set, or until the run is `until` old. `look` is called on this thread at the end, and about every `every`, at most 50 ms
    /// late. Packets wait during `look`, so it should take microseconds.
    ///
    /// Packets inside the links at the end stay there, and a further call continues with them.
    ///
    /// # Errors
    ///
    /// [`RunError`] if a device is gone.
    pub fn run(&mut self, stop: &AtomicBool, until: Option<Instant>, every: Duration, mut look: impl FnMut(&mut Self)) -> Result<(), RunError> {
        // `stop` is read at least this often.
        const NEVER_LONGER: Duration = Duration::from_millis(50);
        let every = every.max(Duration::from_millis(1));
        let mut next_look = self.clock.now().saturating_add(every);
        let schedule = Schedule { pacing: self.pacing, end: until, look_every: every.min(NEVER_LONGER) };
        drive(self, &schedule, |router, now| {
            if now >= next_look {
                look(router);
                // Counted from this look, so that slow looks do not pile up.
                next_look = now.saturating_add(every);
            }
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        look(self);
        Ok(())
    }

    /// Changes the model of a named link from now on, in one direction or, with `None`, in both: see [`Engine::set_link`].
    ///
    /// # Errors
    ///
    /// [`NoSuchLink`]; nothing was changed.
    pub fn set_link(&mut self, name: &str, from: Option<Side>, model: &LinkModel) -> Result<(), NoSuchLink> {
        self.engine.set_link(self.clock.now(), name, from, model)?;
        // The change may have released packets.
        self.take_departures();
        self.send();
        Ok(())
    }

    /// Returns all counters. The recent delays begin anew with each call.
    pub fn report(&mut self) -> Report {
        Report { elapsed: self.clock.now(), counters: self.engine.counters(), written: self.written, release: self.release.summary() }
    }

    /// Returns the release error so far: the time from the logical departure of each packet to the call of the device.
    #[must_use]
    pub const fn lateness(&self) -> &Lateness {
        &self.release
    }

    /// Returns a summary of the release error so far.
    #[must_use]
    pub fn release_error(&self) -> LatenessSummary {
        self.release.summary()
    }

    /// Moves departures from the engine to the queues of the devices.
    fn take_departures(&mut self) {
        while let Some(Departure { at, to, packet }) = self.engine.poll_departure() {
            let leaving = &mut self.leaving[to.index()];
            leaving.at.push(at);
            leaving.packets.push(packet);
        }
    }
}

impl<D: Device, C: Clock> Driven for Router<D, C> {
    type Clock = C;
    type Error = RunError;

    /// A packet that arrives while a departure is made ready is read late by up to this time.
    const AHEAD: Option<Duration> = Some(READING);
    const RESTS: bool = false;

    fn clock(&self) -> &C {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        self.devices.each_ref().map(Device::readable)
    }

    /// Reads waiting packets from both devices in turns.
    fn receive(&mut self, now: Instant) -> Result<Received, RunError> {
        // A packet counts from its reading, so departures need not wait for unread packets: departures that are already late leave first. If all due departures
        // left first, more packets would leave alone, each in a call of the kernel.
        if self.engine.poll_timeout().is_some_and(|due| now.saturating_duration_since(due) >= READING) {
            self.handle_timeout(now);
            self.send();
        }
        let mut received = 0;
        for side in Side::BOTH {
            let mut count = 0;
            while count < IN_TURN {
                let is_read = self.devices[side.index()].receive(&mut self.incoming);
                if !is_read.map_err(|source| RunError::Device { side, source })? {
                    break;
                }
                // All packets of a segment arrived at one instant.
                let now = self.clock.now();
                count += self.incoming.len();
                self.incoming.drain(..).for_each(|packet| self.engine.handle_packet(now, side, packet));
            }
            received += count;
            // Departures that have become due leave after each turn, as many in one call as the device takes together.
            self.take_departures();
            self.send();
        }
        Ok(Received { count: received, until: now })
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.engine.poll_timeout()
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        self.engine.handle_timeout(now);
        self.take_departures();
        false
    }

    /// Writes the packets from the engine to the devices.
    fn send(&mut self) -> u64 {
        let before = self.release.count();
        for ((device, written), Leaving { packets, at }) in self.devices.iter_mut().zip(&mut self.written).zip(&mut self.leaving) {
            let mut rest = packets.as_slice();
            let mut at = at.drain(..);
            while !rest.is_empty() {
                // Lateness is measured before the call, which hands over all packets of the group at once.
                let now = self.clock.now();
                let (count, sent) = device.send(rest);
                // At least one packet is settled by each call, so that the loop ends.
                let (gone, left) = rest.split_at(count.clamp(1, rest.len()));
                for (packet, at) in gone.iter().zip(&mut at) {
                    self.release.record(now.saturating_duration_since(at));
                    written.add(sent, packet.bytes().len());
                }
                rest = left;
            }
            packets.clear();
        }
        self.release.count() - before
    }
}
