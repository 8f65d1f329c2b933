//! Unmodified services of axum: [`TcpListener`] implements the trait of listeners of `axum::serve`.
//!
//! `axum::serve` starts tasks with `tokio::spawn`: run it [on tokio](crate::Testbed::on_tokio). Such tasks live on no host: a crash of the host does not drop
//! the tasks, but resets their connections. Responses have a `Date` header with the time of day: two runs differ by the header, unless a layer sets the header.

use std::io;
use std::net::SocketAddr;

use axum::Router;
use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};

use crate::{Host, JoinHandle, TcpListener, TcpStream, ToSocketAddrs};

/// Listens on a host and serves connections, until the host crashes, its program is killed, or the handle aborts the service.
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
            // The host of the listener has crashed, so no connection will come.
            Err(_) => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Self::local_addr(self)
    }
}

/// Address of a client, for `into_make_service_with_connect_info`. Takes the place of `SocketAddr`, because only tokio's own listeners give a `SocketAddr`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct ClientAddress(pub SocketAddr);

impl Connected<IncomingStream<'_, TcpListener>> for ClientAddress {
    fn connect_info(stream: IncomingStream<'_, TcpListener>) -> Self {
        Self(*stream.remote_addr())
    }
}
