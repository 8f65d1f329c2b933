//! A device without a thread.

use core::time::Duration;

use cohaptic_peer::{Device, State};
use cohaptic_units::Instant;

use super::turn::{Turns, state};
use super::{DeviceConfig, Snapshot, StartError};
use crate::driver::DriverError;
use crate::transport::Transport;

/// A Falcon that the ticks of its peer drive: each [`Device::advance`] exchanges packets until the tick is over on the transport's clock.
///
/// On a [simulated transport in virtual time](crate::simulator::SimulatedTransport::in_virtual_time) a whole cooperation is deterministic that way. A real
/// device wants a [`FalconDevice`](super::FalconDevice), which goes on by itself when the peer does not.
#[derive(Debug)]
pub struct SteppedFalcon<T: Transport, const A: usize> {
    turns: Turns<T, A>,
    config: DeviceConfig<A>,
    state: State<A>,
    /// The end of the last tick on the transport's clock.
    reached: Instant,
    ended: Option<DriverError>,
}

impl<T: Transport, const A: usize> SteppedFalcon<T, A> {
    /// Opens the driver. The device begins at the origin, at rest, until it is homed.
    ///
    /// # Errors
    ///
    /// [`StartError`].
    pub fn start(transport: T, config: DeviceConfig<A>) -> Result<Self, StartError> {
        let config = config.checked()?;
        let turns = Turns::open(transport, config)?;
        let reached = turns.driver.now();
        Ok(Self { turns, config, state: State::REST, reached, ended: None })
    }

    /// Exchanges packets without force for a while: for homing, before a peer uses it. Gives what the device is like then.
    ///
    /// # Errors
    ///
    /// [`DriverError`] if the driver cannot go on.
    pub fn wait(&mut self, span: Duration) -> Result<Snapshot, DriverError> {
        self.run(span);
        self.ended.map_or_else(|| Ok(self.snapshot()), Err)
    }

    /// The device as it is.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.turns.snapshot()
    }

    /// Why it gives no force any more, if the driver could not go on.
    #[must_use]
    pub const fn ended(&self) -> Option<&DriverError> {
        self.ended.as_ref()
    }

    /// Ends force in good order.
    pub fn stop(&mut self) {
        self.turns.driver.stop();
    }

    fn run(&mut self, span: Duration) {
        self.reached = self.reached.saturating_add(span);
        while self.ended.is_none() && self.turns.driver.now() < self.reached {
            self.ended = self.turns.exchange().err();
            self.turns.pace();
        }
        self.state = state(&self.snapshot(), &self.config, self.state);
    }
}

impl<T: Transport, const A: usize> Device<A> for SteppedFalcon<T, A> {
    fn state(&self) -> State<A> {
        self.state
    }

    fn advance(&mut self, _now: Instant, span: Duration, coupling_force: [f64; A]) {
        self.turns.want(self.config.axes.to_device(coupling_force.map(|part| -part)));
        self.run(span);
    }
}
