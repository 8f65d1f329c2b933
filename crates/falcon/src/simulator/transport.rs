//! Transport to a simulated device, in virtual time or in the time of the machine.

use core::time::Duration;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cohaptic_units::Instant;

use super::Simulator;
use crate::clock::WallClock;
use crate::ftdi::{PACKET, PAYLOAD, strip_status};
use crate::transport::{Request, Transport, TransportError};

/// Time of a call in virtual time, so that a driver that never sleeps makes progress.
const CALL: Duration = Duration::from_micros(20);

/// A simulated device shared between a driver and an observer.
#[derive(Clone, Debug)]
pub struct SharedSimulator(Arc<Mutex<Simulator>>);

impl SharedSimulator {
    /// Calls `work` with the device, between two transfers.
    pub fn with<R>(&self, work: impl FnOnce(&mut Simulator) -> R) -> R {
        work(&mut self.lock())
    }

    fn lock(&self) -> MutexGuard<'_, Simulator> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Transport to a simulated device.
#[derive(Clone, Debug)]
pub struct SimulatedTransport {
    shared: SharedSimulator,
    clock: Clock,
    /// Payload of the newest packet, of which bytes `taken..count` are not read yet.
    payload: [u8; PAYLOAD],
    taken: usize,
    count: usize,
}

/// Clock of the transport.
#[derive(Clone, Debug)]
enum Clock {
    /// A virtual clock, which advances when the driver sleeps, waits or calls.
    Virtual(Instant),
    /// The clock of the machine.
    Wall(WallClock),
}

impl SimulatedTransport {
    /// Returns a transport in virtual time, which advances only by calls and waits of the driver. Equal runs give equal bytes, as fast as the machine
    /// computes.
    #[must_use]
    pub fn in_virtual_time(simulator: Simulator) -> Self {
        let now = simulator.now();
        Self::new(simulator, Clock::Virtual(now))
    }

    /// Returns a transport in the time of the machine, from now on.
    #[must_use]
    pub fn in_real_time(simulator: Simulator) -> Self {
        Self::new(simulator, Clock::Wall(WallClock::new()))
    }

    fn new(simulator: Simulator, clock: Clock) -> Self {
        Self { shared: SharedSimulator(Arc::new(Mutex::new(simulator))), clock, payload: [0; PAYLOAD], taken: 0, count: 0 }
    }

    /// Returns the shared device, for observation or manipulation.
    #[must_use]
    pub fn simulator(&self) -> SharedSimulator {
        self.shared.clone()
    }

    /// Returns the device at the present time, or an error if it is unplugged. The call takes virtual time.
    fn device(&mut self) -> Result<MutexGuard<'_, Simulator>, TransportError> {
        if let Clock::Virtual(now) = &mut self.clock {
            *now = now.saturating_add(CALL);
        }
        let now = self.now();
        let mut device = self.shared.lock();
        device.advance(now);
        if device.is_plugged() { Ok(device) } else { Err(TransportError::Unplugged) }
    }
}

impl Transport for SimulatedTransport {
    fn now(&self) -> Instant {
        match &self.clock {
            Clock::Virtual(now) => *now,
            Clock::Wall(clock) => clock.now(),
        }
    }

    fn sleep_until(&mut self, until: Instant) {
        match &mut self.clock {
            Clock::Virtual(now) => *now = (*now).max(until),
            Clock::Wall(clock) => clock.sleep_until(until),
        }
    }

    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError> {
        if request == Request::Reset {
            // Payload buffered here would otherwise survive the purge of the chip.
            (self.taken, self.count) = (0, 0);
        }
        self.device()?.control(request, value);
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.device()?.write(bytes);
        Ok(())
    }

    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
        let deadline = self.now().saturating_add(patience);
        while self.taken == self.count {
            let mut packet = [0; PACKET];
            let mut device = self.device()?;
            let length = device.read_packet(&mut packet);
            // Either the next packet is due, or an answer of the device may make an earlier packet.
            let next = device.next_heard().map_or_else(|| device.next_packet(), |heard| heard.min(device.next_packet()));
            // The lock is released before the sleep: an observer may use the device meanwhile.
            drop(device);
            if length > 0 {
                self.count = strip_status(&packet[..length], &mut self.payload);
                self.taken = 0;
                break;
            }
            if self.now() >= deadline {
                return Ok(0);
            }
            // In virtual time this advances the clock to the next event, so the loop makes progress.
            self.sleep_until(next.min(deadline));
        }
        let rest = &self.payload[self.taken..self.count];
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        self.taken += count;
        Ok(count)
    }
}
