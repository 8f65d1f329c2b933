//! The options of a stream.

use std::io;
use std::time::Duration;

use super::{Keepalive, TcpStream};

/// Checks a time to live.
pub(super) fn ttl(ttl: u32) -> io::Result<u8> {
    u8::try_from(ttl)
        .ok()
        .filter(|ttl| *ttl > 0)
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, format!("{ttl} is none; expected 1 to 255")))
}

impl TcpStream {
    /// Whether small segments leave while others are unanswered (`TCP_NODELAY`).
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn nodelay(&self) -> io::Result<bool> {
        self.open_alive(|core| core.connection(self.id).nodelay())
    }

    /// Lets small segments leave while others are unanswered, or holds them back by Nagle's algorithm. What was held back leaves.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_nodelay(&self, nodelay: bool) -> io::Result<()> {
        self.change(|_, connection| connection.set_nodelay(nodelay))
    }

    /// Whether acknowledgements leave at once now (`TCP_QUICKACK`).
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn quickack(&self) -> io::Result<bool> {
        self.open_alive(|core| core.connection(self.id).quickack())
    }

    /// Acknowledges at once from now on, or lets acknowledgements wait. As in Linux, it does not stay so.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_quickack(&self, quickack: bool) -> io::Result<()> {
        self.change(|_, connection| connection.set_quickack(quickack))
    }

    /// What [`TcpStream::set_linger`] has set.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn linger(&self) -> io::Result<Option<Duration>> {
        self.open_alive(|core| *core.linger(self.id))
    }

    /// With zero, the connection is reset when the stream is dropped. Another time is kept and does nothing: to drop a stream takes no time here. Rounded down to
    /// seconds, as with Linux.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_linger(&self, linger: Option<Duration>) -> io::Result<()> {
        self.open_alive(|core| *core.linger(self.id) = linger.map(|linger| Duration::from_secs(linger.as_secs())))
    }

    /// Lets the connection be reset when the stream is dropped.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_zero_linger(&self) -> io::Result<()> {
        self.set_linger(Some(Duration::ZERO))
    }

    /// The time to live, which nothing counts down here: there are no routers.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn ttl(&self) -> io::Result<u32> {
        self.open_alive(|core| core.connection(self.id).config().ttl.into())
    }

    /// Sets the time to live, from 1 to 255.
    ///
    /// # Errors
    ///
    /// If it is none, or its host has crashed.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        let ttl = self::ttl(ttl)?;
        self.change(|_, connection| connection.set_ttl(ttl))
    }

    /// Probes the peer while nothing is sent, at these times, or does not (`SO_KEEPALIVE`, `TCP_KEEPIDLE`, `TCP_KEEPINTVL`, `TCP_KEEPCNT`): with tokio this takes
    /// `socket2`.
    ///
    /// # Errors
    ///
    /// If a time is zero, or its host has crashed.
    pub fn set_keepalive_times(&self, keepalive: Option<Keepalive>) -> io::Result<()> {
        if keepalive.is_some_and(|keepalive| keepalive.idle.is_zero() || keepalive.interval.is_zero()) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a time of keep-alive probes is zero; expected one above zero"));
        }
        self.change(|now, connection| connection.set_keepalive(now, keepalive))
    }

    /// How long written data may stay unanswered before the connection is given up (`TCP_USER_TIMEOUT`, RFC 5482); `None`: as
    /// [`TcpConfig::retries`](super::TcpConfig::retries) says.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_user_timeout(&self, timeout: Option<Duration>) -> io::Result<()> {
        self.change(|_, connection| connection.set_user_timeout(timeout))
    }
}
