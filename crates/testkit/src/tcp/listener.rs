//! Virtual TCP listener.

use std::fmt;
use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};

use cohaptic_wan::NodeId;

#[cfg(feature = "facade")]
use super::TcpConfig;
use super::{KIND, TcpStream};
use crate::context::Call;
use crate::core::{Core, HoldId, Inherited, ListenId, Shared, Sharing};
use crate::resolve::{ToSocketAddrs, each};

/// Default backlog. Linux lets one more connection wait.
const BACKLOG: usize = 128;

/// TCP listener of a host of the running test bed, with the methods of tokio's `TcpListener` in the same meaning.
///
/// Differences to tokio's listener, and further properties:
///
/// - The listener is bound on the host of the task that calls `bind`; [`Host::listen`](crate::Host::listen) names another host.
/// - At most 129 connections wait to be accepted; [`TcpSocket::listen`](crate::TcpSocket::listen) takes another number. As with Linux, a SYN beyond that number
///   is dropped without an answer, so that its sender tries again after 1, 3, 7 … s.
/// - A connection that is reset during the wait is accepted all the same, and reading from the connection fails.
/// - A listener at `[::]` accepts connections over both versions of IP, as with Linux. The peer of a connection over IPv4 is then shown as `::ffff:10.0.0.1`.
///   [`TcpSocket::set_only_v6`](crate::TcpSocket::set_only_v6) leaves IPv4 to other sockets.
/// - After its host has crashed, every method returns [`io::ErrorKind::ConnectionAborted`], with the way out. The same error comes from every method after the
///   run of the test bed has ended, also within the run of another test bed.
/// - The listener belongs to the thread that runs the test bed. On another thread every method returns [`io::ErrorKind::Unsupported`], and the run fails.
pub struct TcpListener {
    shared: Arc<Shared>,
    host: NodeId,
    id: ListenId,
}

impl TcpListener {
    /// Listens on the host of the running task. `0.0.0.0` and `[::]` stand for all addresses of the host. Port 0 stands for a free port; such ports are given
    /// in turn from 49152 on.
    ///
    /// # Errors
    ///
    /// As with tokio, the errors of the last tried address: the address is taken by another listener, or is no address of the host.
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
        each(address, |address| {
            let (held, config) = shared.with(|core| {
                core.check_up(host)?;
                // Tokio, too, sets `SO_REUSEADDR` for listeners, so that a program can listen again while old connections linger.
                let held = core.hold_port(host, address, Sharing { is_shared: true, is_only_six: false })?;
                io::Result::Ok((held, core.tcp_config(host).clone()))
            })?;
            Self::listen(Arc::clone(&shared), host, held, BACKLOG, (config, None))
        })
    }

    /// Listens at a held port. After an error the port is released.
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

    /// Asks the state about the listener.
    ///
    /// # Errors
    ///
    /// If the run has ended, outside of the thread of the run, or if the host of the listener has crashed.
    fn open<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, |core| {
            core.check_listener(self.id)?;
            Ok(ask(core))
        })?
    }

    /// Waits for a connection. Returns the connection and the address of its other end.
    ///
    /// # Errors
    ///
    /// If the host of the listener has crashed.
    pub async fn accept(&self) -> io::Result<(TcpStream, SocketAddr)> {
        poll_fn(|cx| self.poll_accept(cx)).await
    }

    /// Accepts a connection. If no connection waits, the task is woken when a connection can be accepted.
    ///
    /// # Errors
    ///
    /// As [`TcpListener::accept`].
    pub fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(TcpStream, SocketAddr)>> {
        match self.take_waiting()? {
            Some(accepted) => Poll::Ready(Ok(accepted)),
            None => {
                self.open(|core| core.wait_to_accept(self.id, cx.waker()))?;
                Poll::Pending
            }
        }
    }

    /// Accepts a connection. Returns `None` if no connection waits.
    pub(super) fn take_waiting(&self) -> io::Result<Option<(TcpStream, SocketAddr)>> {
        let accepted = self.shared.open(self.host, KIND, |core| core.accept(self.id))??;
        Ok(accepted.map(|(id, peer)| (TcpStream::new(Arc::clone(&self.shared), self.host, id), peer)))
    }

    /// Returns whether a connection waits to be accepted.
    #[cfg(feature = "facade")]
    pub(super) fn has_waiting(&self) -> io::Result<bool> {
        self.open(|core| core.has_waiting(self.id))
    }

    /// Returns the address at which the listener listens.
    ///
    /// # Errors
    ///
    /// If the host of the listener has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.open(|core| core.listener_address(self.id))
    }

    /// Reads or changes the inheritance of the connections to be accepted: the constants of TCP, and the time to linger.
    #[cfg(feature = "facade")]
    pub(crate) fn inherited<T>(&self, act: impl FnOnce(&mut TcpConfig, &mut Option<std::time::Duration>) -> T) -> io::Result<T> {
        self.open(|core| {
            let (config, linger) = core.listener_inherited(self.id);
            act(config, linger)
        })
    }

    /// Returns the time to live of packets of accepted connections. The time to live has no effect, because a test bed has no routers that count it down.
    ///
    /// # Errors
    ///
    /// If the host of the listener has crashed.
    pub fn ttl(&self) -> io::Result<u32> {
        self.open(|core| core.listener_config(self.id).ttl.into())
    }

    /// Sets the time to live of packets of accepted connections, from 1 to 255. The time to live is in the packets and in captures, and has no other effect:
    /// see [`TcpListener::ttl`].
    ///
    /// # Errors
    ///
    /// If `ttl` is out of range, or the host of the listener has crashed.
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
