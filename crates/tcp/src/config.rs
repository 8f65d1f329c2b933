//! Every constant of a connection.

use core::fmt;
use core::time::Duration;

/// The constants of a connection. [`TcpConfig::default`] is Linux 6, [`TcpConfig::textbook`] what books teach.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TcpConfig {
    /// The longest IP packet that is sent \[byte\]. Linux has 65,536 on the loopback interface. Default 1500.
    pub mtu: usize,
    /// The time to live, or hop limit. Default 64.
    pub ttl: u8,
    /// The sequence number of the SYN; `None`: the one handed to the constructor. Default `None`.
    pub initial_sequence: Option<u32>,
    /// The congestion window at the beginning \[segments\] (RFC 6928). Default 10.
    pub initial_window: u32,
    /// How the window grows and shrinks. Default CUBIC.
    pub congestion: CongestionControl,
    /// Selective acknowledgements (RFC 2018, 2883). Default on.
    pub sack: bool,
    /// Loss detection by time (RFC 8985); without it, by three duplicates (RFC 6675). Needs `sack`. Default on.
    pub rack: bool,
    /// Tail loss probes (RFC 8985). Needs `sack`. Default on.
    pub tail_loss_probe: bool,
    /// Timestamps (RFC 7323). Default on.
    pub timestamps: bool,
    /// Explicit congestion notification (RFC 3168), asked for and granted. Default off.
    pub ecn: bool,
    /// When a connection that asks for ECN goes on without, since a box on the way takes such a SYN for an attack. Default: when a SYN is lost.
    pub ecn_fallback: EcnFallback,
    /// The retransmission timeout before a round trip is known. Default 1 s.
    pub initial_timeout: Duration,
    /// The least of 4·RTTVAR in a timeout SRTT + 4·RTTVAR. Default 200 ms.
    pub least_variance: Duration,
    /// The least timeout. Default zero, since `least_variance` bounds it.
    pub least_timeout: Duration,
    /// The greatest timeout, also between probes of a closed window. Default 120 s.
    pub greatest_timeout: Duration,
    /// How often a SYN is repeated before the connection is given up. Default 6: 127 s.
    pub syn_retries: u32,
    /// How many of these come at equal distance before the distance doubles. Linux 6.5 and later have 4. Default 0.
    pub linear_syn_retries: u32,
    /// How often a SYN with ACK is repeated. Default 5: 63 s.
    pub syn_ack_retries: u32,
    /// After how many timeouts of 200 ms, each twice the one before up to `greatest_timeout`, data is given up that nobody answers. Default 15: 924.6 s.
    pub retries: u32,
    /// The same for a connection whose program has dropped it. Default 8.
    pub orphan_retries: u32,
    /// How long data may stay unanswered (RFC 5482); `None`: as `retries` says. Default `None`.
    pub user_timeout: Option<Duration>,
    /// How long an acknowledgement may wait. Default 40 ms.
    pub delayed_ack: Duration,
    /// How many acknowledgements at the beginning do not wait. Default 16.
    pub quick_acks: u32,
    /// How long TIME-WAIT lasts, and FIN-WAIT-2 of a dropped connection. Default 60 s.
    pub time_wait: Duration,
    /// The largest receive buffer, and so window \[byte\]. Default 6 MiB.
    pub receive_buffer: usize,
    /// The largest send buffer \[byte\]. Default 4 MiB.
    pub send_buffer: usize,
    /// The send buffer to begin with \[byte\]; later it is twice the congestion window if that is more. Default 64 KiB.
    pub least_send_buffer: usize,
    /// Whether small segments leave while others are unanswered, without Nagle's algorithm. Default off.
    pub nodelay: bool,
    /// Whether an idle connection is probed. Default `None`.
    pub keepalive: Option<Keepalive>,
    /// Whether the congestion window shrinks while the program sends nothing (RFC 2861). Default on.
    pub slow_start_after_idle: bool,
}

/// How the congestion window grows and shrinks.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum CongestionControl {
    /// CUBIC (RFC 9438).
    #[default]
    Cubic,
    /// Reno (RFC 5681) with NewReno's recovery (RFC 6582) where there are no selective acknowledgements.
    Reno,
}

/// When a SYN that asks for ECN is followed by one that does not (RFC 3168, section 6.1.1.1).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum EcnFallback {
    /// Every SYN asks.
    Never,
    /// Only the first SYN asks: nobody answered it. This is Linux with `tcp_ecn_fallback`.
    #[default]
    Lost,
    /// The same, and a reset that answers a SYN which asks is no refusal yet: a SYN that does not ask follows at once.
    LostOrReset,
}

/// The times of keep-alive probes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Keepalive {
    /// How long nothing must have arrived before the first probe. Default 7200 s.
    pub idle: Duration,
    /// The time between probes. Default 75 s.
    pub interval: Duration,
    /// After how many unanswered probes the connection is given up. Default 9.
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
            linear_syn_retries: 0,
            syn_ack_retries: 5,
            retries: 15,
            orphan_retries: 8,
            user_timeout: None,
            delayed_ack: Duration::from_millis(40),
            quick_acks: 16,
            time_wait: Duration::from_secs(60),
            receive_buffer: 6 << 20,
            send_buffer: 4 << 20,
            least_send_buffer: 64 << 10,
            nodelay: false,
            keepalive: None,
            slow_start_after_idle: true,
        }
    }
}

/// Why a [`TcpConfig`] cannot be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ConfigError {
    /// An MTU below 128: headers of IPv6 and TCP with all options take 100 octets.
    Mtu(usize),
    /// A count, size or time that must not be zero.
    Zero(&'static str),
    /// A least above a greatest.
    Order(&'static str, &'static str),
    /// A receive buffer beyond 1 GiB, the largest window (RFC 7323, section 2.3).
    ReceiveBuffer(usize),
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mtu(octets) => write!(f, "the MTU {octets} is below 128 bytes"),
            Self::Zero(name) => write!(f, "{name} is zero"),
            Self::Order(least, greatest) => write!(f, "{least} is above {greatest}"),
            Self::ReceiveBuffer(octets) => write!(f, "the receive buffer {octets} is above 1 GiB"),
        }
    }
}

impl core::error::Error for ConfigError {}

impl TcpConfig {
    /// TCP as in books: Reno with NewReno, an initial window of 3 segments, timeouts of at least 1 s, no selective acknowledgements, timestamps or tail
    /// loss probes. Where ECN is asked for, a reset is answered without, as RFC 3168 says and Linux does not.
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
            ..Self::default()
        }
    }

    /// Checks that the constants can be.
    ///
    /// # Errors
    ///
    /// Names the first one that cannot.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.mtu < 128 {
            return Err(ConfigError::Mtu(self.mtu));
        }
        let keepalive = self.keepalive.unwrap_or_default();
        let zeros = [
            ("ttl", self.ttl == 0),
            ("initial_window", self.initial_window == 0),
            ("initial_timeout", self.initial_timeout.is_zero()),
            ("receive_buffer", self.receive_buffer == 0),
            ("least_send_buffer", self.least_send_buffer == 0),
            ("the interval of keep-alive probes", keepalive.interval.is_zero()),
            ("the idle time before keep-alive probes", keepalive.idle.is_zero()),
            ("least_variance and least_timeout", self.least_variance.is_zero() && self.least_timeout.is_zero()),
        ];
        if let Some((name, _)) = zeros.iter().find(|(_, is_zero)| *is_zero) {
            return Err(ConfigError::Zero(name));
        }
        if self.receive_buffer > 1 << 30 {
            return Err(ConfigError::ReceiveBuffer(self.receive_buffer));
        }
        let pairs = [
            ("least_timeout", "greatest_timeout", self.least_timeout > self.greatest_timeout),
            ("initial_timeout", "greatest_timeout", self.initial_timeout > self.greatest_timeout),
            ("least_send_buffer", "send_buffer", self.least_send_buffer > self.send_buffer),
        ];
        match pairs.iter().find(|(.., is_wrong)| *is_wrong) {
            Some((least, greatest, _)) => Err(ConfigError::Order(least, greatest)),
            None => Ok(()),
        }
    }

    /// The largest payload and options together that an IP packet leaves \[byte\].
    pub(crate) fn segment_room(&self, is_ipv4: bool) -> usize {
        self.mtu.min(65_535) - if is_ipv4 { 40 } else { 60 }
    }

    /// By how many bits windows are shifted, so that the whole receive buffer can be said.
    pub(crate) fn window_scale(&self) -> u8 {
        (0..14).find(|shift| self.receive_buffer >> shift <= 65_535).unwrap_or(14)
    }
}
