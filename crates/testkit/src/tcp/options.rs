//! Options of a stream.

use std::io;
use std::time::Duration;

use super::{Keepalive, TcpStream};
use crate::errno::Errno;

/// Converts a time to live, which must be from 1 to 255.
pub(super) fn ttl(ttl: u32) -> io::Result<u8> {
    u8::try_from(ttl).ok().filter(|ttl| *ttl > 0).ok_or_else(|| Errno::InvalidInput.into())
}

impl TcpStream {
    /// Returns whether small segments leave while earlier segments are not acknowledged (`TCP_NODELAY`).
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn nodelay(&self) -> io::Result<bool> {
        self.open_alive(|core| core.connection(self.id).nodelay())
    }

    /// Sets whether small segments leave while earlier segments are not acknowledged. If not, Nagle's algorithm holds small segments back. Turning the option
    /// on sends the segments that were held back.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn set_nodelay(&self, nodelay: bool) -> io::Result<()> {
        self.change(|_, connection| connection.set_nodelay(nodelay))
    }

    /// Returns whether acknowledgements leave at once now (`TCP_QUICKACK`).
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn quickack(&self) -> io::Result<bool> {
        self.open_alive(|core| core.connection(self.id).quickack())
    }

    /// Sets whether acknowledgements leave at once from now on. As in Linux, TCP may change this by itself later.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn set_quickack(&self, quickack: bool) -> io::Result<()> {
        self.change(|_, connection| connection.set_quickack(quickack))
    }

    /// Returns the time set by [`TcpStream::set_linger`].
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn linger(&self) -> io::Result<Option<Duration>> {
        self.open_alive(|core| *core.linger(self.id))
    }

    /// Sets the linger time, rounded down to seconds as with Linux. With zero, the connection is reset when the stream is dropped. Another time is stored
    /// without effect, because dropping a stream takes no time here.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn set_linger(&self, linger: Option<Duration>) -> io::Result<()> {
        self.open_alive(|core| *core.linger(self.id) = linger.map(|linger| Duration::from_secs(linger.as_secs())))
    }

    /// Makes the connection be reset when the stream is dropped.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn set_zero_linger(&self) -> io::Result<()> {
        self.set_linger(Some(Duration::ZERO))
    }

    /// Returns the time to live of packets. The time to live has no effect, because a test bed has no routers that count it down.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn ttl(&self) -> io::Result<u32> {
        self.open_alive(|core| core.connection(self.id).config().ttl.into())
    }

    /// Sets the time to live of packets, from 1 to 255. The time to live is in the packets and in captures, and has no other effect: see [`TcpStream::ttl`].
    ///
    /// # Errors
    ///
    /// If `ttl` is out of range, or the host of the stream has crashed.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        let ttl = self::ttl(ttl)?;
        self.change(|_, connection| connection.set_ttl(ttl))
    }

    /// Sets the times of keep-alive probes for a connection without data (`SO_KEEPALIVE`, `TCP_KEEPIDLE`, `TCP_KEEPINTVL`, `TCP_KEEPCNT`). `None` turns probing
    /// off. With tokio these options need `socket2`.
    ///
    /// # Errors
    ///
    /// If a time is zero, or the host of the stream has crashed.
    pub fn set_keepalive_times(&self, keepalive: Option<Keepalive>) -> io::Result<()> {
        if keepalive.is_some_and(|keepalive| keepalive.idle.is_zero() || keepalive.interval.is_zero()) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a time of keep-alive probes is zero; expected a time above zero"));
        }
        self.change(|now, connection| connection.set_keepalive(now, keepalive))
    }

    /// Sets how long written data may stay unacknowledged before the connection is given up (`TCP_USER_TIMEOUT`, RFC 5482). With `None`,
    /// [`TcpConfig::retries`](super::TcpConfig::retries) decides.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn set_user_timeout(&self, timeout: Option<Duration>) -> io::Result<()> {
        self.change(|_, connection| connection.set_user_timeout(timeout))
    }
}
