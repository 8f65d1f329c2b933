//! Options of a socket, and tokio's methods that wait for readiness.

use std::io;
use std::sync::atomic::{AtomicU32, Ordering};

use cohaptic_units::Ecn;

#[cfg(feature = "tokio-net")]
use super::KIND;
use super::UdpSocket;
use crate::buffers::{LEAST_RECEIVE_BUFFER, LEAST_SEND_BUFFER, doubled};
use crate::errno::Errno;

/// Options that are stored and returned. Only the two lowest bits of the type of service have an effect: see [`UdpSocket::set_tos_v4`].
#[derive(Debug)]
pub(super) struct Options {
    ttl: AtomicU32,
    type_of_service: AtomicU32,
    send_buffer: AtomicU32,
}

/// Default size of a send buffer in Linux (`net.core.wmem_default`) \[byte\].
const SEND_BUFFER: u32 = 212_992;

impl Default for Options {
    /// Returns the defaults of Linux.
    fn default() -> Self {
        Self { ttl: 64.into(), type_of_service: 0.into(), send_buffer: SEND_BUFFER.into() }
    }
}

impl Options {
    /// Returns the ECN codepoint of sent datagrams: the low two bits of the type of service (RFC 3168).
    pub(super) fn ecn(&self) -> Ecn {
        Ecn::from_bits(self.type_of_service.load(Ordering::Relaxed).to_le_bytes()[0])
    }
}

fn set(option: &AtomicU32, value: u32, allowed: std::ops::RangeInclusive<u32>) -> io::Result<()> {
    if !allowed.contains(&value) {
        return Errno::InvalidInput.fail();
    }
    option.store(value, Ordering::Relaxed);
    Ok(())
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

    /// Returns the time to live. The time to live has no effect, because a test bed has no routers that count it down.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn ttl(&self) -> io::Result<u32> {
        self.option(|options| &options.ttl)
    }

    /// Sets the time to live, from 1 to 255. The value is stored and has no effect: see [`UdpSocket::ttl`].
    ///
    /// # Errors
    ///
    /// If `ttl` is out of range, or the host of the socket has crashed.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        self.set_option(|options| &options.ttl, ttl, 1..=255)
    }

    /// Returns the size of the receive buffer \[byte\]: see [`Testbed::receive_buffer`](crate::Testbed::receive_buffer).
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn recv_buffer_size(&self) -> io::Result<u32> {
        self.open(|core| u32::try_from(*core.room(self.id)).unwrap_or(u32::MAX))
    }

    /// Sets the size of the receive buffer \[byte\]: as with Linux, to twice `size`, where a size above 212,992 counts as that, and to 2304 at least
    /// (`SO_RCVBUF`). With tokio this option needs `socket2`.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn set_recv_buffer_size(&self, size: u32) -> io::Result<()> {
        self.open(|core| *core.room(self.id) = doubled(size, LEAST_RECEIVE_BUFFER))
    }

    /// Returns the size of the send buffer \[byte\]. The size has no effect, because sending never waits.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn send_buffer_size(&self) -> io::Result<u32> {
        self.option(|options| &options.send_buffer)
    }

    /// Sets the size of the send buffer \[byte\] (`SO_SNDBUF`): as with Linux, to twice `size`, where a size above 212,992 counts as that, and to 4608 at
    /// least. The size is stored and has no effect: see [`UdpSocket::send_buffer_size`].
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn set_send_buffer_size(&self, size: u32) -> io::Result<()> {
        let size = u32::try_from(doubled(size, LEAST_SEND_BUFFER)).unwrap_or(u32::MAX);
        self.set_option(|options| &options.send_buffer, size, 0..=u32::MAX)
    }

    /// Returns the type of service of IPv4.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn tos_v4(&self) -> io::Result<u32> {
        self.option(|options| &options.type_of_service)
    }

    /// Sets the type of service of IPv4, from 0 to 255. If one of the two lowest bits is set, an active queue marks a datagram in place of dropping the
    /// datagram (RFC 3168).
    ///
    /// # Errors
    ///
    /// If `tos` is out of range, or the host of the socket has crashed.
    pub fn set_tos_v4(&self, tos: u32) -> io::Result<()> {
        self.set_option(|options| &options.type_of_service, tos, 0..=255)
    }

    /// Returns the traffic class of IPv6. IPv4 and IPv6 share the value.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn tclass_v6(&self) -> io::Result<u32> {
        self.tos_v4()
    }

    /// Sets the traffic class of IPv6: see [`UdpSocket::set_tos_v4`].
    ///
    /// # Errors
    ///
    /// If `class` is out of range, or the host of the socket has crashed.
    pub fn set_tclass_v6(&self, class: u32) -> io::Result<()> {
        self.set_tos_v4(class)
    }

    /// Waits until the socket is ready for one of the interests. A socket is always ready to send.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run. The next call returns an error of the socket itself.
    #[cfg(feature = "tokio-net")]
    pub async fn ready(&self, interest: tokio::io::Interest) -> io::Result<tokio::io::Ready> {
        use tokio::io::Ready;
        // Sending never waits, so only an interest in reading alone can wait.
        if interest.is_readable() && !interest.is_writable() {
            self.readable().await?;
        }
        let is_readable = self.shared.open(self.host, KIND, |core| core.is_readable(self.id))? && interest.is_readable();
        let readable = if is_readable { Ready::READABLE } else { Ready::EMPTY };
        Ok(if interest.is_writable() { readable | Ready::WRITABLE } else { readable })
    }

    /// Tries an operation of the caller, such as [`UdpSocket::try_recv`].
    ///
    /// # Errors
    ///
    /// Errors of the operation; [`io::ErrorKind::WouldBlock`] if `interest` is reading and nothing can be read.
    #[cfg(feature = "tokio-net")]
    pub fn try_io<R>(&self, interest: tokio::io::Interest, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
        let is_readable = self.shared.open(self.host, KIND, |core| core.is_readable(self.id))?;
        if !interest.is_writable() && !is_readable {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        operation()
    }

    /// Performs an operation of the caller. After an operation that would have blocked, waits until a datagram can be read, and repeats the operation.
    ///
    /// # Errors
    ///
    /// Errors of the operation, except [`io::ErrorKind::WouldBlock`].
    #[cfg(feature = "tokio-net")]
    pub async fn async_io<R>(&self, interest: tokio::io::Interest, mut operation: impl FnMut() -> io::Result<R>) -> io::Result<R> {
        loop {
            self.ready(interest).await?;
            match operation() {
                // Sending never blocks, so the operation must have tried to read.
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.readable().await?,
                outcome => return outcome,
            }
        }
    }
}
