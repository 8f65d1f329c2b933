//! Receiving of datagrams.

use std::future::{Future, poll_fn};
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use bytes::BufMut;
use cohaptic_units::Instant;

use super::{KIND, UdpSocket};
use crate::core::Parcel;

impl UdpSocket {
    /// Receives a datagram from any sender. Returns the number of bytes received.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::ConnectionRefused`] if the socket is connected and no socket is bound to the port of the peer.
    pub fn recv<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<usize>> + 'a {
        self.look::<false, _>(move |datagram| datagram.copy_to(buffer))
    }

    /// Receives a datagram. Returns the number of bytes received, and the sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_from<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<(usize, SocketAddr)>> + 'a {
        self.look::<false, _>(move |datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// Receives a datagram into the free space of `buffer`. Returns the number of bytes received.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_buf<'a>(&'a self, buffer: &'a mut (impl BufMut + 'a)) -> impl Future<Output = io::Result<usize>> + 'a {
        self.look::<false, _>(move |datagram| datagram.put_into(buffer))
    }

    /// Receives a datagram into the free space of `buffer`. Returns the number of bytes received, and the sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_buf_from<'a>(&'a self, buffer: &'a mut (impl BufMut + 'a)) -> impl Future<Output = io::Result<(usize, SocketAddr)>> + 'a {
        self.look::<false, _>(move |datagram| (datagram.put_into(buffer), datagram.from()))
    }

    /// Receives a datagram. Returns the number of bytes received, the sender, and the instant of arrival, to the nanosecond.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_from_at<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<(usize, SocketAddr, Instant)>> + 'a {
        self.look::<false, _>(move |datagram| (datagram.copy_to(buffer), datagram.from(), datagram.arrival.at))
    }

    /// Copies the next datagram, which stays in the socket. Returns the number of bytes copied.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn peek<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<usize>> + 'a {
        self.look::<true, _>(move |datagram| datagram.copy_to(buffer))
    }

    /// Copies the next datagram, which stays in the socket. Returns the number of bytes copied, and the sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn peek_from<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<(usize, SocketAddr)>> + 'a {
        self.look::<true, _>(move |datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// Returns the sender of the next datagram, which stays in the socket.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn peek_sender(&self) -> impl Future<Output = io::Result<SocketAddr>> + '_ {
        self.look::<true, _>(Parcel::from)
    }

    /// Receives a datagram, if any. Returns the number of bytes received.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`]; [`io::ErrorKind::WouldBlock`] if there is no datagram.
    pub fn try_recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.try_look::<false, _>(|datagram| datagram.copy_to(buffer))
    }

    /// Receives a datagram, if any. Returns the number of bytes received, and the sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.try_look::<false, _>(|datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// Receives a datagram into the free space of `buffer`, if any. Returns the number of bytes received.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_buf(&self, buffer: &mut impl BufMut) -> io::Result<usize> {
        self.try_look::<false, _>(|datagram| datagram.put_into(buffer))
    }

    /// Receives a datagram into the free space of `buffer`, if any. Returns the number of bytes received, and the sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_buf_from(&self, buffer: &mut impl BufMut) -> io::Result<(usize, SocketAddr)> {
        self.try_look::<false, _>(|datagram| (datagram.put_into(buffer), datagram.from()))
    }

    /// Copies the next datagram, if any. The datagram stays in the socket. Returns the number of bytes copied.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.try_look::<true, _>(|datagram| datagram.copy_to(buffer))
    }

    /// Copies the next datagram, if any. The datagram stays in the socket. Returns the number of bytes copied, and the sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.try_look::<true, _>(|datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// Returns the sender of the next datagram, if any. The datagram stays in the socket.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek_sender(&self) -> io::Result<SocketAddr> {
        self.try_look::<true, _>(Parcel::from)
    }

    /// Receives a datagram. Without a datagram the task is woken when a datagram arrives.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_recv(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.poll_recv_from(cx, buffer).map_ok(drop)
    }

    /// Receives a datagram, and returns the sender. If there is no datagram, the task is woken when one arrives.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_recv_from(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_look::<false, _>(cx, |datagram| datagram.fill(buffer))
    }

    /// Copies the next datagram without taking it from the socket, and returns the sender. If there is no datagram, the task is woken when one arrives.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_peek_from(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_look::<true, _>(cx, |datagram| datagram.fill(buffer))
    }

    /// Returns the sender of the next datagram, which stays in the socket. If there is no datagram, the task is woken when one arrives.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn poll_peek_sender(&self, cx: &mut Context<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_look::<true, _>(cx, Parcel::from)
    }

    /// Waits until a datagram, or an error of the socket, can be received.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run. The next call returns an error of the socket itself.
    pub async fn readable(&self) -> io::Result<()> {
        poll_fn(|cx| self.poll_recv_ready(cx)).await
    }

    /// Returns ready when a datagram, or an error of the socket, can be received.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::readable`].
    pub fn poll_recv_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = self.shared.open(self.host, KIND, |core| core.poll_readable(self.id, cx.waker()));
        polled.map_or_else(|error| Poll::Ready(Err(error)), |ready| ready.map(Ok))
    }

    /// Calls `look` on the next datagram, if any.
    pub(crate) fn try_look<const PEEK: bool, T>(&self, look: impl FnOnce(&Parcel) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, |core| core.try_receive::<PEEK, _>(self.id, look))?
    }

    /// Calls `look` on the next datagram. Returns the polled future itself, without an `async` block around it, because every wrapping future costs
    /// instructions per datagram.
    #[inline]
    fn look<'a, const PEEK: bool, T>(&'a self, mut look: impl FnMut(&Parcel) -> T + 'a) -> impl Future<Output = io::Result<T>> + 'a {
        poll_fn(move |cx| self.poll_look::<PEEK, _>(cx, &mut look))
    }

    #[inline]
    pub(crate) fn poll_look<const PEEK: bool, T>(&self, cx: &Context<'_>, look: impl FnOnce(&Parcel) -> T) -> Poll<io::Result<T>> {
        self.shared.open(self.host, KIND, |core| core.receive::<PEEK, _>(self.id, Some(cx.waker()), look))?
    }
}

impl Parcel {
    fn put_into(&self, buffer: &mut impl BufMut) -> usize {
        let len = self.bytes.len().min(buffer.remaining_mut());
        buffer.put_slice(&self.bytes[..len]);
        len
    }

    #[cfg(feature = "tokio")]
    fn fill(&self, buffer: &mut tokio::io::ReadBuf<'_>) -> SocketAddr {
        let len = self.bytes.len().min(buffer.remaining());
        buffer.put_slice(&self.bytes[..len]);
        self.from()
    }
}
