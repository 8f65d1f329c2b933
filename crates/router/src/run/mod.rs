//! The router in real time: one thread that reads both devices, tells the engine the time, and writes what leaves.

mod counts;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::{Clock, Lateness, LatenessSummary, MonotonicClock, Pacer, Pacing};
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
    pacer: Pacer,
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
    Wait(#[source] io::Error),
}

/// This close to a departure nothing is read any more, while spinning: reading and dealing with a packet takes about as long. A packet that comes then is
/// read that much late.
const TOO_CLOSE: Duration = Duration::from_micros(10);

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
        let (engine, pacer, release) = (Engine::new(file), Pacer::new(pacing), Lateness::new());
        Self { engine, devices, clock, pacer, release, written, incoming: Vec::new(), leaving }
    }

    /// Routes packets until `stop` is set, or until the run is `until` old. Every now and then, `every` so often and once at the end, `look` is called on
    /// this thread: packets wait meanwhile, so it should take microseconds.
    ///
    /// Packets inside the links at the end stay there: a further call goes on.
    ///
    /// # Errors
    ///
    /// [`RunError`] if a device is gone.
    pub fn run(&mut self, stop: &AtomicBool, until: Option<Instant>, every: Duration, mut look: impl FnMut(&mut Self)) -> Result<(), RunError> {
        // A stop is noticed as often.
        const NEVER_LONGER: Duration = Duration::from_millis(50);
        let mut next_look = self.clock.now().saturating_add(every);
        loop {
            let now = self.clock.now();
            if stop.load(Ordering::Relaxed) || until.is_some_and(|until| now >= until) {
                break;
            }
            if now >= next_look {
                look(self);
                next_look = now.saturating_add(every.max(Duration::from_millis(1)));
            }
            let due = self.engine.poll_timeout();
            if due.is_some_and(|due| due <= now) {
                self.engine.handle_timeout(now);
                self.release();
                self.receive()?;
                continue;
            }
            let left = due.map(|due| due.saturating_duration_since(now));
            match left.filter(|left| *left <= self.pacer.margin()) {
                // Reading is what a packet waits for: its instant is that at which it was read.
                Some(left) if left > TOO_CLOSE => self.receive()?,
                Some(_) => std::hint::spin_loop(),
                None => {
                    let wake = [due, Some(next_look), until, Some(now.saturating_add(NEVER_LONGER))].into_iter().flatten().min();
                    let readable = [self.devices[0].readable(), self.devices[1].readable()];
                    self.pacer.approach(&self.clock, wake, &readable).map_err(RunError::Wait)?;
                    self.receive()?;
                }
            }
        }
        look(self);
        Ok(())
    }

    /// Reads the packets that are there, in turns. After each turn those leave whose time has come meanwhile: together, as far as a device takes them so.
    fn receive(&mut self) -> Result<(), RunError> {
        for side in Side::BOTH {
            let mut count = 0;
            while count < IN_TURN {
                let received = self.devices[side.index()].receive(&mut self.incoming);
                if !received.map_err(|source| RunError::Device { side, source })? {
                    break;
                }
                // The packets of a segment came at one instant.
                let now = self.clock.now();
                count += self.incoming.len();
                self.incoming.drain(..).for_each(|packet| self.engine.handle_packet(now, side, packet));
            }
            self.release();
        }
        Ok(())
    }

    /// Writes what has left the engine.
    fn release(&mut self) {
        while let Some(Departure { at, to, packet }) = self.engine.poll_departure() {
            let leaving = &mut self.leaving[to.index()];
            leaving.at.push(at);
            leaving.packets.push(packet);
        }
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
    }

    /// Changes a link from now on, in one direction or (`None`) in both: see [`Engine::set_link`].
    ///
    /// # Errors
    ///
    /// [`NoSuchLink`]; nothing was changed.
    pub fn set_link(&mut self, name: &str, from: Option<Side>, model: &LinkModel) -> Result<(), NoSuchLink> {
        self.engine.set_link(self.clock.now(), name, from, model)?;
        self.release();
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
}
