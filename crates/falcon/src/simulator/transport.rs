//! A simulated device as a transport, in virtual time or in that of the machine.

use core::time::Duration;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cohaptic_units::Instant;

use super::Simulator;
use crate::clock::WallClock;
use crate::ftdi::{PACKET, PAYLOAD, strip_status};
use crate::transport::{Request, Transport, TransportError};

/// How long any call takes in virtual time. A driver that never sleeps still gets on.
const CALL: Duration = Duration::from_micros(20);

/// A simulated device that a driver works on and somebody else looks at.
#[derive(Clone, Debug)]
pub struct SharedSimulator(Arc<Mutex<Simulator>>);

impl SharedSimulator {
    /// Looks at the device, or does something to it, between two transfers.
    pub fn with<R>(&self, work: impl FnOnce(&mut Simulator) -> R) -> R {
        work(&mut self.lock())
    }

    fn lock(&self) -> MutexGuard<'_, Simulator> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The way to a simulated device.
#[derive(Clone, Debug)]
pub struct SimulatedTransport {
    shared: SharedSimulator,
    clock: Clock,
    payload: [u8; PAYLOAD],
    taken: usize,
    count: usize,
}

#[derive(Clone, Debug)]
enum Clock {
    /// Passes when the driver sleeps, waits or calls.
    Virtual(Instant),
    /// Passes by itself.
    Wall(WallClock),
}

impl SimulatedTransport {
    /// In virtual time, which passes only while the driver waits: the same run gives the same bytes, as fast as the machine can.
    #[must_use]
    pub fn in_virtual_time(simulator: Simulator) -> Self {
        let now = simulator.now();
        Self::new(simulator, Clock::Virtual(now))
    }

    /// In the time of the machine, from now on.
    #[must_use]
    pub fn in_real_time(simulator: Simulator) -> Self {
        Self::new(simulator, Clock::Wall(WallClock::new()))
    }

    fn new(simulator: Simulator, clock: Clock) -> Self {
        Self { shared: SharedSimulator(Arc::new(Mutex::new(simulator))), clock, payload: [0; PAYLOAD], taken: 0, count: 0 }
    }

    /// The device, to look at it or to do something to it.
    #[must_use]
    pub fn simulator(&self) -> SharedSimulator {
        self.shared.clone()
    }

    /// The device at the present time, if it is plugged in. The call itself takes time.
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
            let next = device.next_heard().map_or_else(|| device.next_packet(), |heard| heard.min(device.next_packet()));
            drop(device);
            if length > 0 {
                self.count = strip_status(&packet[..length], &mut self.payload);
                self.taken = 0;
                break;
            }
            if self.now() >= deadline {
                return Ok(0);
            }
            self.sleep_until(next.min(deadline));
        }
        let rest = &self.payload[self.taken..self.count];
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        self.taken += count;
        Ok(count)
    }
}
