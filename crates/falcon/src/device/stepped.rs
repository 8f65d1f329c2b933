//! Falcon without a thread.

use core::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_units::Instant;

use super::turn::{Turns, description, reading};
use super::{DeviceConfig, Snapshot, StartError};
use crate::driver::DriverError;
use crate::transport::Transport;

/// A Falcon driven by the ticks of a session or a loop: each [`Device::hold`] exchanges packets until the end of the tick on the transport's clock.
///
/// On a [simulated transport in virtual time](crate::simulator::SimulatedTransport::in_virtual_time) a whole cooperation is deterministic. A real device
/// needs a [`FalconDevice`](super::FalconDevice), whose exchanges go on when the peer pauses.
#[derive(Debug)]
pub struct SteppedFalcon<T: Transport, const A: usize> {
    turns: Turns<T, A>,
    config: DeviceConfig<A>,
    /// End of the last tick on the transport's clock.
    reached: Instant,
    /// Error of the driver, after which there are no more exchanges.
    ended: Option<DriverError>,
}

impl<T: Transport, const A: usize> SteppedFalcon<T, A> {
    /// Opens the driver.
    ///
    /// # Errors
    ///
    /// [`StartError`] if the configuration is refused, or the driver cannot be opened.
    pub fn start(transport: T, config: DeviceConfig<A>) -> Result<Self, StartError> {
        let config = config.checked()?;
        let turns = Turns::open(transport, config)?;
        let reached = turns.driver.now();
        Ok(Self { turns, config, reached, ended: None })
    }

    /// Exchanges packets without force for `span`, to home the device before a peer uses it. Returns the device after the last exchange.
    ///
    /// # Errors
    ///
    /// [`DriverError`] if the driver has failed.
    pub fn wait(&mut self, span: Duration) -> Result<Snapshot, DriverError> {
        self.run(span);
        self.ended.map_or_else(|| Ok(self.snapshot()), Err)
    }

    /// Returns the device after its last exchange.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.turns.snapshot()
    }

    /// Returns the error after which the device gives no force; `None` while the driver works.
    #[must_use]
    pub const fn ended(&self) -> Option<&DriverError> {
        self.ended.as_ref()
    }

    fn run(&mut self, span: Duration) {
        // Ticks add up from the end of the last tick, so that late exchanges do not lengthen the run.
        self.reached = self.reached.saturating_add(span);
        while self.ended.is_none() && self.turns.driver.now() < self.reached {
            self.ended = self.turns.exchange().err();
            self.turns.pace();
        }
    }
}

impl<T: Transport + Send, const A: usize> Device for SteppedFalcon<T, A> {
    fn description(&self) -> Description {
        description(&self.config)
    }

    fn stopper(&self) -> Stopper {
        self.turns.driver.stopper().clone()
    }

    /// Returns the grip at the end of the last tick; `None` until forces are switched on, and after an error of the driver.
    fn read(&mut self, _now: Instant) -> Option<Reading> {
        reading(&self.snapshot(), &self.config).filter(|_| self.ended.is_none())
    }

    fn hold(&mut self, _now: Instant, span: Duration, force: GatedForce) {
        self.turns.want(force);
        self.run(span);
    }

    /// Ends the force for good, and tells the device.
    fn stop(&mut self) {
        self.turns.driver.stop();
    }
}
