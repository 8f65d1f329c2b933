//! The virtual UDP socket.

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
use crate::resolve::ToSocketAddrs;

/// Name of this kind of socket in messages.
const KIND: &str = "a UDP socket";

/// A UDP socket of a host of the running test bed: the methods of tokio's, with the same meaning.
///
/// What differs, or is worth knowing:
///
/// - It is bound on the host of the task that binds it; [`Host::bind`](crate::Host::bind) names another one. To be bound, connected or dropped takes no time.
/// - Sending never waits: what the link cannot take it drops, as a network does. [`UdpSocket::try_send`] never gives `WouldBlock`.
/// - A datagram counts in its link with the bytes that it carries. Headers are counted where the link's `overhead` (the second word of `rate`) says so.
/// - A datagram that finds the buffer of the socket full is lost: see [`Testbed::receive_buffer`](crate::Testbed::receive_buffer). One that is longer than the
///   buffer given to receive it is cut off, as with Linux.
/// - If no socket is at the port of the peer, a connected socket gets [`io::ErrorKind::ConnectionRefused`], once the answer has come back over the
///   link: by the next call, or by the call that waits to receive.
/// - A socket at `[::]` hears IPv6 only.
/// - When its host crashes, every method gives [`io::ErrorKind::ConnectionAborted`], with the way out. So does every method once the run of its test bed has
///   ended, also within the run of another test bed: a task or a destructor may outlive the run. To bind a socket where there is no host is a fault of the
///   test, and panics.
/// - It belongs to the thread that runs the test bed. On another thread every method gives [`io::ErrorKind::Unsupported`], and the run fails.
pub struct UdpSocket {
    shared: Arc<Shared>,
    host: NodeId,
    id: SocketId,
    options: options::Options,
}

impl UdpSocket {
    /// Binds a socket on the host of the task that is running. `0.0.0.0` and `[::]` hear all addresses of the host, port 0 is given a free one: from 49152 on, in
    /// turn.
    ///
    /// # Errors
    ///
    /// As tokio's: the address is taken, or is not the host's.
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
        // The host is asked before the address is looked up: a name means nothing, or another host, where this one may not be used.
        shared.check_open(host, KIND)?;
        let address = address.to_socket_addr()?;
        let id = shared.with(|core| {
            core.check_up(host)?;
            core.bind(host, address)
        })?;
        Ok(Self { shared, host, id, options: options::Options::default() })
    }

    /// Asks the state.
    ///
    /// # Errors
    ///
    /// If the run has ended, this is another thread, or the host of the socket has crashed.
    fn open<T>(&self, ask: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
        self.shared.open(self.host, KIND, |core| {
            core.check_alive(self.id)?;
            Ok(ask(core))
        })?
    }

    /// The address at which it is bound.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.open(|core| core.local_of(self.id))
    }

    /// The peer to which it is connected.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] if it is not.
    pub fn peer_addr(&self) -> io::Result<SocketAddr> {
        self.open(|core| core.peer_of(self.id))?.ok_or_else(|| io::ErrorKind::NotConnected.into())
    }

    /// From now on it sends to that peer and hears nobody else. What has come before stays in its buffer.
    ///
    /// # Errors
    ///
    /// If the peer is of the other version of IP, or is no address.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn connect(&self, peer: impl ToSocketAddrs) -> io::Result<()> {
        self.shared.check_open(self.host, KIND)?;
        let peer = peer.to_socket_addr()?;
        self.shared.with(|core| core.connect(self.id, peer))
    }

    /// Whether it may send to 255.255.255.255, which reaches all other hosts.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn broadcast(&self) -> io::Result<bool> {
        self.open(|core| *core.may_broadcast(self.id))
    }

    /// Lets it send to 255.255.255.255, or not.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
    pub fn set_broadcast(&self, on: bool) -> io::Result<()> {
        self.open(|core| *core.may_broadcast(self.id) = on)
    }

    /// Takes out the error that the next call would give otherwise.
    ///
    /// # Errors
    ///
    /// If its host has crashed.
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
