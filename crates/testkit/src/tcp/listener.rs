//! The virtual listener.

use std::fmt;
use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};

use cohaptic_wan::NodeId;

use super::{KIND, TcpStream};
use crate::context::Call;
use crate::core::{Core, HoldId, Inherited, ListenId, Shared};
use crate::resolve::ToSocketAddrs;

/// How many connections may wait at a listener that does not say it; Linux lets one more wait.
const BACKLOG: usize = 128;

/// A TCP listener of a host of the running test bed: the methods of tokio's, with the same meaning.
///
/// What differs, or is worth knowing:
///
/// - It is bound on the host of the task that binds it; [`Host::listen`](crate::Host::listen) names another one.
/// - 129 connections wait to be accepted ([`TcpSocket::listen`](super::TcpSocket::listen) has another number). A SYN beyond that is dropped without an answer, as
///   Linux does it, so that its sender tries again after 1, 3, 7 … s.
/// - A connection that is reset while it waits is accepted all the same, and reading from it fails.
/// - A listener at `[::]` hears IPv6 only.
/// - When its host crashes, every method gives [`io::ErrorKind::ConnectionAborted`], with the way out. So does every method once the run of its test bed has
///   ended, also within the run of another test bed.
/// - It belongs to the thread that runs the test bed. On another thread every method gives [`io::ErrorKind::Unsupported`], and the run fails.
pub struct TcpListener {
    shared: Arc<Shared>,
    host: NodeId,
    id: ListenId,
}

impl TcpListener {
    /// Listens on the host of the task that is running. `0.0.0.0` and `[::]` hear all addresses of the host, port 0 is given a free one: from 49152 on, in turn.
    ///
    /// # Errors
    ///
    /// As tokio's: the address is taken by another listener, or is not the host's.
    ///
    /// # Panics
    ///
    /// Outside of a running test bed, and if the task lives on no host.
    #[track_caller]
    pub fn bind(address: impl ToSocketAddrs) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("TcpListener::bind");
        async move {
            let (shared, host) = call.host("listen with `Host::listen`");
            Self::bind_on(shared, host, address)
        }
    }

    pub(crate) fn bind_on(shared: Arc<Shared>, host: NodeId, address: impl ToSocketAddrs) -> io::Result<Self> {
        shared.check_open(host, KIND)?;
        let address = address.to_socket_addr()?;
        let (held, config) = shared.with(|core| {
            core.check_up(host)?;
            let held = core.hold_port(host, address, true)?;
            io::Result::Ok((held, core.tcp_config(host).clone()))
        })?;
        Self::listen(shared, host, held, BACKLOG, (config, None))
    }

    /// Listens at a port that is held, and releases it if that fails.
    pub(super) fn listen(shared: Arc<Shared>, host: NodeId, held: (HoldId, SocketAddr), backlog: usize, inherited: Inherited) -> io::Result<Self> {
        let id = shared.open(host, KIND, |core| {
            let listening = core.listen(host, held, backlog, inherited);
            if listening.is_err() {
                core.release_port(held.0);
            }
            listening
        })??;
        Ok(Self { shared, host, id })
    }

    /// Asks the state.
    ///
    /// # Errors
    ///
    /// If the run has ended, this is another thread, or the host of the listener has crashed.
    fn open<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, |core| {
            core.check_listener(self.id)?;
            Ok(ask(core))
        })?
    }

    /// Waits for a connection; gives it and the address of its other end.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub async fn accept(&self) -> io::Result<(TcpStream, SocketAddr)> {
        poll_fn(|cx| self.poll_accept(cx)).await
    }

    /// Takes a connection, or sees to it that the task is woken when there is one.
    ///
    /// # Errors
    ///
    /// As [`TcpListener::accept`].
    pub fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(TcpStream, SocketAddr)>> {
        let accepted = self.shared.open(self.host, KIND, |core| {
            let accepted = core.accept(self.id);
            if matches!(accepted, Ok(None)) {
                core.wait_to_accept(self.id, cx.waker());
            }
            accepted
        })??;
        match accepted {
            Some((id, peer)) => Poll::Ready(Ok((TcpStream::new(Arc::clone(&self.shared), self.host, id), peer))),
            None => Poll::Pending,
        }
    }

    /// The address at which it listens.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.open(|core| core.listener_address(self.id))
    }

    /// The time to live of packets of the connections that it takes, which nothing counts down here: there are no routers.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn ttl(&self) -> io::Result<u32> {
        self.open(|core| core.listener_config(self.id).ttl.into())
    }

    /// Sets that time to live, from 1 to 255.
    ///
    /// # Errors
    ///
    /// If it is none, or its host has crashed.
    pub fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        self.open(|core| {
            core.listener_config(self.id).ttl = super::options::ttl(ttl)?;
            Ok(())
        })?
    }
}

impl Drop for TcpListener {
    fn drop(&mut self) {
        let id = self.id;
        self.shared.release(move |core| core.close_listener(id));
    }
}

impl fmt::Debug for TcpListener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let local = self.shared.try_with(|core| core.listener_address(self.id));
        f.debug_struct("TcpListener").field("local", &local).finish_non_exhaustive()
    }
}
