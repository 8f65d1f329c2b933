//! TCP listeners.

use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};

use cohaptic_sockets::{Call, Listener};

use super::addr::{no_address, with_real};
use super::bed_socket::BedSocket;
use super::descriptors::{descriptors, from_placeholder, into_placeholder};
use super::{Either, TcpStream, ToSocketAddrs, either};

/// See `tokio::net::TcpListener`.
pub struct TcpListener(pub(super) Either<real::net::TcpListener, BedSocket<Arc<dyn Listener>>>);

impl TcpListener {
    /// See `tokio::net::TcpListener::bind`.
    #[track_caller]
    pub fn bind<A: ToSocketAddrs>(address: A) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("TcpListener::bind");
        async move {
            let target = address.describe();
            drop(address);
            let Some(bed) = super::bed()? else {
                return with_real!(target, |address| real::net::TcpListener::bind(address).await).map(|real| Self(Either::Real(real)));
            };
            let mut failed = no_address("could not resolve to any address");
            for address in target.addresses(&*bed)? {
                match bed.listen(call, address) {
                    Ok(listener) => return Ok(Self(Either::Bed(listener.into()))),
                    Err(error) => failed = error,
                }
            }
            Err(failed)
        }
    }

    /// See `tokio::net::TcpListener::accept`.
    pub async fn accept(&self) -> io::Result<(TcpStream, SocketAddr)> {
        match &self.0 {
            Either::Real(listener) => listener.accept().await.map(|(stream, peer)| (TcpStream(Either::Real(stream)), peer)),
            Either::Bed(_) => poll_fn(|cx| self.poll_accept(cx)).await,
        }
    }

    /// See `tokio::net::TcpListener::poll_accept`.
    pub fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(TcpStream, SocketAddr)>> {
        either!(
            &self.0,
            |listener| listener.poll_accept(cx).map_ok(|(stream, peer)| (TcpStream(Either::Real(stream)), peer)),
            listener.poll_accept(cx).map_ok(|(stream, peer)| (TcpStream(Either::Bed(stream.into())), peer))
        )
    }

    /// See `tokio::net::TcpListener::from_std`.
    #[track_caller]
    pub fn from_std(listener: std::net::TcpListener) -> io::Result<Self> {
        if super::bed()?.is_some() {
            return from_placeholder::<dyn Listener>(listener, "TcpListener::from_std").map(|found| Self(Either::Bed(found)));
        }
        real::net::TcpListener::from_std(listener).map(|real| Self(Either::Real(real)))
    }

    /// See `tokio::net::TcpListener::into_std`.
    pub fn into_std(self) -> io::Result<std::net::TcpListener> {
        match self.0 {
            Either::Real(listener) => listener.into_std(),
            Either::Bed(listener) => into_placeholder(listener, socket2::Type::STREAM, "TcpListener::into_std"),
        }
    }

    /// See `tokio::net::TcpListener::local_addr`.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |listener| listener.local_addr())
    }

    /// See `tokio::net::TcpListener::ttl`.
    pub fn ttl(&self) -> io::Result<u32> {
        either!(&self.0, |listener| listener.ttl())
    }

    /// See `tokio::net::TcpListener::set_ttl`.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        either!(&self.0, |listener| listener.set_ttl(ttl))
    }
}

impl TryFrom<std::net::TcpListener> for TcpListener {
    type Error = io::Error;

    fn try_from(listener: std::net::TcpListener) -> io::Result<Self> {
        Self::from_std(listener)
    }
}

impl fmt::Debug for TcpListener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

descriptors!(TcpListener, STREAM);
