//! Options of sockets, set by programs through descriptors.

use std::io;
use std::time::Duration;

use crate::Version;

/// Option of a socket with its value. Sizes of buffers are sizes in the sense of Linux: twice the size given by a program.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Setting {
    /// `TCP_NODELAY`.
    NoDelay(bool),
    /// `SO_KEEPALIVE` with its times; `None` if the option is off.
    Keepalive(Option<KeepaliveTimes>),
    /// `SO_LINGER`.
    Linger(Option<Duration>),
    /// `TCP_USER_TIMEOUT`; `None` if the system decides.
    UserTimeout(Option<Duration>),
    /// `SO_RCVBUF` \[byte\].
    ReceiveBuffer(u32),
    /// `SO_SNDBUF` \[byte\].
    SendBuffer(u32),
    /// Type of service of IPv4, or traffic class of IPv6.
    TypeOfService(u32),
    /// Time to live of IPv4, or hop limit of IPv6.
    Ttl(u32),
    /// `SO_REUSEADDR`.
    ReuseAddress(bool),
    /// `SO_REUSEPORT`.
    ReusePort(bool),
    /// `IPV6_V6ONLY`.
    OnlyV6(bool),
    /// `SO_BROADCAST`.
    Broadcast(bool),
    /// `IP_MULTICAST_TTL`.
    MulticastTtl(u32),
    /// `IPV6_MULTICAST_HOPS`.
    MulticastHops(u32),
    /// `IP_MULTICAST_LOOP`.
    MulticastLoop4(bool),
    /// `IPV6_MULTICAST_LOOP`.
    MulticastLoop6(bool),
}

/// Times of keep-alive probes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KeepaliveTimes {
    /// Time without an arrived segment after which the first probe leaves (`TCP_KEEPIDLE`).
    pub idle: Duration,
    /// Time between two probes (`TCP_KEEPINTVL`).
    pub interval: Duration,
    /// Number of unanswered probes after which the connection ends (`TCP_KEEPCNT`).
    pub probes: u32,
}

/// Socket with options that can be set one by one.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the methods names the errors")]
pub trait Configured {
    /// Returns the version of IP with which the socket was made.
    fn version(&self) -> Version;
    /// Returns the options that a new socket of the system would not have. Fails as all methods of the socket do.
    fn settings(&self) -> io::Result<Vec<Setting>>;
    /// Sets an option. An option of another kind of socket, or an option without an effect in a test bed, is accepted. Fails as all methods of the socket do,
    /// and if the value is out of range.
    fn set(&self, setting: Setting) -> io::Result<()>;
}
