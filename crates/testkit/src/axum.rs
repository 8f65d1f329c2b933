//! Unmodified services of axum: [`TcpListener`] is a listener of `axum::serve`.
//!
//! `axum::serve` starts tasks with `tokio::spawn`: run it [on tokio](crate::Testbed::on_tokio). They live on no host: a crash of the host does not drop them, but
//! resets what they hold. Responses have a `Date` header, which reads the time of day: two runs differ by it, unless a layer sets the header.

use std::io;
use std::net::SocketAddr;

use axum::Router;
use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};

use crate::{Host, JoinHandle, TcpListener, TcpStream, ToSocketAddrs};

/// Listens on a host, and serves there from now on: until the host crashes or its program is killed, or the handle aborts it.
///
/// # Errors
///
/// As [`Host::listen`].
///
/// # Panics
///
/// Outside the run, or if the host is down.
#[track_caller]
pub fn serve(host: &Host, address: impl ToSocketAddrs, service: Router) -> io::Result<JoinHandle<io::Result<()>>> {
    let listener = host.listen(address)?;
    Ok(host.spawn(async move { axum::serve(listener, service).await }))
}

impl Listener for TcpListener {
    type Io = TcpStream;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (TcpStream, SocketAddr) {
        match Self::accept(self).await {
            Ok(accepted) => accepted,
            // Its host has crashed, and this listener with it.
            Err(_) => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Self::local_addr(self)
    }
}

/// The address of a client: what `into_make_service_with_connect_info` takes in place of `SocketAddr`, which only tokio's own listeners give.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct ClientAddress(pub SocketAddr);

impl Connected<IncomingStream<'_, TcpListener>> for ClientAddress {
    fn connect_info(stream: IncomingStream<'_, TcpListener>) -> Self {
        Self(*stream.remote_addr())
    }
}
