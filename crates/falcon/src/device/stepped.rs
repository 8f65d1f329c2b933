//! Falcon without a thread.

use core::time::Duration;

use cohaptic_peer::{Device, State};
use cohaptic_units::Instant;

use super::turn::{Turns, state};
use super::{DeviceConfig, Snapshot, StartError};
use crate::driver::DriverError;
use crate::transport::Transport;

/// A Falcon driven by the ticks of its peer: each [`Device::advance`] exchanges packets until the end of the tick on the transport's clock.
///
/// On a [simulated transport in virtual time](crate::simulator::SimulatedTransport::in_virtual_time) a whole cooperation is deterministic. A real device
/// needs a [`FalconDevice`](super::FalconDevice), whose exchanges go on when the peer pauses.
#[derive(Debug)]
pub struct SteppedFalcon<T: Transport, const A: usize> {
    turns: Turns<T, A>,
    config: DeviceConfig<A>,
    state: State<A>,
    /// End of the last tick on the transport's clock.
    reached: Instant,
    /// Error of the driver, after which there are no more exchanges.
    ended: Option<DriverError>,
}

impl<T: Transport, const A: usize> SteppedFalcon<T, A> {
    /// Opens the driver. Until the device is homed, its state is rest at the origin.
    ///
    /// # Errors
    ///
    /// [`StartError`] if the configuration is refused, or the driver cannot be opened.
    pub fn start(transport: T, config: DeviceConfig<A>) -> Result<Self, StartError> {
        let config = config.checked()?;
        let turns = Turns::open(transport, config)?;
        let reached = turns.driver.now();
        Ok(Self { turns, config, state: State::REST, reached, ended: None })
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

    /// Stops the force, and tells the device.
    pub fn stop(&mut self) {
        self.turns.driver.stop();
    }

    fn run(&mut self, span: Duration) {
        // Ticks add up from the end of the last tick, so that late exchanges do not lengthen the run.
        self.reached = self.reached.saturating_add(span);
        while self.ended.is_none() && self.turns.driver.now() < self.reached {
            self.ended = self.turns.exchange().err();
            self.turns.pace();
        }
        // Read once per tick: `Device::state` must give the same answer for the whole tick.
        self.state = state(&self.snapshot(), &self.config, self.state);
    }
}

impl<T: Transport, const A: usize> Device<A> for SteppedFalcon<T, A> {
    fn state(&self) -> State<A> {
        self.state
    }

    fn advance(&mut self, _now: Instant, span: Duration, coupling_force: [f64; A]) {
        // The coupling force acts on the copy, and with the opposite sign on the grip.
        self.turns.want(self.config.axes.to_device(coupling_force.map(|part| -part)));
        self.run(span);
    }
}
