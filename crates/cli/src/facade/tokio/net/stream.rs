//! TCP streams.

use std::future::{Future, poll_fn};
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use cohaptic_sockets::{Call, Stream};
use real::io::ReadBuf;

use super::addr::{no_address, with_real};
use super::bed_socket::BedSocket;
use super::bytes::byte_stream;
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
            return from_placeholder::<dyn Stream>(stream, "TcpStream::from_std").map(|found| Self(Either::Bed(found)));
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
        super::tcp::halves(self)
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

/// Bytes that stay in the stream.
impl TcpStream {
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

byte_stream!(TcpStream);

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

descriptors!(TcpStream, STREAM);
