//! What goes wrong on a connection.

/// Why a call on a [`Connection`](crate::Connection) did not do what it was asked for. The names are those of `std::io::ErrorKind`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is nothing to read yet, or no room to write.
    #[error("the call would block")]
    WouldBlock,
    /// The peer refused the SYN with a RST.
    #[error("connection refused")]
    ConnectionRefused,
    /// The peer reset the connection.
    #[error("connection reset by peer")]
    ConnectionReset,
    /// The peer did not answer for as long as the configuration allows.
    #[error("connection timed out")]
    TimedOut,
    /// The write half is shut, by this side or because the connection is gone.
    #[error("broken pipe")]
    BrokenPipe,
    /// The connection is not established.
    #[error("not connected")]
    NotConnected,
}
