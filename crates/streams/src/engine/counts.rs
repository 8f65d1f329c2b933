//! Counters of proxies and lines.

/// Counters of a proxy.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Connections of clients.
    pub opened: u64,
    /// Connections that the program refused or that could not be made. The client was reset.
    pub refused: u64,
    /// Connections at whose end both streams had ended.
    pub ended: u64,
    /// Connections that an end reset.
    pub reset: u64,
    /// Connections closed by `close-after`.
    pub closed_after: u64,
    /// Connections reset by `reset-after`.
    pub reset_after: u64,
    /// Connections closed by `cut-after`.
    pub cut_after: u64,
}

/// Counters of one line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LineCounts {
    /// Bytes that came from the senders.
    pub received: u64,
    /// Bytes written to the receivers.
    pub sent: u64,
    /// Bytes that reached no receiver: cut, or held by a connection that was closed or reset.
    pub lost: u64,
}
