//! The router in real time: one thread that reads both devices and writes what leaves, in the loop of [`cohaptic_realtime::drive()`].

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

/// A router between two devices.
#[derive(Debug)]
pub struct Router<D = AnyDevice, C = MonotonicClock> {
    engine: Engine,
    /// Left, right.
    devices: [D; 2],
    clock: C,
    pacing: Pacing,
    release: Lateness,
    written: [Written; 2],
    /// What one reading gave.
    incoming: Vec<Packet>,
    /// What has left the engine, to the left and to the right.
    leaving: [Leaving; 2],
}

/// Packets on their way to a device, and when they left the engine.
#[derive(Debug, Default)]
struct Leaving {
    packets: Vec<Arc<Packet>>,
    at: Vec<Instant>,
}

/// Why a router came to an end by itself.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// A device gives no more packets.
    #[error("{}: cannot read the device: {source}", side.name())]
    Device {
        /// Which side.
        side: Side,
        /// What the system says.
        source: io::Error,
    },
    /// The system does not let the thread wait.
    #[error("cannot wait: {0}")]
    Wait(#[from] io::Error),
}

/// To read a packet and to deal with it takes about as long.
const READING: Duration = Duration::from_micros(10);

/// The number of packets from one device after which those that leave are written, and the other one has its turn.
const IN_TURN: usize = 64;

impl Router {
    /// Opens both devices. The clock of the run begins here.
    ///
    /// # Errors
    ///
    /// [`OpenError`]: which side, what was tried, and what the system says.
    pub fn open(file: &RouterFile, pacing: Pacing) -> Result<Self, OpenError> {
        let devices = AnyDevice::open_both(&file.left, &file.right)?;
        Ok(Self::with(file, devices, MonotonicClock::start(), pacing))
    }
}

impl<D: Device, C: Clock> Router<D, C> {
    /// A router between these devices, left and right, by this clock. The devices that the file names are not looked at.
    #[must_use]
    pub fn with(file: &RouterFile, devices: [D; 2], clock: C, pacing: Pacing) -> Self {
        let (written, leaving) = ([Written::default(); 2], [Leaving::default(), Leaving::default()]);
        Self { engine: Engine::new(file), devices, clock, pacing, release: Lateness::new(), written, incoming: Vec::new(), leaving }
    }

    /// Routes packets until `stop` is set, or until the run is `until` old. `look` is called on this thread at the end, and `every` so often or up to 50 ms
    /// later: packets wait meanwhile, so it should take microseconds.
    ///
    /// Packets inside the links at the end stay there: a further call goes on.
    ///
    /// # Errors
    ///
    /// [`RunError`] if a device is gone.
    pub fn run(&mut self, stop: &AtomicBool, until: Option<Instant>, every: Duration, mut look: impl FnMut(&mut Self)) -> Result<(), RunError> {
        // A stop is noticed as often.
        const NEVER_LONGER: Duration = Duration::from_millis(50);
        let every = every.max(Duration::from_millis(1));
        let mut next_look = self.clock.now().saturating_add(every);
        let schedule = Schedule { pacing: self.pacing, end: until, look_every: every.min(NEVER_LONGER) };
        drive(self, &schedule, |router, now| {
            if now >= next_look {
                look(router);
                next_look = now.saturating_add(every);
            }
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        look(self);
        Ok(())
    }

    /// Changes a link from now on, in one direction or (`None`) in both: see [`Engine::set_link`].
    ///
    /// # Errors
    ///
    /// [`NoSuchLink`]; nothing was changed.
    pub fn set_link(&mut self, name: &str, from: Option<Side>, model: &LinkModel) -> Result<(), NoSuchLink> {
        self.engine.set_link(self.clock.now(), name, from, model)?;
        self.take_departures();
        self.send();
        Ok(())
    }

    /// Everything that was counted so far. The delays of late are those since the last call.
    pub fn report(&mut self) -> Report {
        Report { elapsed: self.clock.now(), counters: self.engine.counters(), written: self.written, release: self.release.summary() }
    }

    /// How late packets left after their logical departure, of all so far: from the departure until they were handed to the device.
    #[must_use]
    pub const fn lateness(&self) -> &Lateness {
        &self.release
    }

    /// The same in a few numbers.
    #[must_use]
    pub fn release_error(&self) -> LatenessSummary {
        self.release.summary()
    }

    /// Takes from the engine what has left it.
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

    /// A packet that comes meanwhile is read that much late.
    const AHEAD: Option<Duration> = Some(READING);
    const RESTS: bool = false;

    fn clock(&self) -> &C {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        self.devices.each_ref().map(Device::readable)
    }

    /// Reads the packets that are there, in turns.
    fn receive(&mut self, now: Instant) -> Result<Received, RunError> {
        // A packet counts from when it is read, so that departures need not wait for packets that are unread: those that are late already leave first. If
        // all that are due left first, more packets would leave alone, in a call of the kernel each.
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
                // The packets of a segment came at one instant.
                let now = self.clock.now();
                count += self.incoming.len();
                self.incoming.drain(..).for_each(|packet| self.engine.handle_packet(now, side, packet));
            }
            received += count;
            // After each turn those leave whose time has come meanwhile: together, as far as a device takes them so.
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

    /// Writes what has left the engine.
    fn send(&mut self) -> u64 {
        let before = self.release.count();
        for ((device, written), Leaving { packets, at }) in self.devices.iter_mut().zip(&mut self.written).zip(&mut self.leaving) {
            let mut rest = packets.as_slice();
            let mut at = at.drain(..);
            while !rest.is_empty() {
                let now = self.clock.now();
                let (count, sent) = device.send(rest);
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
