//! Error of a driver.

use core::time::Duration;

use thiserror::Error;

use super::DriverConfigError;
use crate::transport::TransportError;

/// Reason why a driver cannot go on.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum DriverError {
    /// A number of the configuration is out of range.
    #[error(transparent)]
    Config(#[from] DriverConfigError),
    /// The transport failed.
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error("the device has not answered for {silence:?}: is its firmware loaded, and its power supply plugged in?")]
    Silent { silence: Duration },
}
