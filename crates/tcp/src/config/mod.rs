//! Constants of a connection and their defaults.

mod check;

use core::time::Duration;

pub use check::ConfigError;

/// Constants of a connection. [`TcpConfig::default`] has the values of Linux 6, [`TcpConfig::textbook`] the values of textbooks.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TcpConfig {
    /// Length of the longest IP packet sent \[byte\], at least 128. Linux uses 65,536 on the loopback interface. Default 1500.
    pub mtu: usize,
    /// Time to live (IPv4) or hop limit (IPv6) of the packets, not zero. Default 64.
    pub ttl: u8,
    /// Sequence number of the SYN. `None` selects the `initial_sequence` given to the constructor. Default `None`.
    pub initial_sequence: Option<u32>,
    /// Congestion window at the beginning \[segments\] (RFC 6928), not zero. Default 10.
    pub initial_window: u32,
    /// Algorithm that changes the congestion window. Default CUBIC.
    pub congestion: CongestionControl,
    /// `true` if the SYN offers selective acknowledgements (RFC 2018, 2883). Default on.
    pub sack: bool,
    /// `true` if losses are detected by time (RFC 8985). Otherwise three segments that arrived later tell of a loss (RFC 6675). Needs `sack`. Default on.
    pub rack: bool,
    /// `true` if the sender sends tail loss probes (RFC 8985). Needs `sack`. Default on.
    pub tail_loss_probe: bool,
    /// `true` if the SYN offers timestamps (RFC 7323). Default on.
    pub timestamps: bool,
    /// `true` if the SYN asks for explicit congestion notification (RFC 3168), and an answer to a SYN grants it. Default off. DCTCP always asks.
    pub ecn: bool,
    /// Condition under which a connection with `ecn` continues without ECN, because a middlebox may drop or refuse a SYN with ECN. Default: when a SYN
    /// is lost.
    pub ecn_fallback: EcnFallback,
    /// Retransmission timeout before the first sample of the round trip, not zero. Default 1 s.
    pub initial_timeout: Duration,
    /// Lower bound of the term 4·RTTVAR in the timeout SRTT + 4·RTTVAR. Default 200 ms.
    pub least_variance: Duration,
    /// Lower bound of the retransmission timeout. Default zero, because `least_variance` already bounds the timeout.
    pub least_timeout: Duration,
    /// Upper bound of the retransmission timeout and of the time between two probes of a closed window. Default 120 s.
    pub greatest_timeout: Duration,
    /// Number of repetitions of a SYN, beside those at equal distance, before the connection ends with [`Error::TimedOut`](crate::Error::TimedOut). The
    /// connection also ends once 2^(`syn_retries` + 1) − 1 times `initial_timeout` have passed. Default 6: SYNs after 0, 1, 2, 3, 4, 5, 7, 11, 19, 35 and
    /// 67 s, and the end after 131 s.
    pub syn_retries: u32,
    /// Number of further repetitions of a SYN, at equal distance, before the distance doubles. Linux before 6.5 has 0. Default 4.
    pub linear_syn_retries: u32,
    /// Number of repetitions of a SYN with ACK before the connection ends. Default 5, that is, 63 s.
    pub syn_ack_retries: u32,
    /// Limit for unanswered data, given as a number of doublings. The connection ends if the time since the first timeout reaches the sum of `retries` + 1
    /// timeouts, of which the first is 200 ms and each other timeout is twice the timeout before, up to `greatest_timeout`. Also the number of unanswered
    /// probes of a closed window that ends the connection. Default 15, that is, 924.6 s.
    pub retries: u32,
    /// Limit like `retries` for a connection closed by the program; the smaller of the two limits counts. Default 8.
    pub orphan_retries: u32,
    /// Time for which data may stay unanswered (RFC 5482). `None` leaves the limit to `retries`. Default `None`.
    pub user_timeout: Option<Duration>,
    /// Longest delay of an acknowledgement. Default 40 ms.
    pub delayed_ack: Duration,
    /// Number of acknowledgements without delay, at the beginning, after a pause of the peer and after a duplicate. Default 16.
    pub quick_acks: u32,
    /// Length of TIME-WAIT, and of FIN-WAIT-2 once the program has closed the connection. Default 60 s.
    pub time_wait: Duration,
    /// Size of a receive buffer that stays \[byte\], from 1 to 1 GiB. All of the buffer is offered as window from the beginning. With `None`, window and buffer
    /// are those of Linux: the buffer counts the memory of whole segments, and grows from `least_receive_buffer` to `greatest_receive_buffer` as the program
    /// reads; the window grows with the full segments that arrive. Default `None`.
    pub receive_buffer: Option<usize>,
    /// Size of the receive buffer at the beginning \[byte\], not zero (`tcp_rmem[1]`). Default 128 KiB.
    pub least_receive_buffer: usize,
    /// Upper bound of the receive buffer \[byte\], up to 1 GiB (`tcp_rmem[2]`). Default 6 MiB, as in Linux before 6.19.
    pub greatest_receive_buffer: usize,
    /// Upper bound of the send buffer \[byte\]. Default 4 MiB.
    pub send_buffer: usize,
    /// Lower bound of the send buffer \[byte\], not zero. The buffer has the memory that Linux plans for twice the congestion window, 4608 octets for each
    /// segment of 1448, but at least for ten segments, and never shrinks. Default 16 KiB.
    pub least_send_buffer: usize,
    /// `true` if Nagle's algorithm is off, so that a small segment leaves while another small segment is unacknowledged. Default off.
    pub nodelay: bool,
    /// Times of the probes of an idle connection. `None` sends no probes. Default `None`.
    pub keepalive: Option<Keepalive>,
    /// `true` if CUBIC leaves slow start before a loss, when acknowledgements or round trips tell that the path is full (`HyStart`). Default on.
    pub hystart: bool,
    /// `true` if the congestion window shrinks while the program sends nothing (RFC 2861). Default on.
    pub slow_start_after_idle: bool,
}

/// Algorithm by which the congestion window grows and shrinks.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[non_exhaustive]
pub enum CongestionControl {
    /// CUBIC (RFC 9438).
    #[default]
    Cubic,
    /// Reno (RFC 5681). Without selective acknowledgements, recovery follows NewReno (RFC 6582).
    Reno,
    /// DCTCP (RFC 8257), a scalable congestion control: the window shrinks by half of the share of marked segments, once a round. Losses and growth are
    /// those of Reno. Needs ECN, and asks for ECN whatever [`TcpConfig::ecn`] says; without ECN it is Reno.
    ///
    /// All segments carry ECT(1), as TCP Prague sends, so that a queue with two classes knows the sender as scalable (RFC 9331); `dctcp` of Linux sends ECT(0).
    /// The window grows with unmarked segments in the round of a reduction too, as with TCP Prague; `dctcp` of Linux lets it rest for this round.
    ///
    /// The receiver of the data must have DCTCP as well. It then reports the mark of each segment (RFC 8257, section 3.2): ECE is set while arriving segments
    /// are marked, and each change is acknowledged at once. A receiver of RFC 3168 repeats ECE until the sender has answered, so the sender would see a whole
    /// round as marked. Accurate ECN (RFC 9768) is not implemented.
    Dctcp,
}

/// Condition under which a SYN without ECN follows a SYN with ECN (RFC 3168, section 6.1.1.1).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum EcnFallback {
    /// Every SYN asks for ECN.
    Never,
    /// The first SYN asks for ECN, and no later SYN does. Linux does so with `tcp_ecn_fallback`.
    #[default]
    Lost,
    /// Like [`Lost`](Self::Lost). In addition, a reset in answer to a SYN with ECN does not end the connection: a SYN without ECN follows at once.
    LostOrReset,
}

/// Times of keep-alive probes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Keepalive {
    /// Time without an arrived segment after which the first probe leaves, not zero. Default 7200 s.
    pub idle: Duration,
    /// Time between two probes, not zero. Default 75 s.
    pub interval: Duration,
    /// Number of unanswered probes after which the connection ends. Default 9.
    pub probes: u32,
}

impl Default for Keepalive {
    fn default() -> Self {
        Self { idle: Duration::from_secs(7200), interval: Duration::from_secs(75), probes: 9 }
    }
}

impl Default for TcpConfig {
    fn default() -> Self {
        Self {
            mtu: 1500,
            ttl: 64,
            initial_sequence: None,
            initial_window: 10,
            congestion: CongestionControl::Cubic,
            sack: true,
            rack: true,
            tail_loss_probe: true,
            timestamps: true,
            ecn: false,
            ecn_fallback: EcnFallback::Lost,
            initial_timeout: Duration::from_secs(1),
            least_variance: Duration::from_millis(200),
            least_timeout: Duration::ZERO,
            greatest_timeout: Duration::from_secs(120),
            syn_retries: 6,
            linear_syn_retries: 4,
            syn_ack_retries: 5,
            retries: 15,
            orphan_retries: 8,
            user_timeout: None,
            delayed_ack: Duration::from_millis(40),
            quick_acks: 16,
            time_wait: Duration::from_secs(60),
            receive_buffer: None,
            least_receive_buffer: 128 << 10,
            greatest_receive_buffer: 6 << 20,
            send_buffer: 4 << 20,
            least_send_buffer: 16 << 10,
            nodelay: false,
            keepalive: None,
            hystart: true,
            slow_start_after_idle: true,
        }
    }
}

impl TcpConfig {
    /// Returns TCP as in textbooks: Reno with NewReno, an initial window of 3 segments, timeouts of at least 1 s, a fixed window, no selective
    /// acknowledgements, no timestamps and no tail loss probes. If ECN is on, a SYN without ECN follows a reset, as RFC 3168 says and Linux does not.
    #[must_use]
    pub fn textbook() -> Self {
        Self {
            initial_window: 3,
            congestion: CongestionControl::Reno,
            ecn_fallback: EcnFallback::LostOrReset,
            sack: false,
            rack: false,
            tail_loss_probe: false,
            timestamps: false,
            least_variance: Duration::ZERO,
            least_timeout: Duration::from_secs(1),
            quick_acks: 0,
            linear_syn_retries: 0,
            receive_buffer: Some(6 << 20),
            ..Self::default()
        }
    }

    /// Returns whether a SYN asks for ECN, and an answer to a SYN grants it.
    pub(crate) fn wants_ecn(&self) -> bool {
        self.ecn || self.congestion == CongestionControl::Dctcp
    }

    /// Returns the octets that an IP packet of the MTU leaves for TCP options and payload together.
    pub(crate) fn segment_room(&self, is_ipv4: bool) -> usize {
        // Headers without options: 20 octets of IPv4 or 40 of IPv6, and 20 of TCP. `check` has refused an MTU below 128, so nothing underflows.
        self.mtu.min(65_535) - if is_ipv4 { 40 } else { 60 }
    }

    /// Returns the number of bits by which offered windows are shifted, 0 to 14: the least shift with which 16 bits can express the whole receive buffer.
    pub(crate) fn window_scale(&self) -> u8 {
        (0..14).find(|shift| self.largest_window() >> shift <= 65_535).unwrap_or(14)
    }

    /// Returns the largest window that this end may offer \[byte\].
    fn largest_window(&self) -> usize {
        self.receive_buffer.unwrap_or(self.greatest_receive_buffer)
    }
}
