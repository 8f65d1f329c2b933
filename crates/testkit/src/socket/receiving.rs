//! What a socket receives.

use std::future::{Future, poll_fn};
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use bytes::BufMut;
use cohaptic_units::Instant;

use super::{KIND, UdpSocket};
use crate::core::Parcel;

impl UdpSocket {
    /// Receives a datagram from any sender; gives its length.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::ConnectionRefused`] if the peer has told that nobody is at its port.
    pub fn recv<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<usize>> + 'a {
        self.look::<false, _>(move |datagram| datagram.copy_to(buffer))
    }

    /// Receives a datagram; gives its length and its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_from<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<(usize, SocketAddr)>> + 'a {
        self.look::<false, _>(move |datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// Receives a datagram into the free room of a buffer; gives its length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_buf<'a>(&'a self, buffer: &'a mut (impl BufMut + 'a)) -> impl Future<Output = io::Result<usize>> + 'a {
        self.look::<false, _>(move |datagram| datagram.put_into(buffer))
    }

    /// Receives a datagram into the free room of a buffer; gives its length and its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_buf_from<'a>(&'a self, buffer: &'a mut (impl BufMut + 'a)) -> impl Future<Output = io::Result<(usize, SocketAddr)>> + 'a {
        self.look::<false, _>(move |datagram| (datagram.put_into(buffer), datagram.from()))
    }

    /// Receives a datagram; gives its length, its sender, and when it arrived, to the nanosecond.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn recv_from_at<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<(usize, SocketAddr, Instant)>> + 'a {
        self.look::<false, _>(move |datagram| (datagram.copy_to(buffer), datagram.from(), datagram.arrival.at))
    }

    /// Looks at the next datagram and leaves it; gives its length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn peek<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<usize>> + 'a {
        self.look::<true, _>(move |datagram| datagram.copy_to(buffer))
    }

    /// Looks at the next datagram and leaves it; gives its length and its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn peek_from<'a>(&'a self, buffer: &'a mut [u8]) -> impl Future<Output = io::Result<(usize, SocketAddr)>> + 'a {
        self.look::<true, _>(move |datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// The sender of the next datagram, which is left.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn peek_sender(&self) -> impl Future<Output = io::Result<SocketAddr>> + '_ {
        self.look::<true, _>(Parcel::from)
    }

    /// Receives a datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`]; [`io::ErrorKind::WouldBlock`] if there is none.
    pub fn try_recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.try_look::<false, _>(|datagram| datagram.copy_to(buffer))
    }

    /// Receives a datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.try_look::<false, _>(|datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// Receives a datagram into the free room of a buffer if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_buf(&self, buffer: &mut impl BufMut) -> io::Result<usize> {
        self.try_look::<false, _>(|datagram| datagram.put_into(buffer))
    }

    /// Receives a datagram into the free room of a buffer if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_recv_buf_from(&self, buffer: &mut impl BufMut) -> io::Result<(usize, SocketAddr)> {
        self.try_look::<false, _>(|datagram| (datagram.put_into(buffer), datagram.from()))
    }

    /// Looks at the next datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.try_look::<true, _>(|datagram| datagram.copy_to(buffer))
    }

    /// Looks at the next datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.try_look::<true, _>(|datagram| (datagram.copy_to(buffer), datagram.from()))
    }

    /// The sender of the next datagram if there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::try_recv`].
    pub fn try_peek_sender(&self) -> io::Result<SocketAddr> {
        self.try_look::<true, _>(Parcel::from)
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
        self.poll_look::<false, _>(cx, |datagram| datagram.fill(buffer))
    }

    /// Looks at the next datagram, or sees to it that the task is woken when there is one; gives its sender.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    #[cfg(feature = "tokio")]
    pub fn poll_peek_from(&self, cx: &mut Context<'_>, buffer: &mut tokio::io::ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_look::<true, _>(cx, |datagram| datagram.fill(buffer))
    }

    /// Looks at the sender of the next datagram, or sees to it that the task is woken when there is one.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::recv`].
    pub fn poll_peek_sender(&self, cx: &mut Context<'_>) -> Poll<io::Result<SocketAddr>> {
        self.poll_look::<true, _>(cx, Parcel::from)
    }

    /// Waits until something can be received.
    ///
    /// # Errors
    ///
    /// If the run has ended, or this is another thread. An error of the socket is given by the next call.
    pub async fn readable(&self) -> io::Result<()> {
        poll_fn(|cx| self.poll_recv_ready(cx)).await
    }

    /// Ready when something can be received.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::readable`].
    pub fn poll_recv_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = self.shared.open(self.host, KIND, |core| core.poll_readable(self.id, cx.waker()));
        polled.map_or_else(|error| Poll::Ready(Err(error)), |ready| ready.map(Ok))
    }

    /// A view of a datagram, if there is one.
    pub(crate) fn try_look<const PEEK: bool, T>(&self, look: impl FnOnce(&Parcel) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, |core| core.try_receive::<PEEK, _>(self.id, look))?
    }

    /// A view of the next datagram. It gives the future that is polled, and no other around it: each that is there for a datagram takes 20 instructions.
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
