//! The way to a device, whichever it is.

use std::fmt;
use std::time::Duration;

use cohaptic_falcon::transport::Request;
use cohaptic_falcon::transport::{Transport, TransportError};
use cohaptic_units::Instant;

/// USB or simulated: the device behind it does not know which.
pub(super) struct AnyTransport(Box<dyn Transport>);

impl AnyTransport {
    pub(super) fn new(transport: impl Transport + 'static) -> Self {
        Self(Box::new(transport))
    }
}

impl Transport for AnyTransport {
    fn now(&self) -> Instant {
        self.0.now()
    }

    fn sleep_until(&mut self, until: Instant) {
        self.0.sleep_until(until);
    }

    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError> {
        self.0.control(request, value)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.0.write(bytes)
    }

    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
        self.0.read(into, patience)
    }
}

impl fmt::Debug for AnyTransport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Way").field("now", &self.now()).finish_non_exhaustive()
    }
}
