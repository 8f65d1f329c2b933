//! Virtual UDP socket.

#[cfg(feature = "facade")]
mod facade;
mod multicast;
mod options;
mod receiving;
mod sending;

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::context::Call;
use crate::core::{Core, Shared, SocketId};
use crate::errno::Errno;
use crate::resolve::{ToSocketAddrs, each};

/// Name of this kind of socket in messages.
const KIND: &str = "a UDP socket";

/// UDP socket of a host of the running test bed, with the methods of tokio's `UdpSocket` in the same meaning.
///
/// Differences to tokio's socket, and further properties:
///
/// - The socket is bound on the host of the task that calls `bind`; [`Host::bind`](crate::Host::bind) names another host. Binding, connecting and dropping take
///   no time.
/// - Sending never waits: the link drops a packet that it cannot take, as a network does. [`UdpSocket::try_send`] never returns `WouldBlock`.
/// - The size of a datagram on its link is its number of bytes. Headers count only if the `overhead` of the link (the second word of `rate`) says so.
/// - A datagram is lost if the buffer of the receiving socket is full: see [`Testbed::receive_buffer`](crate::Testbed::receive_buffer). As with Linux, a
///   datagram is cut off if it is longer than the buffer passed to receive it.
/// - If no socket is bound to the port of the peer, a connected socket gets [`io::ErrorKind::ConnectionRefused`] after the answer has come back over the link:
///   from the next call, or from the call that waits to receive.
/// - A socket at `[::]` receives over both versions of IP, as with Linux. The sender of a datagram over IPv4 is then shown as `::ffff:10.0.0.1`.
/// - A datagram to an address of the network of the hosts, 10.0.0.0/8 or `fd00::/8`, that no host has is lost without an error, as in a real network.
/// - Errors have the numbers of the system ([`io::Error::raw_os_error`]), as far as the system has the error.
/// - After its host has crashed, every method returns [`io::ErrorKind::ConnectionAborted`], with the way out. The same error comes from every method after the
///   run of the test bed has ended, also within the run of another test bed: a task or a destructor may outlive the run. Binding a socket where there is no
///   host is a fault of the test, and panics.
/// - The socket belongs to the thread that runs the test bed. On another thread every method returns [`io::ErrorKind::Unsupported`], and the run fails.
pub struct UdpSocket {
    shared: Arc<Shared>,
    host: NodeId,
    id: SocketId,
    options: options::Options,
}

impl UdpSocket {
    /// Binds a socket on the host of the running task. `0.0.0.0` and `[::]` stand for all addresses of the host. Port 0 stands for a free port; such ports are
    /// given in turn from 49152 on.
    ///
    /// # Errors
    ///
    /// As with tokio, the errors of the last tried address: the address is taken, or is no address of the host.
    ///
    /// # Panics
    ///
    /// Outside of a running test bed, and if the task lives on no host.
    #[track_caller]
    pub fn bind(address: impl ToSocketAddrs) -> impl Future<Output = io::Result<Self>> {
        let call = Call::here("UdpSocket::bind");
        async move {
            let (shared, host) = call.host("bind with `Host::bind`");
            Self::bind_on(shared, host, address)
        }
    }

    pub(crate) fn bind_on(shared: Arc<Shared>, host: NodeId, address: impl ToSocketAddrs) -> io::Result<Self> {
        // The socket is checked before the address is looked up: on another thread, or after the run, a name means nothing or names another host.
        shared.check_open(host, KIND)?;
        let id = each(address, |address| {
            shared.with(|core| {
                core.check_up(host)?;
                core.bind(host, address)
            })
        })?;
        Ok(Self { shared, host, id, options: options::Options::default() })
    }

    /// Asks the state about the socket.
    ///
    /// # Errors
    ///
    /// If the run has ended, outside of the thread of the run, or if the host of the socket has crashed.
    fn open<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, |core| {
            core.check_alive(self.id)?;
            Ok(ask(core))
        })?
    }

    /// Returns the address to which the socket is bound. A connected socket that is bound to all addresses has the source address of packets to the peer.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.open(|core| core.local_of(self.id))
    }

    /// Returns the peer to which the socket is connected.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] if the socket is not connected.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        self.open(|core| core.peer_of(self.id))?.ok_or_else(|| Errno::NotConnected.into())
    }

    /// Connects the socket, which from now on sends to `peer` and receives from `peer` alone. Datagrams that have arrived before stay in the buffer.
    ///
    /// # Errors
    ///
    /// The errors of the last tried address: the socket cannot send to the address, because the address is of the other version of IP, of a network that cannot
    /// be reached, or a broadcast address without [`UdpSocket::set_broadcast`].
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn connect(&self, peer: impl ToSocketAddrs) -> io::Result<()> {
        self.shared.check_open(self.host, KIND)?;
        each(peer, |peer| self.connect_now(peer))
    }

    fn connect_now(&self, peer: SocketAddr) -> io::Result<()> {
        self.shared.check_open(self.host, KIND)?;
        self.shared.with(|core| core.connect(self.id, peer))
    }

    /// Returns whether the socket may send to 255.255.255.255 or 10.255.255.255. Sockets bound to `0.0.0.0` or `[::]` hear such a datagram on all hosts, the
    /// sender's own included. Sockets bound to an address do not.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn broadcast(&self) -> io::Result<bool> {
        self.open(|core| *core.may_broadcast(self.id))
    }

    /// Sets whether the socket may send to 255.255.255.255 or 10.255.255.255.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn set_broadcast(&self, on: bool) -> io::Result<()> {
        self.open(|core| *core.may_broadcast(self.id) = on)
    }

    /// Takes the error that the next call would otherwise return.
    ///
    /// # Errors
    ///
    /// If the host of the socket has crashed.
    pub fn take_error(&self) -> io::Result<Option<io::Error>> {
        self.open(|core| core.take_error(self.id))
    }
}

impl Drop for UdpSocket {
    fn drop(&mut self) {
        let id = self.id;
        self.shared.release(move |core| core.close(id));
    }
}

impl fmt::Debug for UdpSocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let local = self.shared.try_with(|core| core.local_of(self.id));
        f.debug_struct("UdpSocket").field("local", &local).finish_non_exhaustive()
    }
}
