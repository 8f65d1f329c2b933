//! TCP streams.

use std::fmt;
use std::future::{Future, poll_fn};
use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use cohaptic_sockets::{Call, Stream};
use real::io::{AsyncRead, AsyncWrite, Interest, ReadBuf, Ready};

use super::addr::{no_address, with_real};
use super::bed_socket::BedSocket;
use super::descriptors::{descriptors, from_placeholder, into_placeholder};
use super::tcp::{OwnedReadHalf, OwnedWriteHalf, ReadHalf, WriteHalf};
use super::{Either, ToSocketAddrs, either};

/// See `tokio::net::TcpStream`.
pub struct TcpStream(pub(super) Either<real::net::TcpStream, BedSocket<Arc<dyn Stream>>>);

impl TcpStream {
    /// See `tokio::net::TcpStream::connect`.
    #[track_caller]
    pub fn connect<A: ToSocketAddrs>(address: A) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("TcpStream::connect");
        async move {
            let target = address.describe();
            drop(address);
            let Some(bed) = super::bed()? else {
                return with_real!(target, |address| real::net::TcpStream::connect(address).await).map(|real| Self(Either::Real(real)));
            };
            let mut failed = no_address("could not resolve to any address");
            for address in target.addresses(&*bed)? {
                match bed.connect(call, address).await {
                    Ok(stream) => return Ok(Self(Either::Bed(stream.into()))),
                    Err(error) => failed = error,
                }
            }
            Err(failed)
        }
    }

    /// See `tokio::net::TcpStream::from_std`.
    #[track_caller]
    pub fn from_std(stream: std::net::TcpStream) -> io::Result<Self> {
        if super::bed()?.is_some() {
            return from_placeholder::<dyn Stream>(&stream, "TcpStream::from_std").map(|found| Self(Either::Bed(found.into())));
        }
        real::net::TcpStream::from_std(stream).map(|real| Self(Either::Real(real)))
    }

    /// See `tokio::net::TcpStream::into_std`.
    pub fn into_std(self) -> io::Result<std::net::TcpStream> {
        match self.0 {
            Either::Real(stream) => stream.into_std(),
            Either::Bed(stream) => into_placeholder(stream, socket2::Type::STREAM, "TcpStream::into_std"),
        }
    }

    /// See `tokio::net::TcpStream::split`.
    pub fn split(&mut self) -> (ReadHalf<'_>, WriteHalf<'_>) {
        (ReadHalf(self), WriteHalf(self))
    }

    /// See `tokio::net::TcpStream::into_split`.
    pub fn into_split(self) -> (OwnedReadHalf, OwnedWriteHalf) {
        super::tcp::owned::split(self)
    }

    /// See `tokio::net::TcpStream::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |stream| stream.local_addr())
    }

    /// See `tokio::net::TcpStream::peer_addr`.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |stream| stream.peer_addr())
    }

    /// See `tokio::net::TcpStream::take_error`.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        either!(&self.0, |stream| stream.take_error())
    }

    /// See `tokio::net::TcpStream::nodelay`.
    pub fn nodelay(&self) -> io::Result<bool> {
        either!(&self.0, |stream| stream.nodelay())
    }

    /// See `tokio::net::TcpStream::set_nodelay`.
    pub fn set_nodelay(&self, nodelay: bool) -> io::Result<()> {
        either!(&self.0, |stream| stream.set_nodelay(nodelay))
    }

    /// See `tokio::net::TcpStream::quickack`.
    //@ has net/tcp/stream.rs|pub fn quickack
    #[cfg(any(target_os = "linux", target_os = "android"))]
    pub fn quickack(&self) -> io::Result<bool> {
        either!(&self.0, |stream| stream.quickack())
    }

    /// See `tokio::net::TcpStream::set_quickack`.
    //@ has net/tcp/stream.rs|pub fn quickack
    #[cfg(any(target_os = "linux", target_os = "android"))]
    pub fn set_quickack(&self, quickack: bool) -> io::Result<()> {
        either!(&self.0, |stream| stream.set_quickack(quickack))
    }

    /// See `tokio::net::TcpStream::linger`.
    pub fn linger(&self) -> io::Result<Option<Duration>> {
        either!(&self.0, |stream| stream.linger())
    }

    /// See `tokio::net::TcpStream::set_linger`.
    #[allow(deprecated, reason = "newer versions of tokio deprecate the method")]
    pub fn set_linger(&self, linger: Option<Duration>) -> io::Result<()> {
        either!(&self.0, |stream| stream.set_linger(linger))
    }

    /// See `tokio::net::TcpStream::set_zero_linger`.
    #[allow(deprecated, reason = "newer versions of tokio deprecate `set_linger`")]
    pub fn set_zero_linger(&self) -> io::Result<()> {
        either!(&self.0, |stream| stream.set_linger(Some(Duration::ZERO)))
    }

    /// See `tokio::net::TcpStream::ttl`.
    pub fn ttl(&self) -> io::Result<u32> {
        either!(&self.0, |stream| stream.ttl())
    }

    /// See `tokio::net::TcpStream::set_ttl`.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        either!(&self.0, |stream| stream.set_ttl(ttl))
    }
}

/// Readiness, and methods that do not wait.
impl TcpStream {
    /// See `tokio::net::TcpStream::ready`.
    pub async fn ready(&self, interest: Interest) -> io::Result<Ready> {
        match &self.0 {
            Either::Real(stream) => stream.ready(interest).await,
            Either::Bed(stream) => {
                poll_fn(|cx| {
                    let ready = super::ready::ready(interest, stream.ready()?);
                    if !ready.is_empty() {
                        return Poll::Ready(Ok(ready));
                    }
                    // Nothing is ready, so these calls register the task.
                    if interest.is_readable() {
                        let _ = stream.poll_readable(cx)?;
                    }
                    if interest.is_writable() {
                        let _ = stream.poll_writable(cx)?;
                    }
                    Poll::Pending
                })
                .await
            }
        }
    }

    /// See `tokio::net::TcpStream::readable`.
    pub async fn readable(&self) -> io::Result<()> {
        match &self.0 {
            Either::Real(stream) => stream.readable().await,
            Either::Bed(stream) => poll_fn(|cx| stream.poll_readable(cx)).await,
        }
    }

    /// See `tokio::net::TcpStream::poll_read_ready`.
    pub fn poll_read_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |stream| stream.poll_read_ready(cx), stream.poll_readable(cx))
    }

    /// See `tokio::net::TcpStream::writable`.
    pub async fn writable(&self) -> io::Result<()> {
        match &self.0 {
            Either::Real(stream) => stream.writable().await,
            Either::Bed(stream) => poll_fn(|cx| stream.poll_writable(cx)).await,
        }
    }

    /// See `tokio::net::TcpStream::poll_write_ready`.
    pub fn poll_write_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |stream| stream.poll_write_ready(cx), stream.poll_writable(cx))
    }

    /// See `tokio::net::TcpStream::try_read`.
    pub fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        either!(&self.0, |stream| stream.try_read(buffer), stream.try_read(&mut [IoSliceMut::new(buffer)]))
    }

    /// See `tokio::net::TcpStream::try_read_vectored`.
    pub fn try_read_vectored(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        either!(&self.0, |stream| stream.try_read_vectored(buffers), stream.try_read(buffers))
    }

    /// See `tokio::net::TcpStream::try_read_buf`.
    #[cfg(feature = "io-util")]
    pub fn try_read_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
        match &self.0 {
            Either::Real(stream) => stream.try_read_buf(buffer),
            Either::Bed(stream) => super::ready::read_into(buffer, |bytes| stream.try_read(&mut [IoSliceMut::new(bytes)])),
        }
    }

    /// See `tokio::net::TcpStream::try_write`.
    pub fn try_write(&self, buffer: &[u8]) -> io::Result<usize> {
        either!(&self.0, |stream| stream.try_write(buffer), stream.try_write(&[IoSlice::new(buffer)]))
    }

    /// See `tokio::net::TcpStream::try_write_vectored`.
    pub fn try_write_vectored(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
        either!(&self.0, |stream| stream.try_write_vectored(buffers), stream.try_write(buffers))
    }

    /// See `tokio::net::TcpStream::try_io`.
    pub fn try_io<R>(&self, interest: Interest, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
        match &self.0 {
            Either::Real(stream) => stream.try_io(interest, operation),
            Either::Bed(stream) if super::ready::ready(interest, stream.ready()?).is_empty() => Err(io::ErrorKind::WouldBlock.into()),
            Either::Bed(_) => operation(),
        }
    }

    /// See `tokio::net::TcpStream::async_io`.
    pub async fn async_io<R>(&self, interest: Interest, mut operation: impl FnMut() -> io::Result<R>) -> io::Result<R> {
        match &self.0 {
            Either::Real(stream) => stream.async_io(interest, operation).await,
            Either::Bed(_) => loop {
                self.ready(interest).await?;
                match operation() {
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    outcome => return outcome,
                }
            },
        }
    }

    /// See `tokio::net::TcpStream::peek`.
    pub async fn peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        match &self.0 {
            Either::Real(stream) => stream.peek(buffer).await,
            Either::Bed(stream) => poll_fn(|cx| stream.poll_peek(cx, buffer)).await,
        }
    }

    /// See `tokio::net::TcpStream::poll_peek`.
    pub fn poll_peek(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<usize>> {
        match &self.0 {
            Either::Real(stream) => stream.poll_peek(cx, buffer),
            Either::Bed(stream) => stream.poll_peek(cx, buffer.initialize_unfilled()).map_ok(|count| {
                buffer.advance(count);
                count
            }),
        }
    }
}

/// Calls of the two halves of a stream, which share the stream.
impl TcpStream {
    #[inline]
    pub(super) fn poll_read_shared(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        match &self.0 {
            Either::Real(stream) => stream.cohaptic_read(cx, buffer),
            Either::Bed(stream) => stream.poll_read(cx, buffer.initialize_unfilled()).map_ok(|count| buffer.advance(count)),
        }
    }

    #[inline]
    pub(super) fn poll_write_shared(&self, cx: &mut Context<'_>, buffer: &[u8]) -> Poll<io::Result<usize>> {
        either!(&self.0, |stream| stream.cohaptic_write(cx, buffer), stream.poll_write(cx, &[IoSlice::new(buffer)]))
    }

    #[inline]
    pub(super) fn poll_write_vectored_shared(&self, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        either!(&self.0, |stream| stream.cohaptic_write_vectored(cx, buffers), stream.poll_write(cx, buffers))
    }

    pub(super) fn shut_down_shared(&self) -> io::Result<()> {
        either!(&self.0, |stream| stream.cohaptic_shut_down(), stream.shut_down())
    }

    /// Sends FIN for a half that is dropped.
    pub(super) fn let_write_half_go(&self) {
        match &self.0 {
            // The connection may be over already.
            Either::Real(stream) => drop(stream.cohaptic_shut_down()),
            Either::Bed(stream) => stream.let_write_half_go(),
        }
    }
}

impl AsyncRead for TcpStream {
    #[inline]
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.poll_read_shared(cx, buffer)
    }
}

impl AsyncWrite for TcpStream {
    #[inline]
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, buffer: &[u8]) -> Poll<io::Result<usize>> {
        self.poll_write_shared(cx, buffer)
    }

    #[inline]
    fn poll_write_vectored(self: Pin<&mut Self>, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        self.poll_write_vectored_shared(cx, buffers)
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    #[inline]
    fn poll_flush(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(self.shut_down_shared())
    }
}

impl TryFrom<std::net::TcpStream> for TcpStream {
    type Error = io::Error;

    fn try_from(stream: std::net::TcpStream) -> io::Result<Self> {
        Self::from_std(stream)
    }
}

impl AsRef<Self> for TcpStream {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl fmt::Debug for TcpStream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

descriptors!(TcpStream, STREAM);
