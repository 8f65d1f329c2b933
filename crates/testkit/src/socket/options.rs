//! The options of a socket, and the ways of tokio's that wait for readiness.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr};
use std::sync::atomic::{AtomicU32, Ordering};

#[cfg(feature = "tokio-net")]
use super::KIND;
use super::UdpSocket;

/// Options that are kept and told. Of these, only the two lowest bits of a type of service do anything: see [`UdpSocket::set_tos_v4`].
#[derive(Debug)]
pub(super) struct Options {
    ttl: AtomicU32,
    type_of_service: AtomicU32,
    multicast_ttl: AtomicU32,
    multicast_loop: AtomicU32,
}

impl Default for Options {
    /// As Linux gives them.
    fn default() -> Self {
        Self { ttl: 64.into(), type_of_service: 0.into(), multicast_ttl: 1.into(), multicast_loop: 1.into() }
    }
}

impl Options {
    /// Whether datagrams sent may be marked in place of being dropped: the two bits of ECN (RFC 3168) are not both zero.
    pub(super) fn is_ecn_capable(&self) -> bool {
        self.type_of_service.load(Ordering::Relaxed) & 0b11 != 0
    }
}

fn set(option: &AtomicU32, value: u32, allowed: std::ops::RangeInclusive<u32>) -> io::Result<()> {
    if !allowed.contains(&value) {
        let text = format!("{value} is none; expected {} to {}", allowed.start(), allowed.end());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    option.store(value, Ordering::Relaxed);
    Ok(())
}

fn no_groups<T>() -> io::Result<T> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "a test bed has no multicast groups; send to each host, or broadcast"))
}

impl UdpSocket {
    fn option(&self, option: impl FnOnce(&Options) -> &AtomicU32) -> io::Result<u32> {
        self.open(|_| ())?;
        Ok(option(&self.options).load(Ordering::Relaxed))
    }

    fn set_option(&self, option: impl FnOnce(&Options) -> &AtomicU32, value: u32, allowed: std::ops::RangeInclusive<u32>) -> io::Result<()> {
        self.open(|_| ())?;
        set(option(&self.options), value, allowed)
    }

    /// The time to live, which nothing counts down here: there are no routers.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn ttl(&self) -> io::Result<u32> {
        self.option(|options| &options.ttl)
    }

    /// Sets the time to live, from 1 to 255.
    ///
    /// # Errors
    ///
    /// If it is none, or its host has crashed.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        self.set_option(|options| &options.ttl, ttl, 1..=255)
    }

    /// The type of service of IPv4.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn tos_v4(&self) -> io::Result<u32> {
        self.option(|options| &options.type_of_service)
    }

    /// Sets the type of service of IPv4. If its two lowest bits are not zero, an active queue marks a datagram where it would drop it otherwise (RFC 3168).
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_tos_v4(&self, tos: u32) -> io::Result<()> {
        self.set_option(|options| &options.type_of_service, tos, 0..=255)
    }

    /// The traffic class of IPv6.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn tclass_v6(&self) -> io::Result<u32> {
        self.tos_v4()
    }

    /// Sets the traffic class of IPv6: as [`UdpSocket::set_tos_v4`].
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_tclass_v6(&self, class: u32) -> io::Result<()> {
        self.set_tos_v4(class)
    }

    /// The time to live of multicast.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn multicast_ttl_v4(&self) -> io::Result<u32> {
        self.option(|options| &options.multicast_ttl)
    }

    /// Sets the time to live of multicast.
    ///
    /// # Errors
    ///
    /// If it is none, or its host has crashed.
    pub fn set_multicast_ttl_v4(&self, ttl: u32) -> io::Result<()> {
        self.set_option(|options| &options.multicast_ttl, ttl, 0..=255)
    }

    /// Whether it would hear its own multicast.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn multicast_loop_v4(&self) -> io::Result<bool> {
        Ok(self.option(|options| &options.multicast_loop)? != 0)
    }

    /// Lets it hear its own multicast, or not.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_multicast_loop_v4(&self, on: bool) -> io::Result<()> {
        self.set_option(|options| &options.multicast_loop, on.into(), 0..=1)
    }

    /// Whether it would hear its own multicast.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn multicast_loop_v6(&self) -> io::Result<bool> {
        self.multicast_loop_v4()
    }

    /// Lets it hear its own multicast, or not.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_multicast_loop_v6(&self, on: bool) -> io::Result<()> {
        self.set_multicast_loop_v4(on)
    }

    /// Would join a group: a test bed has none.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::Unsupported`].
    pub fn join_multicast_v4(&self, _group: Ipv4Addr, _interface: Ipv4Addr) -> io::Result<()> {
        no_groups()
    }

    /// Would join a group: a test bed has none.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::Unsupported`].
    pub fn join_multicast_v6(&self, _group: &Ipv6Addr, _interface: u32) -> io::Result<()> {
        no_groups()
    }

    /// Would leave a group: a test bed has none.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::Unsupported`].
    pub fn leave_multicast_v4(&self, _group: Ipv4Addr, _interface: Ipv4Addr) -> io::Result<()> {
        no_groups()
    }

    /// Would leave a group: a test bed has none.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::Unsupported`].
    pub fn leave_multicast_v6(&self, _group: &Ipv6Addr, _interface: u32) -> io::Result<()> {
        no_groups()
    }

    /// Waits until it can do one of these: to send, it always can.
    ///
    /// # Errors
    ///
    /// None: an error of the socket is given by the next call.
    #[cfg(feature = "tokio-net")]
    pub async fn ready(&self, interest: tokio::io::Interest) -> io::Result<tokio::io::Ready> {
        use tokio::io::Ready;
        if interest.is_readable() && !interest.is_writable() {
            self.readable().await?;
        }
        let is_readable = self.shared.open(self.host, KIND, |core| core.is_readable(self.id))? && interest.is_readable();
        let readable = if is_readable { Ready::READABLE } else { Ready::EMPTY };
        Ok(if interest.is_writable() { readable | Ready::WRITABLE } else { readable })
    }

    /// Tries an operation of one's own, such as [`UdpSocket::try_recv`].
    ///
    /// # Errors
    ///
    /// Those of the operation; [`io::ErrorKind::WouldBlock`] if it is to read and there is nothing.
    #[cfg(feature = "tokio-net")]
    pub fn try_io<R>(&self, interest: tokio::io::Interest, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
        let is_readable = self.shared.open(self.host, KIND, |core| core.is_readable(self.id))?;
        if !interest.is_writable() && !is_readable {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        operation()
    }

    /// Does an operation of one's own, again whenever it would have blocked and something can be read.
    ///
    /// # Errors
    ///
    /// Those of the operation, but for [`io::ErrorKind::WouldBlock`].
    #[cfg(feature = "tokio-net")]
    pub async fn async_io<R>(&self, interest: tokio::io::Interest, mut operation: impl FnMut() -> io::Result<R>) -> io::Result<R> {
        loop {
            self.ready(interest).await?;
            match operation() {
                // Sending never blocks, so it waits for something to read.
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.readable().await?,
                outcome => return outcome,
            }
        }
    }
}
