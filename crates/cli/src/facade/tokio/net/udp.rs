//! UDP sockets.

use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};

use cohaptic_sockets::{Call, Datagrams};
use real::io::{Interest, ReadBuf, Ready};

use super::addr::{no_address, with_real};
use super::bed_socket::BedSocket;
use super::descriptors::{descriptors, from_placeholder, into_placeholder};
use super::{Either, ToSocketAddrs, either};

#[path = "udp_options.rs"]
mod options;
#[path = "udp_receiving.rs"]
mod receiving;

/// See `tokio::net::UdpSocket`.
pub struct UdpSocket(Either<real::net::UdpSocket, BedSocket<Arc<dyn Datagrams>>>);

impl UdpSocket {
    /// See `tokio::net::UdpSocket::bind`.
    #[track_caller]
    pub fn bind<A: ToSocketAddrs>(address: A) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("UdpSocket::bind");
        async move {
            let target = address.describe();
            drop(address);
            let Some(bed) = super::bed()? else {
                return with_real!(target, |address| real::net::UdpSocket::bind(address).await).map(|real| Self(Either::Real(real)));
            };
            let mut failed = no_address("could not resolve to any address");
            for address in target.addresses(&*bed)? {
                match bed.bind(call, address) {
                    Ok(socket) => return Ok(Self(Either::Bed(socket.into()))),
                    Err(error) => failed = error,
                }
            }
            Err(failed)
        }
    }

    /// See `tokio::net::UdpSocket::from_std`.
    #[track_caller]
    pub fn from_std(socket: std::net::UdpSocket) -> io::Result<Self> {
        if super::bed()?.is_some() {
            return from_placeholder::<dyn Datagrams>(socket, "UdpSocket::from_std").map(|found| Self(Either::Bed(found)));
        }
        real::net::UdpSocket::from_std(socket).map(|real| Self(Either::Real(real)))
    }

    /// See `tokio::net::UdpSocket::into_std`.
    pub fn into_std(self) -> io::Result<std::net::UdpSocket> {
        match self.0 {
            Either::Real(socket) => socket.into_std(),
            Either::Bed(socket) => into_placeholder(socket, socket2::Type::DGRAM, "UdpSocket::into_std"),
        }
    }

    /// See `tokio::net::UdpSocket::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |socket| socket.local_addr())
    }

    /// See `tokio::net::UdpSocket::peer_addr`.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |socket| socket.peer_addr())
    }

    /// See `tokio::net::UdpSocket::take_error`.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        either!(&self.0, |socket| socket.take_error())
    }

    /// See `tokio::net::UdpSocket::connect`.
    pub async fn connect<A: ToSocketAddrs>(&self, address: A) -> io::Result<()> {
        let target = address.describe();
        drop(address);
        let socket = match &self.0 {
            Either::Real(socket) => return with_real!(target, |address| socket.connect(address).await),
            Either::Bed(socket) => socket,
        };
        let mut outcome = Err(no_address("could not resolve to any address"));
        for address in self.addresses(target)? {
            outcome = socket.connect(address);
            if outcome.is_ok() {
                break;
            }
        }
        outcome
    }

    /// Returns the addresses of a target in the test bed. After the end of the test bed a target has no addresses.
    fn addresses(&self, target: super::addr::sealed::Target) -> io::Result<Vec<SocketAddr>> {
        match super::bed()? {
            Some(bed) => target.addresses(&*bed),
            // After the end of the run `local_addr` fails with the error for the program.
            None => self.local_addr().map(|_| Vec::new()),
        }
    }

    /// See `tokio::net::UdpSocket::ready`.
    pub async fn ready(&self, interest: Interest) -> io::Result<Ready> {
        match &self.0 {
            Either::Real(socket) => socket.ready(interest).await,
            Either::Bed(socket) => {
                // Sending never waits, so only an interest in reading alone can wait.
                if interest.is_readable() && !interest.is_writable() {
                    poll_fn(|cx| socket.poll_readable(cx)).await?;
                }
                ready_of(&**socket, interest)
            }
        }
    }

    /// See `tokio::net::UdpSocket::try_io`.
    pub fn try_io<R>(&self, interest: Interest, operation: impl FnOnce() -> io::Result<R>) -> io::Result<R> {
        match &self.0 {
            Either::Real(socket) => socket.try_io(interest, operation),
            Either::Bed(socket) if ready_of(&**socket, interest)?.is_empty() => Err(io::ErrorKind::WouldBlock.into()),
            Either::Bed(_) => operation(),
        }
    }

    /// See `tokio::net::UdpSocket::async_io`.
    pub async fn async_io<R>(&self, interest: Interest, mut operation: impl FnMut() -> io::Result<R>) -> io::Result<R> {
        let socket = match &self.0 {
            Either::Real(socket) => return socket.async_io(interest, operation).await,
            Either::Bed(socket) => socket,
        };
        loop {
            self.ready(interest).await?;
            match operation() {
                // Sending never blocks, so the operation must have tried to read.
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => poll_fn(|cx| socket.poll_readable(cx)).await?,
                outcome => return outcome,
            }
        }
    }
}

/// Sending. In a test bed sending never waits.
impl UdpSocket {
    /// See `tokio::net::UdpSocket::writable`.
    pub async fn writable(&self) -> io::Result<()> {
        match &self.0 {
            Either::Real(socket) => socket.writable().await,
            Either::Bed(socket) => socket.local_addr().map(drop),
        }
    }

    /// See `tokio::net::UdpSocket::poll_send_ready`.
    pub fn poll_send_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |socket| socket.poll_send_ready(cx), Poll::Ready(socket.local_addr().map(drop)))
    }

    /// See `tokio::net::UdpSocket::send`.
    pub async fn send(&self, bytes: &[u8]) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.send(bytes).await,
            Either::Bed(socket) => socket.send(bytes, None),
        }
    }

    /// See `tokio::net::UdpSocket::poll_send`.
    pub fn poll_send(&self, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        either!(&self.0, |socket| socket.poll_send(cx, bytes), Poll::Ready(socket.send(bytes, None)))
    }

    /// See `tokio::net::UdpSocket::try_send`.
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_send(bytes), socket.send(bytes, None))
    }

    /// See `tokio::net::UdpSocket::send_to`.
    pub async fn send_to<A: ToSocketAddrs>(&self, bytes: &[u8], address: A) -> io::Result<usize> {
        let target = address.describe();
        drop(address);
        match &self.0 {
            Either::Real(socket) => with_real!(target, |address| socket.send_to(bytes, address).await),
            Either::Bed(socket) => {
                let to = self.addresses(target)?.first().copied();
                socket.send(bytes, Some(to.ok_or_else(|| no_address("no addresses to send data to"))?))
            }
        }
    }

    /// See `tokio::net::UdpSocket::poll_send_to`.
    pub fn poll_send_to(&self, cx: &mut Context<'_>, bytes: &[u8], to: SocketAddr) -> Poll<io::Result<usize>> {
        either!(&self.0, |socket| socket.poll_send_to(cx, bytes, to), Poll::Ready(socket.send(bytes, Some(to))))
    }

    /// See `tokio::net::UdpSocket::try_send_to`.
    pub fn try_send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_send_to(bytes, to), socket.send(bytes, Some(to)))
    }
}

fn ready_of(socket: &dyn Datagrams, interest: Interest) -> io::Result<Ready> {
    let readable = socket.is_readable()?;
    Ok(super::ready::ready(interest, cohaptic_sockets::Ready { readable, writable: true, ..Default::default() }))
}

/// Copies as much of a datagram as a buffer takes.
fn copy(buffer: &mut [u8], bytes: &[u8]) -> usize {
    let count = buffer.len().min(bytes.len());
    buffer[..count].copy_from_slice(&bytes[..count]);
    count
}

/// Copies as much of a datagram as the rest of a buffer takes.
fn fill(buffer: &mut ReadBuf<'_>, bytes: &[u8]) {
    buffer.put_slice(&bytes[..bytes.len().min(buffer.remaining())]);
}

impl TryFrom<std::net::UdpSocket> for UdpSocket {
    type Error = io::Error;

    fn try_from(socket: std::net::UdpSocket) -> io::Result<Self> {
        Self::from_std(socket)
    }
}

impl fmt::Debug for UdpSocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

descriptors!(UdpSocket, DGRAM);
