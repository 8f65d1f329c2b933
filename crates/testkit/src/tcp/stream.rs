//! Virtual TCP stream.

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
use crate::errno::Errno;
use crate::resolve::{ToSocketAddrs, none};

/// TCP connection of a host of the running test bed, with the methods of tokio's `TcpStream` in the same meaning.
///
/// Differences to tokio's stream, and further properties:
///
/// - A connection is opened from the host of the task that calls `connect`; [`Host::connect`](crate::Host::connect) names another host. Ports of connections
///   are given in turn from 49152 on, independently of the ports of UDP.
/// - A stream that is dropped sends the bytes written so far, then FIN. If received bytes were not read, or after [`TcpStream::set_zero_linger`], the stream
///   sends RST instead.
/// - As with Linux, an error of the connection is reported once, after all received bytes were read. Afterwards reads return 0 and writes
///   [`io::ErrorKind::BrokenPipe`].
/// - A host that crashes tells nobody. The peers notice when writing: after [`TcpConfig::retries`] (15 minutes) if the host stays down, or by a RST if the host
///   is up again.
/// - A host with new addresses loses its connections: both ends are silent, and time out when writing.
/// - [`TcpStream::set_linger`] has an effect with zero only, because dropping a stream takes no time.
/// - `from_std`, `into_std` and `AsFd` are missing, because there is no socket of the operating system. The package written by `cohaptic tokio` has these
///   methods, with placeholders.
/// - After its host has crashed, every method returns [`io::ErrorKind::ConnectionAborted`], with the way out. The same error comes from every method after the
///   run of the test bed has ended, also within the run of another test bed.
/// - The stream belongs to the thread that runs the test bed. On another thread every method returns [`io::ErrorKind::Unsupported`], and the run fails.
pub struct TcpStream {
    pub(super) shared: Arc<Shared>,
    host: NodeId,
    pub(super) id: ConnId,
}

impl TcpStream {
    pub(super) const fn new(shared: Arc<Shared>, host: NodeId, id: ConnId) -> Self {
        Self { shared, host, id }
    }

    /// Asks the state about the connection. Works after a crash of the host as well.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run.
    pub(super) fn open<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, ask)
    }

    /// Asks the state about the connection, and fails after a crash of the host.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::open`]; also if the host has crashed.
    pub(super) fn open_alive<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.open(|core| {
            core.check_connection(self.id)?;
            Ok(ask(core))
        })?
    }

    /// Changes the connection with `change`, which gets the present instant.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::open_alive`].
    pub(super) fn change<T>(&self, change: impl FnOnce(Instant, &mut Connection) -> T) -> io::Result<T> {
        self.open(|core| core.change_connection(self.id, change))?
    }

    /// Opens a connection from the host of the running task, and waits until the connection is established.
    ///
    /// # Errors
    ///
    /// The errors of the last tried address: [`io::ErrorKind::ConnectionRefused`] after a round trip if nobody listens there;
    /// [`io::ErrorKind::TimedOut`] after 131 s without an answer; [`io::ErrorKind::HostUnreachable`] after 3 s if no host has the address and the address
    /// belongs to the network of the hosts, 10.0.0.0/8 or `fd00::/8`; [`io::ErrorKind::NetworkUnreachable`] at once for other networks. Errors have the
    /// numbers of the system ([`io::Error::raw_os_error`]).
    ///
    /// # Panics
    ///
    /// Outside of a running test bed, and if the task lives on no host.
    #[track_caller]
    pub fn connect(address: impl ToSocketAddrs) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("TcpStream::connect");
        async move {
            let (shared, host) = call.host("wrap the call in `Host::scope`; `Host::connect` and, for hyper, `Connector` name the host");
            Self::connect_to(&shared, host, address.to_socket_addrs()?).await
        }
    }

    /// Opens a connection to the first address that answers. The addresses are tried in turn.
    pub(crate) async fn connect_to(shared: &Arc<Shared>, host: NodeId, addresses: Vec<SocketAddr>) -> io::Result<Self> {
        let mut failed = none();
        // A loop, and no asynchronous closure: the future of a closure would not be `Send`, and a program may spawn this future on tokio.
        for address in addresses {
            let config = shared.with(|core| core.tcp_config(host).clone());
            let connected = match Self::connect_on(Arc::clone(shared), host, None, address, config) {
                Ok(begun) => begun.established().await,
                Err(error) => Err(error),
            };
            match connected {
                Ok(stream) => return Ok(stream),
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }

    /// Sends the SYN. `bound` is the held port with the local address, or `None` for any free port.
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

    /// Waits until the handshake is over, and returns the error of a failed handshake.
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

    /// Returns the address of this end.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.open_alive(|core| core.ends_of(self.id)[0])
    }

    /// Returns the address of the other end.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] before the connection is established and after it is over.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        let (state, peer) = self.open_alive(|core| (core.connection(self.id).state(), core.ends_of(self.id)[1]))?;
        match state {
            // As with Linux, a connection that is over has no peer any more.
            State::SynSent | State::Closed | State::TimeWait => Errno::NotConnected.fail(),
            State::SynReceived | State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck => {
                Ok(peer)
            }
        }
    }

    /// Returns the figures of the connection: state, round trips, timeout, congestion window and retransmissions. After the end of the run the figures stay as
    /// at the end.
    ///
    /// # Panics
    ///
    /// Outside of the thread of the run, while the run goes on.
    #[must_use]
    pub fn info(&self) -> Info {
        self.shared.with(|core| core.connection(self.id).info())
    }

    /// Takes the error that the next call would otherwise return.
    ///
    /// # Errors
    ///
    /// If the host of the stream has crashed.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        self.open(|core| core.take_error_of(self.id))?
    }

    /// Copies received bytes without taking the bytes from the stream. Waits until bytes are there.
    ///
    /// # Errors
    ///
    /// The error that ended the connection.
    pub async fn peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        poll_fn(|cx| self.poll_peek_into(cx, buffer)).await
    }

    /// Performs `act`, or registers the task with `wait` if `act` would block.
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

    /// Returns the constants of the connection, with the options that the program has set.
    #[cfg(feature = "facade")]
    pub(crate) fn config(&self) -> io::Result<TcpConfig> {
        self.open_alive(|core| core.connection(self.id).config().clone())
    }

    /// Sends FIN after the bytes written so far. As with tokio, nothing happens to a connection that is over.
    #[cfg_attr(not(feature = "tokio"), allow(dead_code, reason = "tokio's traits ask for it"))]
    pub(super) fn shut_write_half(&self) -> io::Result<()> {
        self.change(|_, connection| connection.shutdown())
    }
}

impl TcpStream {
    /// Sends FIN after the bytes written so far, for a half that is dropped. On another thread the act is left to the thread of the run.
    #[cfg(feature = "tokio")]
    pub(super) fn let_write_half_go(&self) {
        let id = self.id;
        // The call fails for a connection whose host has crashed. Such a connection needs no FIN.
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
            let [local, peer] = core.ends_of(self.id);
            (local, peer, core.connection(self.id).state())
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
