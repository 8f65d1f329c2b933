//! The virtual stream.

use std::fmt;
use std::future::poll_fn;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use cohaptic_tcp::{Connection, State};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::{Info, KIND, TcpConfig};
use crate::context::Call;
use crate::core::{ConnId, Core, HoldId, Shared};
use crate::resolve::ToSocketAddrs;

/// A TCP connection of a host of the running test bed: the methods of tokio's, with the same meaning.
///
/// What differs, or is worth knowing:
///
/// - It is opened from the host of the task that connects; [`Host::connect`](crate::Host::connect) names another one. Ports are counted from 49152 on, apart from
///   those of UDP.
/// - Dropped, it sends what was written, then FIN. If octets were not read, or after [`TcpStream::set_zero_linger`], it sends RST in place of that.
/// - An error of the connection is told once, after all that had arrived was read; then reads give 0 and writes [`io::ErrorKind::BrokenPipe`], as with Linux.
/// - A host that crashes tells nobody. Its peers hear of it when they write: after [`TcpConfig::retries`] if it stays away (15 minutes), or by a RST if it is back.
/// - A host with new addresses loses its connections: both ends are silent, and time out when they write.
/// - [`TcpStream::set_linger`] acts with zero only: to drop a stream takes no time.
/// - `from_std`, `into_std` and `AsFd` are missing: there is no socket of the system.
/// - When its host crashes, every method gives [`io::ErrorKind::ConnectionAborted`], with the way out. So does every method once the run of its test bed has
///   ended, also within the run of another test bed.
/// - It belongs to the thread that runs the test bed. On another thread every method gives [`io::ErrorKind::Unsupported`], and the run fails.
pub struct TcpStream {
    pub(super) shared: Arc<Shared>,
    host: NodeId,
    pub(super) id: ConnId,
}

impl TcpStream {
    pub(super) const fn new(shared: Arc<Shared>, host: NodeId, id: ConnId) -> Self {
        Self { shared, host, id }
    }

    /// Asks the state.
    ///
    /// # Errors
    ///
    /// If the run has ended, or this is another thread.
    pub(super) fn open<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, ask)
    }

    /// Asks the state what a connection without a host cannot answer.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::open`]; if the host has crashed.
    pub(super) fn open_alive<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.open(|core| {
            core.check_connection(self.id)?;
            Ok(ask(core))
        })?
    }

    /// Changes the connection.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::open_alive`].
    pub(super) fn change<T>(&self, change: impl FnOnce(Instant, &mut Connection) -> T) -> io::Result<T> {
        self.open(|core| core.change_connection(self.id, change))?
    }

    /// Opens a connection from the host of the task that is running, and waits until it is there.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::ConnectionRefused`] if nobody listens there, a round trip later; [`io::ErrorKind::TimedOut`] after 127 s without an answer;
    /// [`io::ErrorKind::HostUnreachable`] if no host ever had that address.
    ///
    /// # Panics
    ///
    /// Outside of a running test bed, and if the task lives on no host.
    #[track_caller]
    pub fn connect(address: impl ToSocketAddrs) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("TcpStream::connect");
        async move {
            let (shared, host) = call.host("wrap the call in `Host::scope`; `Host::connect` and, for hyper, `Connector` name the host");
            let address = address.to_socket_addr()?;
            let config = shared.with(|core| core.tcp_config(host).clone());
            Self::connect_on(shared, host, None, address, config)?.established().await
        }
    }

    /// Sends the SYN. `bound`: the port that is held, and the address of that socket.
    pub(crate) fn connect_on(
        shared: Arc<Shared>,
        host: NodeId,
        bound: Option<(HoldId, SocketAddr)>,
        to: SocketAddr,
        config: TcpConfig,
    ) -> io::Result<Self> {
        let id = shared.open(host, KIND, |core| {
            core.check_up(host)?;
            core.connect_tcp(host, bound, to, config)
        })??;
        Ok(Self { shared, host, id })
    }

    /// Waits until the handshake is over.
    pub(crate) async fn established(self) -> io::Result<Self> {
        poll_fn(|cx| {
            self.open(|core| match core.is_settled(self.id) {
                Some(outcome) => Poll::Ready(outcome),
                None => {
                    core.wait_to_write_to(self.id, cx.waker());
                    Poll::Pending
                }
            })?
        })
        .await?;
        Ok(self)
    }

    /// The address of this end.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.open_alive(|core| core.connection(self.id).local_addr())
    }

    /// The address of the other end.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] once the connection is gone.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        let (state, peer) = self.open_alive(|core| {
            let connection = core.connection(self.id);
            (connection.state(), connection.peer_addr())
        })?;
        match state {
            State::SynSent | State::Closed | State::TimeWait => Err(io::ErrorKind::NotConnected.into()),
            State::SynReceived | State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck => {
                Ok(peer)
            }
        }
    }

    /// Figures of the connection: its state, round trips, timeout, congestion window and retransmissions; once the run has ended, those of its end.
    ///
    /// # Panics
    ///
    /// On another thread than that of the run.
    #[must_use]
    pub fn info(&self) -> Info {
        self.shared.with(|core| core.connection(self.id).info())
    }

    /// Takes out the error that the next call would give otherwise.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        self.open(|core| core.take_error_of(self.id))?
    }

    /// Reads what has arrived and leaves it; waits until something has.
    ///
    /// # Errors
    ///
    /// Why the connection is gone.
    pub async fn peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        poll_fn(|cx| self.poll_peek_into(cx, buffer)).await
    }

    /// Does something, or waits until it can be done.
    fn poll_with(
        &self,
        cx: &Context<'_>,
        act: impl FnOnce(&mut Core) -> io::Result<usize>,
        wait: impl FnOnce(&mut Core, ConnId, &Waker),
    ) -> Poll<io::Result<usize>> {
        self.open(|core| match act(core) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                wait(core, self.id, cx.waker());
                Poll::Pending
            }
            outcome => Poll::Ready(outcome),
        })?
    }

    pub(super) fn poll_peek_into(&self, cx: &Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        self.poll_with(cx, |core| core.peek_connection(self.id, buffer), Core::wait_to_read_from)
    }

    #[cfg_attr(not(feature = "tokio"), allow(dead_code, reason = "tokio's traits ask for it"))]
    pub(super) fn poll_read_into(&self, cx: &Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        self.poll_with(cx, |core| core.read(self.id, &mut [IoSliceMut::new(buffer)]), Core::wait_to_read_from)
    }

    #[cfg_attr(not(feature = "tokio"), allow(dead_code, reason = "tokio's traits ask for it"))]
    pub(super) fn poll_write_from(&self, cx: &Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        self.poll_with(cx, |core| core.write(self.id, buffers), Core::wait_to_write_to)
    }

    /// A FIN follows what was written. On a connection that is gone it does nothing, as tokio's.
    #[cfg_attr(not(feature = "tokio"), allow(dead_code, reason = "tokio's traits ask for it"))]
    pub(super) fn shut_write_half(&self) -> io::Result<()> {
        self.change(|_, connection| connection.shutdown())
    }
}

impl TcpStream {
    /// A FIN follows what was written, once the thread of the run has time: for a half that is dropped.
    #[cfg(feature = "tokio")]
    pub(super) fn let_write_half_go(&self) {
        let id = self.id;
        // A connection that went with its host has nothing to shut.
        self.shared.release(move |core| drop(core.change_connection(id, |_, connection| connection.shutdown())));
    }
}

impl Drop for TcpStream {
    fn drop(&mut self) {
        let id = self.id;
        self.shared.release(move |core| core.drop_connection(id));
    }
}

impl fmt::Debug for TcpStream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seen = self.shared.try_with(|core| {
            let connection = core.connection(self.id);
            (connection.local_addr(), connection.peer_addr(), connection.state())
        });
        let Some((local, peer, state)) = seen else { return f.debug_struct("TcpStream").finish_non_exhaustive() };
        f.debug_struct("TcpStream").field("local", &local).field("peer", &peer).field("state", &state).finish_non_exhaustive()
    }
}

impl AsRef<Self> for TcpStream {
    fn as_ref(&self) -> &Self {
        self
    }
}
