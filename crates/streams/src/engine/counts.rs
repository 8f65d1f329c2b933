//! Counters of proxies and lines.

/// Counters of a proxy.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Connections of clients.
    pub opened: u64,
    /// Connections refused by the program or by the system. The client was reset.
    pub refused: u64,
    /// Connections with an end after the end of both streams.
    pub ended: u64,
    /// Connections reset by an end.
    pub reset: u64,
    /// Connections closed by `close-after`.
    pub closed_after: u64,
    /// Connections reset by `reset-after`.
    pub reset_after: u64,
    /// Connections closed by `cut-after`.
    pub cut_after: u64,
}

/// Counters of a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LineCounts {
    /// Bytes received from the senders.
    pub received: u64,
    /// Bytes written to the receivers.
    pub sent: u64,
    /// Bytes without a receiver: cut, or held by a closed or reset connection.
    pub lost: u64,
}
