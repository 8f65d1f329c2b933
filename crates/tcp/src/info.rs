//! What a connection tells about itself.

use core::time::Duration;

/// The states of RFC 9293, section 3.3.2, apart from LISTEN, which is the listener's.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum State {
    /// The SYN is out.
    SynSent,
    /// A SYN has come and was answered.
    SynReceived,
    /// Data flows both ways.
    Established,
    /// This side has shut its half; the FIN is not acknowledged.
    FinWait1,
    /// The FIN is acknowledged; the peer may send on.
    FinWait2,
    /// The peer has shut its half.
    CloseWait,
    /// Both have shut at once; the FIN is not acknowledged.
    Closing,
    /// The peer has shut its half and then this side; the FIN is not acknowledged.
    LastAck,
    /// Both are shut; late segments are answered.
    TimeWait,
    /// Nothing is left.
    Closed,
}

impl State {
    /// Whether the handshake is over and the connection not gone.
    #[must_use]
    pub const fn is_synchronised(self) -> bool {
        !matches!(self, Self::SynSent | Self::SynReceived | Self::Closed)
    }

    /// Whether data may still be sent or sent again.
    pub(crate) const fn may_send(self) -> bool {
        matches!(self, Self::Established | Self::CloseWait | Self::FinWait1 | Self::Closing | Self::LastAck)
    }
}

/// Figures of a connection, as of Linux's `TCP_INFO`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct Info {
    /// The state.
    pub state: State,
    /// The smoothed round trip (RFC 6298); `None` before the first.
    pub srtt: Option<Duration>,
    /// Its variation.
    pub rttvar: Duration,
    /// The least round trip of the last 300 s.
    pub least_rtt: Option<Duration>,
    /// The retransmission timeout, doubled as often as it has run out.
    pub timeout: Duration,
    /// The congestion window \[segments\].
    pub congestion_window: u32,
    /// The threshold of slow start \[segments\]; `u32::MAX` before the first loss.
    pub slow_start_threshold: u32,
    /// Segments on the way, by the sender's estimate.
    pub in_flight: u32,
    /// Segments sent again, since the connection began.
    pub retransmissions: u64,
    /// Timeouts, since the connection began.
    pub timeouts: u64,
    /// How often recovery was entered.
    pub recoveries: u64,
    /// How often a recovery was taken back, because nothing had been lost.
    pub undone: u64,
    /// The most data that a segment carries now \[byte\].
    pub segment_size: usize,
    /// The peer's window \[byte\].
    pub send_window: u64,
    /// Octets written and not acknowledged.
    pub unacknowledged: usize,
    /// Octets received and not read.
    pub unread: usize,
    /// Probes of a closed window that were sent since it closed.
    pub window_probes: u32,
}
