//! Unix sockets of datagrams.

use std::fmt;
use std::future::poll_fn;
use std::io;
use std::net::Shutdown;
use std::path::Path;
use std::task::{Context, Poll, Waker};

use cohaptic_sockets::{Call, UnixDatagrams, UnixName};
use real::io::{Interest, ReadBuf, Ready};

use super::{SocketAddr, address_of, name_of, no_descriptors, try_from_std};
use crate::net::{Either, either};

/// See `tokio::net::UnixDatagram`.
pub struct UnixDatagram(pub(super) Either<real::net::UnixDatagram, Box<dyn UnixDatagrams>>);

impl UnixDatagram {
    /// See `tokio::net::UnixDatagram::bind`.
    #[track_caller]
    pub fn bind<P: AsRef<Path>>(path: P) -> io::Result<Self> {
        match crate::net::bed()? {
            None => real::net::UnixDatagram::bind(path).map(|socket| Self(Either::Real(socket))),
            Some(bed) => {
                let socket = bed.unix_datagrams(Call::here("UnixDatagram::bind"))?;
                socket.bind(&name_of(path.as_ref())?)?;
                Ok(Self(Either::Bed(socket)))
            }
        }
    }

    /// See `tokio::net::UnixDatagram::unbound`.
    #[track_caller]
    pub fn unbound() -> io::Result<Self> {
        match crate::net::bed()? {
            None => real::net::UnixDatagram::unbound().map(|socket| Self(Either::Real(socket))),
            Some(bed) => bed.unix_datagrams(Call::here("UnixDatagram::unbound")).map(|socket| Self(Either::Bed(socket))),
        }
    }

    /// See `tokio::net::UnixDatagram::pair`.
    #[track_caller]
    pub fn pair() -> io::Result<(Self, Self)> {
        match crate::net::bed()? {
            None => real::net::UnixDatagram::pair().map(|(one, other)| (Self(Either::Real(one)), Self(Either::Real(other)))),
            Some(bed) => bed.unix_datagram_pair(Call::here("UnixDatagram::pair")).map(|ends| ends.map(|end| Self(Either::Bed(end))).into()),
        }
    }

    /// See `tokio::net::UnixDatagram::from_std`.
    #[track_caller]
    pub fn from_std(socket: std::os::unix::net::UnixDatagram) -> io::Result<Self> {
        super::refuse_in_bed("UnixDatagram::from_std")?;
        real::net::UnixDatagram::from_std(socket).map(|socket| Self(Either::Real(socket)))
    }

    /// See `tokio::net::UnixDatagram::into_std`.
    pub fn into_std(self) -> io::Result<std::os::unix::net::UnixDatagram> {
        match self.0 {
            Either::Real(socket) => socket.into_std(),
            Either::Bed(_) => Err(super::refused("UnixDatagram::into_std")),
        }
    }

    /// See `tokio::net::UnixDatagram::connect`.
    pub fn connect<P: AsRef<Path>>(&self, path: P) -> io::Result<()> {
        either!(&self.0, |socket| socket.connect(path), socket.connect(&name_of(path.as_ref())?))
    }

    /// See `tokio::net::UnixDatagram::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |socket| socket.local_addr(), address_of(&socket.local_name()?))
    }

    /// See `tokio::net::UnixDatagram::peer_addr`.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |socket| socket.peer_addr(), address_of(&socket.peer_name()?))
    }

    /// See `tokio::net::UnixDatagram::take_error`. In a test bed each error is that of a call.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        // A Unix socket of datagrams keeps no error. The call for the name fails if the socket does not live any more.
        either!(&self.0, |socket| socket.take_error(), socket.local_name().map(|_| None))
    }

    /// See `tokio::net::UnixDatagram::shutdown`.
    pub fn shutdown(&self, how: Shutdown) -> io::Result<()> {
        either!(&self.0, |socket| socket.shutdown(how), socket.shut_down(how))
    }
}

/// Readiness.
impl UnixDatagram {
    /// See `tokio::net::UnixDatagram::ready`.
    pub async fn ready(&self, interest: Interest) -> io::Result<Ready> {
        match &self.0 {
            Either::Real(socket) => socket.ready(interest).await,
            Either::Bed(socket) => poll_fn(|cx| ready_of(&**socket, cx, interest)).await,
        }
    }

    /// See `tokio::net::UnixDatagram::readable`.
    pub async fn readable(&self) -> io::Result<()> {
        self.ready(Interest::READABLE).await.map(drop)
    }

    /// See `tokio::net::UnixDatagram::writable`.
    pub async fn writable(&self) -> io::Result<()> {
        self.ready(Interest::WRITABLE).await.map(drop)
    }

    /// See `tokio::net::UnixDatagram::poll_recv_ready`.
    pub fn poll_recv_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |socket| socket.poll_recv_ready(cx), ready_of(&**socket, cx, Interest::READABLE).map_ok(drop))
    }

    /// See `tokio::net::UnixDatagram::poll_send_ready`.
    pub fn poll_send_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |socket| socket.poll_send_ready(cx), ready_of(&**socket, cx, Interest::WRITABLE).map_ok(drop))
    }

    /// See `tokio::net::UnixDatagram::try_io`.
    pub fn try_io<R>(&self, interest: Interest, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
        match &self.0 {
            Either::Real(socket) => socket.try_io(interest, operation),
            Either::Bed(socket) if crate::net::ready::ready(interest, socket.ready(None)?).is_empty() => Err(io::ErrorKind::WouldBlock.into()),
            Either::Bed(_) => operation(),
        }
    }

    /// See `tokio::net::UnixDatagram::async_io`.
    pub async fn async_io<R>(&self, interest: Interest, mut operation: impl FnMut() -> io::Result<R>) -> io::Result<R> {
        match &self.0 {
            Either::Real(socket) => socket.async_io(interest, operation).await,
            Either::Bed(_) => loop {
                self.ready(interest).await?;
                match operation() {
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    outcome => return outcome,
                }
            },
        }
    }
}

/// Sending.
impl UnixDatagram {
    /// See `tokio::net::UnixDatagram::send`.
    pub async fn send(&self, bytes: &[u8]) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.send(bytes).await,
            Either::Bed(socket) => waiting(|waker| socket.send(waker, bytes, None)).await,
        }
    }

    /// See `tokio::net::UnixDatagram::send_to`.
    pub async fn send_to<P: AsRef<Path>>(&self, bytes: &[u8], target: P) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.send_to(bytes, target).await,
            Either::Bed(socket) => {
                let to = name_of(target.as_ref())?;
                waiting(|waker| socket.send(waker, bytes, Some(&to))).await
            }
        }
    }

    /// See `tokio::net::UnixDatagram::poll_send`.
    pub fn poll_send(&self, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        either!(&self.0, |socket| socket.poll_send(cx, bytes), polled(socket.send(Some(cx.waker()), bytes, None)))
    }

    /// See `tokio::net::UnixDatagram::poll_send_to`.
    pub fn poll_send_to<P: AsRef<Path>>(&self, cx: &mut Context<'_>, bytes: &[u8], target: P) -> Poll<io::Result<usize>> {
        match &self.0 {
            Either::Real(socket) => socket.poll_send_to(cx, bytes, target),
            Either::Bed(socket) => polled(socket.send(Some(cx.waker()), bytes, Some(&name_of(target.as_ref())?))),
        }
    }

    /// See `tokio::net::UnixDatagram::try_send`.
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_send(bytes), socket.send(None, bytes, None))
    }

    /// See `tokio::net::UnixDatagram::try_send_to`.
    pub fn try_send_to<P: AsRef<Path>>(&self, bytes: &[u8], target: P) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_send_to(bytes, target), socket.send(None, bytes, Some(&name_of(target.as_ref())?)))
    }
}

/// Receiving.
impl UnixDatagram {
    /// See `tokio::net::UnixDatagram::recv`.
    pub async fn recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.recv(buffer).await,
            Either::Bed(socket) => waiting(|waker| socket.receive(waker, buffer)).await.map(|(count, _)| count),
        }
    }

    /// See `tokio::net::UnixDatagram::recv_from`.
    pub async fn recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        match &self.0 {
            Either::Real(socket) => socket.recv_from(buffer).await,
            Either::Bed(socket) => waiting(|waker| socket.receive(waker, buffer)).await.and_then(with_address),
        }
    }

    /// See `tokio::net::UnixDatagram::poll_recv`.
    pub fn poll_recv(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        match &self.0 {
            Either::Real(socket) => socket.poll_recv(cx, buffer),
            Either::Bed(socket) => polled(socket.receive(Some(cx.waker()), buffer.initialize_unfilled())).map_ok(|(count, _)| buffer.advance(count)),
        }
    }

    /// See `tokio::net::UnixDatagram::poll_recv_from`.
    pub fn poll_recv_from(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        match &self.0 {
            Either::Real(socket) => socket.poll_recv_from(cx, buffer),
            Either::Bed(socket) => {
                let (count, from) = std::task::ready!(polled(socket.receive(Some(cx.waker()), buffer.initialize_unfilled())))?;
                buffer.advance(count);
                Poll::Ready(address_of(&from))
            }
        }
    }

    /// See `tokio::net::UnixDatagram::try_recv`.
    pub fn try_recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_recv(buffer), socket.receive(None, buffer).map(|(count, _)| count))
    }

    /// See `tokio::net::UnixDatagram::try_recv_from`.
    pub fn try_recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        either!(&self.0, |socket| socket.try_recv_from(buffer), socket.receive(None, buffer).and_then(with_address))
    }

    /// See `tokio::net::UnixDatagram::try_recv_buf`.
    #[cfg(feature = "io-util")]
    pub fn try_recv_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_recv_buf(buffer), into_space(&**socket, None, buffer).map(|(count, _)| count))
    }

    /// See `tokio::net::UnixDatagram::try_recv_buf_from`.
    #[cfg(feature = "io-util")]
    pub fn try_recv_buf_from<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<(usize, SocketAddr)> {
        either!(&self.0, |socket| socket.try_recv_buf_from(buffer), into_space(&**socket, None, buffer).and_then(with_address))
    }

    /// See `tokio::net::UnixDatagram::recv_buf`.
    #[cfg(feature = "io-util")]
    pub async fn recv_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.recv_buf(buffer).await,
            Either::Bed(socket) => waiting(|waker| into_space(&**socket, waker, buffer)).await.map(|(count, _)| count),
        }
    }

    /// See `tokio::net::UnixDatagram::recv_buf_from`.
    #[cfg(feature = "io-util")]
    pub async fn recv_buf_from<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<(usize, SocketAddr)> {
        match &self.0 {
            Either::Real(socket) => socket.recv_buf_from(buffer).await,
            Either::Bed(socket) => waiting(|waker| into_space(&**socket, waker, buffer)).await.and_then(with_address),
        }
    }
}

/// Returns the readiness of a socket of a test bed, or registers the task.
fn ready_of(socket: &dyn UnixDatagrams, cx: &Context<'_>, interest: Interest) -> Poll<io::Result<Ready>> {
    let ready = crate::net::ready::ready(interest, socket.ready(Some(cx.waker()))?);
    if ready.is_empty() { Poll::Pending } else { Poll::Ready(Ok(ready)) }
}

/// Converts the outcome of a call that has registered the task where it would block.
fn polled<T>(outcome: io::Result<T>) -> Poll<io::Result<T>> {
    match outcome {
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => Poll::Pending,
        outcome => Poll::Ready(outcome),
    }
}

/// Calls `call` until it does not block.
async fn waiting<T>(mut call: impl FnMut(Option<&Waker>) -> io::Result<T>) -> io::Result<T> {
    poll_fn(|cx| polled(call(Some(cx.waker())))).await
}

fn with_address((count, from): (usize, UnixName)) -> io::Result<(usize, SocketAddr)> {
    Ok((count, address_of(&from)?))
}

/// Receives a datagram into the free space of a buffer.
#[cfg(feature = "io-util")]
fn into_space(socket: &dyn UnixDatagrams, waker: Option<&Waker>, buffer: &mut impl bytes::BufMut) -> io::Result<(usize, UnixName)> {
    let mut from = UnixName::Unnamed;
    let count = crate::net::ready::read_into(buffer, |bytes| {
        let (count, sender) = socket.receive(waker, bytes)?;
        from = sender;
        Ok(count)
    })?;
    Ok((count, from))
}

impl fmt::Debug for UnixDatagram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

no_descriptors!(UnixDatagram);
try_from_std!(UnixDatagram);
