//! Errors of a connection, which the calls of the program return.

use core::fmt;

/// Reason for which a call on a [`Connection`](crate::Connection) failed. The variants have the names of `std::io::ErrorKind`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Error {
    /// No data can be read yet, or the send buffer has no room.
    WouldBlock,
    /// The peer refused the SYN with a RST.
    ConnectionRefused,
    /// The peer reset the connection.
    ConnectionReset,
    /// The peer did not answer for as long as the configuration allows.
    TimedOut,
    /// The write half is shut: the program has called `shutdown` or `close`, or the connection has ended.
    BrokenPipe,
    /// The connection is not established.
    NotConnected,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WouldBlock => f.write_str("the call would block"),
            Self::ConnectionRefused => f.write_str("connection refused"),
            Self::ConnectionReset => f.write_str("connection reset by peer"),
            Self::TimedOut => f.write_str("connection timed out"),
            Self::BrokenPipe => f.write_str("broken pipe"),
            Self::NotConnected => f.write_str("not connected"),
        }
    }
}

impl core::error::Error for Error {}
