//! Unix sockets before the choice between stream, listener and datagrams.

use std::io;
use std::path::Path;

use cohaptic_sockets::{Call, UnixDatagrams, UnixSocket as BedSocket};

use super::{UnixDatagram, UnixListener, UnixStream, name_of, no_descriptors};
use crate::net::Either;

/// See `tokio::net::UnixSocket`.
#[derive(Debug)]
pub struct UnixSocket(Either<real::net::UnixSocket, Kind>);

/// Socket of a test bed.
#[derive(Debug)]
enum Kind {
    Stream(Box<dyn BedSocket>),
    Datagrams(Box<dyn UnixDatagrams>),
}

impl UnixSocket {
    /// See `tokio::net::UnixSocket::new_stream`.
    #[track_caller]
    pub fn new_stream() -> io::Result<Self> {
        match crate::net::bed()? {
            None => real::net::UnixSocket::new_stream().map(|socket| Self(Either::Real(socket))),
            Some(bed) => bed.unix_socket(Call::here("UnixSocket::new_stream")).map(|socket| Self(Either::Bed(Kind::Stream(socket)))),
        }
    }

    /// See `tokio::net::UnixSocket::new_datagram`.
    #[track_caller]
    pub fn new_datagram() -> io::Result<Self> {
        match crate::net::bed()? {
            None => real::net::UnixSocket::new_datagram().map(|socket| Self(Either::Real(socket))),
            Some(bed) => bed.unix_datagrams(Call::here("UnixSocket::new_datagram")).map(|socket| Self(Either::Bed(Kind::Datagrams(socket)))),
        }
    }

    /// See `tokio::net::UnixSocket::bind`.
    pub fn bind(&self, path: impl AsRef<Path>) -> io::Result<()> {
        match &self.0 {
            Either::Real(socket) => socket.bind(path),
            Either::Bed(Kind::Stream(socket)) => socket.bind(&name_of(path.as_ref())?),
            Either::Bed(Kind::Datagrams(socket)) => socket.bind(&name_of(path.as_ref())?),
        }
    }

    /// See `tokio::net::UnixSocket::listen`.
    pub fn listen(self, backlog: u32) -> io::Result<UnixListener> {
        match self.0 {
            Either::Real(socket) => socket.listen(backlog).map(|listener| UnixListener(Either::Real(listener))),
            Either::Bed(Kind::Stream(socket)) => socket.listen(backlog).map(|listener| UnixListener(Either::Bed(listener))),
            Either::Bed(Kind::Datagrams(_)) => Err(io::Error::other("listen cannot be called on a datagram socket")),
        }
    }

    /// See `tokio::net::UnixSocket::connect`.
    pub async fn connect(self, path: impl AsRef<Path>) -> io::Result<UnixStream> {
        match self.0 {
            Either::Real(socket) => socket.connect(path).await.map(|stream| UnixStream(Either::Real(stream))),
            Either::Bed(Kind::Stream(socket)) => socket.connect(&name_of(path.as_ref())?).map(|stream| UnixStream(Either::Bed(stream))),
            Either::Bed(Kind::Datagrams(_)) => Err(io::Error::other("connect cannot be called on a datagram socket")),
        }
    }

    /// See `tokio::net::UnixSocket::datagram`.
    pub fn datagram(self) -> io::Result<UnixDatagram> {
        match self.0 {
            Either::Real(socket) => socket.datagram().map(|socket| UnixDatagram(Either::Real(socket))),
            Either::Bed(Kind::Datagrams(socket)) => Ok(UnixDatagram(Either::Bed(socket))),
            Either::Bed(Kind::Stream(_)) => Err(io::Error::other("datagram cannot be called on a stream socket")),
        }
    }
}

no_descriptors!(UnixSocket);
