//! Listeners of Unix streams.

use std::fmt;
use std::future::poll_fn;
use std::io;
use std::path::Path;
use std::task::{Context, Poll};

use cohaptic_sockets::{Bed, Call, UnixListener as BedListener, UnixName};

use super::{SocketAddr, UnixStream, address_of, name_at, name_of, no_descriptors, try_from_std};
use crate::net::{Either, either};

/// Connections that may wait, as many as Linux allows a program that asks for the most: `net.core.somaxconn`.
const BACKLOG: u32 = 4096;

/// See `tokio::net::UnixListener`.
pub struct UnixListener(pub(super) Either<real::net::UnixListener, Box<dyn BedListener>>);

impl UnixListener {
    /// See `tokio::net::UnixListener::bind`.
    #[track_caller]
    pub fn bind<P: AsRef<Path>>(path: P) -> io::Result<Self> {
        match crate::net::bed()? {
            None => real::net::UnixListener::bind(path).map(|listener| Self(Either::Real(listener))),
            Some(bed) => Self::bind_in(&*bed, Call::here("UnixListener::bind"), &name_of(path.as_ref())?),
        }
    }

    /// See `tokio::net::UnixListener::bind_addr`.
    //@ has net/unix/listener.rs|pub fn bind_addr
    #[track_caller]
    pub fn bind_addr(address: &SocketAddr) -> io::Result<Self> {
        match crate::net::bed()? {
            None => real::net::UnixListener::bind_addr(address).map(|listener| Self(Either::Real(listener))),
            Some(bed) => Self::bind_in(&*bed, Call::here("UnixListener::bind_addr"), &name_at(address)),
        }
    }

    fn bind_in(bed: &dyn Bed, call: Call, name: &UnixName) -> io::Result<Self> {
        let socket = bed.unix_socket(call)?;
        socket.bind(name)?;
        socket.listen(BACKLOG).map(|listener| Self(Either::Bed(listener)))
    }

    /// See `tokio::net::UnixListener::from_std`.
    #[track_caller]
    pub fn from_std(listener: std::os::unix::net::UnixListener) -> io::Result<Self> {
        super::refuse_in_bed("UnixListener::from_std")?;
        real::net::UnixListener::from_std(listener).map(|listener| Self(Either::Real(listener)))
    }

    /// See `tokio::net::UnixListener::into_std`.
    pub fn into_std(self) -> io::Result<std::os::unix::net::UnixListener> {
        match self.0 {
            Either::Real(listener) => listener.into_std(),
            Either::Bed(_) => Err(super::refused("UnixListener::into_std")),
        }
    }

    /// See `tokio::net::UnixListener::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |listener| listener.local_addr(), address_of(&listener.local_name()?))
    }

    /// See `tokio::net::UnixListener::take_error`. In a test bed a listener has no errors of its own.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        either!(&self.0, |listener| listener.take_error(), listener.local_name().map(|_| None))
    }

    /// See `tokio::net::UnixListener::accept`.
    pub async fn accept(&self) -> io::Result<(UnixStream, SocketAddr)> {
        match &self.0 {
            Either::Real(listener) => listener.accept().await.map(|(stream, peer)| (UnixStream(Either::Real(stream)), peer)),
            Either::Bed(_) => poll_fn(|cx| self.poll_accept(cx)).await,
        }
    }

    /// See `tokio::net::UnixListener::poll_accept`.
    pub fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(UnixStream, SocketAddr)>> {
        match &self.0 {
            Either::Real(listener) => listener.poll_accept(cx).map_ok(|(stream, peer)| (UnixStream(Either::Real(stream)), peer)),
            Either::Bed(listener) => {
                let accepted = std::task::ready!(listener.poll_accept(cx));
                Poll::Ready(accepted.and_then(|(stream, peer)| Ok((UnixStream(Either::Bed(stream)), address_of(&peer)?))))
            }
        }
    }
}

impl fmt::Debug for UnixListener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

no_descriptors!(UnixListener);
try_from_std!(UnixListener);
