//! The router in real time: one thread that reads both devices, tells the engine the time, and writes what leaves.

mod counts;

use std::io;
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
    buffer: Vec<u8>,
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

/// No packet of IP is longer; and a frame around it.
const LONGEST: usize = (1 << 16) + 64;

/// This close to a departure nothing is read any more, while spinning: reading and dealing with a packet takes about as long. A packet that comes then is
/// read that much late.
const TOO_CLOSE: Duration = Duration::from_micros(10);

/// The number of packets that are read from one device before the other one has its turn.
const IN_TURN: usize = 16;

impl Router {
    /// Opens both devices. The clock of the run begins here.
    ///
    /// # Errors
    ///
    /// [`OpenError`]: which side, what was tried, and what the system says.
    pub fn open(file: &RouterFile, pacing: Pacing) -> Result<Self, OpenError> {
        let devices = [AnyDevice::open(Side::Left, &file.left)?, AnyDevice::open(Side::Right, &file.right)?];
        Ok(Self::with(file, devices, MonotonicClock::start(), pacing))
    }
}

impl<D: Device, C: Clock> Router<D, C> {
    /// A router between these devices, left and right, by this clock. The devices that the file names are not looked at.
    #[must_use]
    pub fn with(file: &RouterFile, devices: [D; 2], clock: C, pacing: Pacing) -> Self {
        let written = [Written::default(); 2];
        Self { engine: Engine::new(file), devices, clock, pacer: Pacer::new(pacing), release: Lateness::new(), written, buffer: vec![0; LONGEST] }
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

    /// Reads the packets that are there, in turns, and lets packets leave whose time comes meanwhile.
    fn receive(&mut self) -> Result<(), RunError> {
        for side in Side::BOTH {
            for _ in 0..IN_TURN {
                let device = &mut self.devices[side.index()];
                let received = device.receive(&mut self.buffer).map_err(|source| RunError::Device { side, source })?;
                let Some(length) = received else { break };
                let packet = Packet::new(self.buffer[..length].to_vec(), device.framing());
                self.engine.handle_packet(self.clock.now(), side, packet);
                self.release();
            }
        }
        Ok(())
    }

    /// Writes what has left the engine.
    fn release(&mut self) {
        while let Some(Departure { at, to, packet }) = self.engine.poll_departure() {
            self.release.record(self.clock.now().saturating_duration_since(at));
            let sent = self.devices[to.index()].send(packet.bytes());
            self.written[to.index()].add(sent, packet.bytes().len());
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
