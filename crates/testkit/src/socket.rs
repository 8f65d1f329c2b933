//! The virtual UDP socket.

mod options;

use std::fmt;
use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};

use bytes::{BufMut, Bytes};
use cohaptic_units::Instant;

use crate::address::ToSocketAddrs;
use crate::context;
use crate::core::{Datagram, Outgoing, Shared, SocketId};

/// A UDP socket of a host of the running test bed: the methods of tokio's, with the same meaning.
///
/// What differs, or is worth knowing:
///
/// - It is bound on the host of the task that binds it; [`Host::bind`](crate::Host::bind) names another one. To be bound, connected or dropped takes no time.
/// - Sending never waits: what the link cannot take it drops, as a network does. [`UdpSocket::try_send`] never gives `WouldBlock`.
/// - A datagram counts in its link with the bytes that it carries. Headers are counted where the link's `overhead` (the second word of `rate`) says so.
/// - A datagram that finds the buffer of the socket full is lost: see [`Testbed::receive_buffer`](crate::Testbed::receive_buffer). One that is longer than the
///   buffer given to receive it is cut off, as with Linux.
/// - If no socket is at the port of the peer, a connected socket gets [`io::ErrorKind::ConnectionRefused`], once the answer has come back over the
///   link: by what is called next, or by what waits to receive.
/// - A socket at `[::]` hears IPv6 only.
/// - When its host crashes, every method gives [`io::ErrorKind::ConnectionAborted`], with the way out.
pub struct UdpSocket {
    shared: Arc<Shared>,
    id: SocketId,
    options: options::Options,
}

impl UdpSocket {
    /// Binds a socket on the host of the task that is running. `0.0.0.0` and `[::]` hear all addresses of the host, port 0 is given a free one: from 49152 on, in
    /// turn.
    ///
    /// # Errors
    ///
    /// As tokio's: the address is taken, or is not the host's. [`io::ErrorKind::NotFound`] if the task lives on no host.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn bind(address: impl ToSocketAddrs) -> io::Result<Self> {
        let shared = context::shared().ok_or_else(|| context::outside("a socket can be bound"))?;
        let Some(host) = context::host() else {
            let text = "this task lives on no host, so it is not clear where to bind; spawn it with `Host::spawn`, or bind with `Host::bind`";
            return Err(io::Error::new(io::ErrorKind::NotFound, text));
        };
        Self::bind_on(shared, host, address)
    }

    pub(crate) fn bind_on(shared: Arc<Shared>, host: usize, address: impl ToSocketAddrs) -> io::Result<Self> {
        let address = address.to_socket_addr()?;
        let mut core = shared.lock();
        if !core.is_up(host) {
            let text = format!("host `{}` is down; `Host::restart` brings it back", core.plan.names()[host]);
            return Err(io::Error::new(io::ErrorKind::NetworkDown, text));
        }
        let id = core.bind(host, address)?;
        drop(core);
        Ok(Self { shared, id, options: options::Options::default() })
    }

    /// The address at which it is bound.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        let core = self.shared.lock();
        core.check_alive(self.id)?;
        Ok(core.local_of(self.id))
    }

    /// The peer to which it is connected.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] if it is not.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        let core = self.shared.lock();
        core.check_alive(self.id)?;
        core.peer_of(self.id).ok_or_else(|| io::ErrorKind::NotConnected.into())
    }

    /// From now on it sends to that peer and hears nobody else. What has come before stays in its buffer.
    ///
    /// # Errors
    ///
    /// If the peer is of the other version of IP, or is no address.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn connect(&self, peer: impl ToSocketAddrs) -> io::Result<()> {
        let peer = peer.to_socket_addr()?;
        self.shared.lock().connect(self.id, peer)
    }

    /// Sends to the peer; gives the length.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] without a peer, `ConnectionRefused` if the peer has told that nobody is at its port, `InvalidInput` if it is too long.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn send(&self, bytes: &[u8]) -> io::Result<usize> {
        self.try_send(bytes)
    }

    /// Sends to the peer; gives the length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`].
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<usize> {
        self.send_now(None, bytes, false)
    }

    /// Sends to an address; gives the length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`]; [`io::ErrorKind::HostUnreachable`] if no host ever had that address.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn send_to(&self, bytes: &[u8], to: impl ToSocketAddrs) -> io::Result<usize> {
        self.send_now(Some(to.to_socket_addr()?), bytes, false)
    }

    /// Sends to an address; gives the length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send_to`].
    pub fn try_send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        self.send_now(Some(to), bytes, false)
    }

    /// Sends to the peer; ready at once.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`].
    pub fn poll_send(&self, _cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Poll::Ready(self.try_send(bytes))
    }

    /// Sends to an address; ready at once.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send_to`].
    pub fn poll_send_to(&self, _cx: &mut Context<'_>, bytes: &[u8], to: SocketAddr) -> Poll<io::Result<usize>> {
        Poll::Ready(self.try_send_to(bytes, to))
    }

    pub(crate) fn send_now(&self, to: Option<SocketAddr>, bytes: &[u8], ecn_capable: bool) -> io::Result<usize> {
        let ecn_capable = ecn_capable || self.options.is_ecn_capable();
        let outgoing = Outgoing { to, bytes: Bytes::copy_from_slice(bytes), ecn_capable };
        self.shared.lock().send(self.id, outgoing)?;
        Ok(bytes.len())
    }

    /// Receives a datagram, whoever sent it; gives its length.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::ConnectionRefused`] if the peer has told that nobody is at its port.
    pub async fn recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(self.take(false).await?.copy_to(buffer).0)
    }

    /// Receives a datagram; gives its length and its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        Ok(self.take(false).await?.copy_to(buffer))
    }

    /// Receives a datagram into the free room of a buffer; gives its length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn recv_buf(&self, buffer: &mut impl BufMut) -> io::Result<usize> {
        Ok(self.take(false).await?.put_into(buffer).0)
    }

    /// Receives a datagram into the free room of a buffer; gives its length and its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn recv_buf_from(&self, buffer: &mut impl BufMut) -> io::Result<(usize, SocketAddr)> {
        Ok(self.take(false).await?.put_into(buffer))
    }

    /// Receives a datagram; gives its length, its sender, and when it arrived, to the nanosecond.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn recv_from_at(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr, Instant)> {
        let datagram = self.take(false).await?;
        let (len, from) = datagram.copy_to(buffer);
        Ok((len, from, datagram.at))
    }

    /// Looks at the next datagram and leaves it; gives its length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(self.take(true).await?.copy_to(buffer).0)
    }

    /// Looks at the next datagram and leaves it; gives its length and its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn peek_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        Ok(self.take(true).await?.copy_to(buffer))
    }

    /// The sender of the next datagram, which is left.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub async fn peek_sender(&self) -> io::Result<SocketAddr> {
        Ok(self.take(true).await?.from)
    }

    /// Receives a datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`]; [`io::ErrorKind::WouldBlock`] if there is none.
    pub fn try_recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(self.try_take(false)?.copy_to(buffer).0)
    }

    /// Receives a datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        Ok(self.try_take(false)?.copy_to(buffer))
    }

    /// Receives a datagram into the free room of a buffer if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_buf(&self, buffer: &mut impl BufMut) -> io::Result<usize> {
        Ok(self.try_take(false)?.put_into(buffer).0)
    }

    /// Receives a datagram into the free room of a buffer if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_buf_from(&self, buffer: &mut impl BufMut) -> io::Result<(usize, SocketAddr)> {
        Ok(self.try_take(false)?.put_into(buffer))
    }

    /// Looks at the next datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(self.try_take(true)?.copy_to(buffer).0)
    }

    /// Looks at the next datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        Ok(self.try_take(true)?.copy_to(buffer))
    }

    /// The sender of the next datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek_sender(&self) -> io::Result<SocketAddr> {
        Ok(self.try_take(true)?.from)
    }

    /// Receives a datagram, or sees to it that the task is woken when there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_recv(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.poll_recv_from(cx, buffer).map_ok(drop)
    }

    /// Receives a datagram, or sees to it that the task is woken when there is one; gives its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_recv_from(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_take(cx, false).map_ok(|datagram| datagram.fill(buffer))
    }

    /// Looks at the next datagram, or sees to it that the task is woken when there is one; gives its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_peek_from(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_take(cx, true).map_ok(|datagram| datagram.fill(buffer))
    }

    /// Looks at the sender of the next datagram, or sees to it that the task is woken when there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn poll_peek_sender(&self, cx: &mut Context<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_take(cx, true).map_ok(|datagram| datagram.from)
    }

    /// Waits until something can be received.
    ///
    /// # Errors
    ///
    /// None: an error of the socket is given by what is called next.
    pub async fn readable(&self) -> io::Result<()> {
        poll_fn(|cx| self.poll_recv_ready(cx)).await
    }

    /// Ready when something can be received.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::readable`].
    pub fn poll_recv_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let mut core = self.shared.lock();
        if core.is_readable(self.id) {
            return Poll::Ready(Ok(()));
        }
        core.wait_to_read(self.id, cx.waker());
        Poll::Pending
    }

    /// Waits until something can be sent: not at all.
    ///
    /// # Errors
    ///
    /// None.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn writable(&self) -> io::Result<()> {
        Ok(())
    }

    /// Always ready: sending never waits.
    ///
    /// # Errors
    ///
    /// None.
    pub fn poll_send_ready(&self, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    /// Whether it may send to 255.255.255.255, which reaches all other hosts.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn broadcast(&self) -> io::Result<bool> {
        let mut core = self.shared.lock();
        core.check_alive(self.id)?;
        Ok(*core.may_broadcast(self.id))
    }

    /// Lets it send to 255.255.255.255, or not.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_broadcast(&self, on: bool) -> io::Result<()> {
        let mut core = self.shared.lock();
        core.check_alive(self.id)?;
        *core.may_broadcast(self.id) = on;
        Ok(())
    }

    /// Takes out the error that the next call would give otherwise.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        let mut core = self.shared.lock();
        core.check_alive(self.id)?;
        Ok(core.take_error(self.id))
    }

    pub(crate) fn try_take(&self, peek: bool) -> io::Result<Datagram> {
        self.shared.lock().receive(self.id, peek)?.ok_or_else(|| io::ErrorKind::WouldBlock.into())
    }

    async fn take(&self, peek: bool) -> io::Result<Datagram> {
        poll_fn(|cx| self.poll_take(cx, peek)).await
    }

    pub(crate) fn poll_take(&self, cx: &Context<'_>, peek: bool) -> Poll<io::Result<Datagram>> {
        let mut core = self.shared.lock();
        match core.receive(self.id, peek) {
            Ok(Some(datagram)) => Poll::Ready(Ok(datagram)),
            Err(error) => Poll::Ready(Err(error)),
            Ok(None) => {
                core.wait_to_read(self.id, cx.waker());
                Poll::Pending
            }
        }
    }
}

impl Datagram {
    fn copy_to(&self, buffer: &mut [u8]) -> (usize, SocketAddr) {
        let len = self.bytes.len().min(buffer.len());
        buffer[..len].copy_from_slice(&self.bytes[..len]);
        (len, self.from)
    }

    fn put_into(&self, buffer: &mut impl BufMut) -> (usize, SocketAddr) {
        let len = self.bytes.len().min(buffer.remaining_mut());
        buffer.put_slice(&self.bytes[..len]);
        (len, self.from)
    }

    #[cfg(feature = "tokio")]
    fn fill(&self, buffer: &mut tokio::io::ReadBuf<'_>) -> SocketAddr {
        let len = self.bytes.len().min(buffer.remaining());
        buffer.put_slice(&self.bytes[..len]);
        self.from
    }
}

impl Drop for UdpSocket {
    fn drop(&mut self) {
        self.shared.lock().close(self.id);
    }
}

impl fmt::Debug for UdpSocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("UdpSocket").field("local", &self.shared.lock().local_of(self.id)).finish_non_exhaustive()
    }
}
