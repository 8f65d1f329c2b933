//! Interface between the driver and the connection to a device, by USB or simulated.

use core::time::Duration;

use cohaptic_units::Instant;
use thiserror::Error;

/// Connection to a device with an FT232R, and a clock.
pub trait Transport {
    /// Returns the time on the transport's own clock, which begins at zero and never goes back.
    fn now(&self) -> Instant;

    /// Waits until the instant `until`; returns at once if it has passed.
    fn sleep_until(&mut self, until: Instant);

    /// Makes a control transfer to the chip: vendor request to the device, index 0, no data.
    ///
    /// # Errors
    ///
    /// [`TransportError`] if the transfer fails.
    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError>;

    /// Sends all bytes.
    ///
    /// # Errors
    ///
    /// [`TransportError`] if the transfer fails.
    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError>;

    /// Takes arrived bytes without the chip's status bytes, at most the length of `into`, and returns their number. Further bytes stay for the next call.
    /// Waits at most `patience` for the first byte. May return 0 earlier, because the chip sometimes sends an empty packet, but never without passing of
    /// time.
    ///
    /// # Errors
    ///
    /// [`TransportError`] if the transfer fails.
    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError>;
}

/// Requests to the chip, with their numbers on the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Request {
    /// Purges a buffer: `PURGE_RX` for what the device has sent, `PURGE_TX` for what it is sent.
    Reset = 0,
    /// Sets the lines RTS and DTR.
    ModemControl = 1,
    /// Sets the flow control.
    FlowControl = 2,
    /// Sets the speed, as a divisor.
    BaudRate = 3,
    /// Sets bits, parity and stop bits.
    DataFormat = 4,
    /// Sets the latency timer: the time \[ms\] after which the chip sends a packet that is not full.
    LatencyTimer = 9,
}

impl Request {
    /// Returns the number on the wire.
    #[must_use]
    pub(crate) const fn number(self) -> u8 {
        self as u8
    }
}

/// Failed transfer.
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

/// Reason for the failure of a transfer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
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

/// Error of a transfer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum TransportError {
    #[error("the device was unplugged; plug it in again and start anew")]
    Unplugged,
    #[error("{during} failed: {fault}")]
    Io { during: Operation, fault: Fault },
}
