//! State and figures of a connection, for the owner.

use core::time::Duration;

/// State of RFC 9293, section 3.3.2. LISTEN is missing, because listeners belong to the owner of the connections.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum State {
    /// This end's SYN was sent. No SYN of the peer has arrived.
    SynSent,
    /// The peer's SYN has arrived and was answered. The answer is not acknowledged.
    SynReceived,
    /// The handshake is over, and neither end has shut its half.
    Established,
    /// This end has shut its half. Its FIN is not acknowledged.
    FinWait1,
    /// This end's FIN is acknowledged. The peer may still send data.
    FinWait2,
    /// The peer has shut its half, and all of its data has arrived. This end may still send data.
    CloseWait,
    /// Both ends have shut their halves at the same time. This end's FIN is not acknowledged.
    Closing,
    /// The peer has shut its half, and this end has done so afterwards. This end's FIN is not acknowledged.
    LastAck,
    /// Both halves are shut. Late segments of the peer are still answered.
    TimeWait,
    /// The connection has ended or was never opened.
    Closed,
}

impl State {
    /// Returns whether the handshake is over and the connection has not ended.
    #[must_use]
    pub const fn is_synchronised(self) -> bool {
        !matches!(self, Self::SynSent | Self::SynReceived | Self::Closed)
    }

    /// Returns whether segments with data or FIN may still be sent, for the first time or again.
    pub(crate) const fn may_send(self) -> bool {
        matches!(self, Self::Established | Self::CloseWait | Self::FinWait1 | Self::Closing | Self::LastAck)
    }
}

/// Reaction of the sender to losses and marks of congestion (RFC 5681, 6582, 6675), by the names of Linux. The variants are ordered by severity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub enum CaState {
    /// No sign of a loss.
    #[default]
    Open,
    /// Segments have arrived out of order, or a duplicate acknowledgement has arrived.
    Disorder,
    /// The window shrinks because of a mark, or of a loss repaired by a tail probe (congestion window reduced).
    Cwr,
    /// Lost segments are sent again while the window shrinks.
    Recovery,
    /// The retransmission timer has run out.
    Loss,
}

/// Figures of a connection, after the example of Linux's `TCP_INFO`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct Info {
    /// State of the connection.
    pub state: State,
    /// Smoothed round trip (RFC 6298). `None` before the first sample.
    pub srtt: Option<Duration>,
    /// Variation of the round trip, RTTVAR (RFC 6298). Zero before the first sample.
    pub rttvar: Duration,
    /// Least round trip. A sample replaces a least round trip older than 300 s. `None` before the first sample.
    pub least_rtt: Option<Duration>,
    /// Retransmission timeout, with one doubling for each timeout since the last sample of the round trip.
    pub timeout: Duration,
    /// Congestion window \[segments\].
    pub congestion_window: u32,
    /// Threshold of slow start \[segments\]. `u32::MAX` before the first reduction and the first long pause.
    pub slow_start_threshold: u32,
    /// State of the reaction to losses (`tcpi_ca_state`).
    pub ca_state: CaState,
    /// Sent and unacknowledged segments (`tcpi_unacked`).
    pub unacked: u32,
    /// Unacknowledged segments that have arrived out of order (`tcpi_sacked`). Without selective acknowledgements, the number of duplicates.
    pub sacked: u32,
    /// Unacknowledged segments that count as lost (`tcpi_lost`).
    pub lost: u32,
    /// Lost segments whose repetition is on the way (`tcpi_retrans`).
    pub retrans: u32,
    /// Largest extent of a reordering so far \[segments\], from 3 to 300 (`tcpi_reordering`).
    pub reordering: u32,
    /// Sender's estimate of the number of segments on the way: `unacked` + `retrans` − `sacked` − `lost`.
    pub in_flight: u32,
    /// Segments sent again since the connection began, SYNs included.
    pub retransmissions: u64,
    /// Retransmission timeouts since the end of the handshake.
    pub timeouts: u64,
    /// Number of recoveries.
    pub recoveries: u64,
    /// Number of reductions of the window taken back because nothing had been lost.
    pub undone: u64,
    /// Largest amount of data per segment at present, apart from the room for selective acknowledgements \[byte\].
    pub segment_size: usize,
    /// Window offered by the peer, from the first unacknowledged octet on \[byte\].
    pub send_window: u64,
    /// Octets written by the program and not acknowledged by the peer, sent or not.
    pub unacknowledged: usize,
    /// Octets in order, not yet read by the program.
    pub unread: usize,
    /// Probes of the peer's closed window since an acknowledgement last opened the window.
    pub window_probes: u32,
}
