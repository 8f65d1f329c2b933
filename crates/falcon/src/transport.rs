//! What the driver needs of the way to a device, be it USB or simulated.

use core::time::Duration;

use cohaptic_units::Instant;
use thiserror::Error;

/// Bytes to and from a device behind an FT232R, and a clock.
pub trait Transport {
    /// The time on the transport's own clock, which shows zero when it was made and never goes back.
    fn now(&self) -> Instant;

    /// Waits until then; not at all if that has passed.
    fn sleep_until(&mut self, until: Instant);

    /// A control transfer to the chip: vendor request to the device, index 0, no data.
    ///
    /// # Errors
    ///
    /// [`TransportError`].
    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError>;

    /// Sends all of the bytes.
    ///
    /// # Errors
    ///
    /// [`TransportError`].
    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError>;

    /// Takes bytes that have come, without the chip's status bytes, as many as there is room for; the rest stays for the next call. Waits at
    /// most `patience` for the first. May give 0 earlier, because the chip says now and then that it has nothing, but never without time passing.
    ///
    /// # Errors
    ///
    /// [`TransportError`].
    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError>;
}

/// Requests of the chip that are used here, by their numbers on the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Request {
    /// Purges a buffer: see [`PURGE_RX`](crate::ftdi::PURGE_RX) and [`PURGE_TX`](crate::ftdi::PURGE_TX).
    Reset = 0,
    /// Sets the lines RTS and DTR.
    ModemControl = 1,
    /// Sets the flow control.
    FlowControl = 2,
    /// Sets the speed, as a divisor.
    BaudRate = 3,
    /// Sets bits, parity and stop bits.
    DataFormat = 4,
    /// Sets after how many milliseconds the chip sends what it has.
    LatencyTimer = 9,
}

impl Request {
    /// Its number on the wire.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}

/// The transfer that failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum Operation {
    #[error("setting up the serial chip")]
    Control,
    #[error("writing to the device")]
    Write,
    #[error("reading from the device")]
    Read,
}

/// What a transfer failed of.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum Fault {
    #[error("it took too long")]
    TimedOut,
    #[error("the endpoint stalled")]
    Stalled,
    #[error("a fault of the wire or of the protocol")]
    Wire,
    #[error("the operating system refused it")]
    Refused,
    #[error("error {0} of the operating system")]
    Other(u32),
}

/// A transfer that failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum TransportError {
    #[error("the device was unplugged; plug it in again and start anew")]
    Unplugged,
    #[error("{during} failed: {fault}")]
    Io { during: Operation, fault: Fault },
}
