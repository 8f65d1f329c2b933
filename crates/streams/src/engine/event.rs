//! Ends of connections, and the requests of the engine to its driver.

use super::connection::ConnectionId;

/// End of a connection.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Side {
    /// Program beyond the listener of the relay.
    Client,
    /// Program at the address of the proxy.
    Server,
}

impl Side {
    /// Returns the other end.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Client => Self::Server,
            Self::Server => Self::Client,
        }
    }

    /// Returns the index of the direction from this end: 0 forth, 1 back.
    pub(super) const fn index(self) -> usize {
        match self {
            Self::Client => 0,
            Self::Server => 1,
        }
    }
}

/// Request of the engine to its driver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event {
    /// Bytes may be written to this end: see [`Engine::writable`](super::Engine::writable).
    Ready(ConnectionId, Side),
    /// All bytes for this end are written, and the other end has ended: no more bytes can be written to this end (`shutdown`).
    Finish(ConnectionId, Side),
    /// A fault ends the connection: no more bytes can be written to either end (`shutdown`). The driver reads on until [`Event::Close`].
    FinishBoth(ConnectionId),
    /// The connection is over, and the engine has forgotten it.
    Close(ConnectionId, Close),
}

/// Kind of the close of both sockets of a connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Close {
    /// After the end of both streams.
    Ordinary,
    /// By a reset to both ends.
    Reset,
}
