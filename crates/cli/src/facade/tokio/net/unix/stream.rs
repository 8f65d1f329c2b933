//! Unix streams.

use std::io;
use std::path::Path;

use cohaptic_sockets::{Call, UnixStream as BedStream};

use super::{OwnedReadHalf, OwnedWriteHalf, ReadHalf, SocketAddr, UCred, WriteHalf, address_of, name_at, name_of, no_descriptors, try_from_std};
use crate::net::bytes::byte_stream;
use crate::net::{Either, either};

/// See `tokio::net::UnixStream`.
pub struct UnixStream(pub(super) Either<real::net::UnixStream, Box<dyn BedStream>>);

impl UnixStream {
    /// See `tokio::net::UnixStream::connect`.
    #[track_caller]
    pub fn connect<P: AsRef<Path>>(path: P) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("UnixStream::connect");
        async move {
            match crate::net::bed()? {
                None => real::net::UnixStream::connect(path).await.map(|stream| Self(Either::Real(stream))),
                Some(bed) => bed.unix_socket(call)?.connect(&name_of(path.as_ref())?).map(|stream| Self(Either::Bed(stream))),
            }
        }
    }

    /// See `tokio::net::UnixStream::connect_addr`.
    //@ has net/unix/stream.rs|pub async fn connect_addr
    #[track_caller]
    pub fn connect_addr(address: &SocketAddr) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("UnixStream::connect_addr");
        async move {
            match crate::net::bed()? {
                None => real::net::UnixStream::connect_addr(address).await.map(|stream| Self(Either::Real(stream))),
                Some(bed) => bed.unix_socket(call)?.connect(&name_at(address)).map(|stream| Self(Either::Bed(stream))),
            }
        }
    }

    /// See `tokio::net::UnixStream::pair`.
    #[track_caller]
    pub fn pair() -> io::Result<(Self, Self)> {
        match crate::net::bed()? {
            None => real::net::UnixStream::pair().map(|(one, other)| (Self(Either::Real(one)), Self(Either::Real(other)))),
            Some(bed) => bed.unix_pair(Call::here("UnixStream::pair")).map(|ends| ends.map(|end| Self(Either::Bed(end))).into()),
        }
    }

    /// See `tokio::net::UnixStream::from_std`.
    #[track_caller]
    pub fn from_std(stream: std::os::unix::net::UnixStream) -> io::Result<Self> {
        super::refuse_in_bed("UnixStream::from_std")?;
        real::net::UnixStream::from_std(stream).map(|stream| Self(Either::Real(stream)))
    }

    /// See `tokio::net::UnixStream::into_std`.
    pub fn into_std(self) -> io::Result<std::os::unix::net::UnixStream> {
        match self.0 {
            Either::Real(stream) => stream.into_std(),
            Either::Bed(_) => Err(super::refused("UnixStream::into_std")),
        }
    }

    /// See `tokio::net::UnixStream::split`.
    pub fn split(&mut self) -> (ReadHalf<'_>, WriteHalf<'_>) {
        (ReadHalf(self), WriteHalf(self))
    }

    /// See `tokio::net::UnixStream::into_split`.
    pub fn into_split(self) -> (OwnedReadHalf, OwnedWriteHalf) {
        super::halves::halves(self)
    }

    /// See `tokio::net::UnixStream::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |stream| stream.local_addr(), address_of(&stream.local_name()?))
    }

    /// See `tokio::net::UnixStream::peer_addr`.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |stream| stream.peer_addr(), address_of(&stream.peer_name()?))
    }

    /// See `tokio::net::UnixStream::peer_cred`. In a test bed the peer is a program of the same process.
    pub fn peer_cred(&self) -> io::Result<UCred> {
        either!(&self.0, |stream| stream.peer_cred(), {
            stream.peer_name()?;
            super::own_credentials()
        })
    }

    /// See `tokio::net::UnixStream::take_error`.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        either!(&self.0, |stream| stream.take_error())
    }
}

byte_stream!(UnixStream);
no_descriptors!(UnixStream);
try_from_std!(UnixStream);

impl AsRef<Self> for UnixStream {
    fn as_ref(&self) -> &Self {
        self
    }
}
