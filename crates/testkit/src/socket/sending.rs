//! Sending of datagrams.

use std::future::{Future, poll_fn};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::task::{Context, Poll};

use cohaptic_units::Ecn;

use super::{KIND, UdpSocket};
use crate::core::Outgoing;
use crate::current;
use crate::resolve::ToSocketAddrs;

impl UdpSocket {
    /// Sends a datagram to the peer. Returns the number of bytes sent.
    ///
    /// # Errors
    ///
    /// `ConnectionRefused` if no socket is bound to the port of the peer; the error of the system without a peer (`EDESTADDRREQ`) or for a datagram that is too
    /// long (`EMSGSIZE`).
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn send(&self, bytes: &[u8]) -> io::Result<usize> {
        self.try_send(bytes)
    }

    /// Sends a datagram to the peer. Returns the number of bytes sent.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`].
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<usize> {
        self.send_now(None, None, bytes, Ecn::NotCapable)
    }

    /// Sends a datagram to an address. Returns the number of bytes sent.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`]; [`io::ErrorKind::NetworkUnreachable`] for an address of a network other than that of the hosts;
    /// [`io::ErrorKind::PermissionDenied`] for a broadcast without [`UdpSocket::set_broadcast`]; [`io::ErrorKind::InvalidInput`] for port 0.
    #[inline]
    pub fn send_to<'a>(&'a self, bytes: &'a [u8], to: impl ToSocketAddrs + 'a) -> impl Future<Output = io::Result<usize>> + 'a {
        poll_fn(move |_| Poll::Ready(self.send_to_now(&to, bytes)))
    }

    /// Sends a datagram to an address. Returns the number of bytes sent.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send_to`].
    pub fn try_send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        self.send_now(Some(&to), None, bytes, Ecn::NotCapable)
    }

    /// Sends a datagram to the peer. Always ready.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`].
    pub fn poll_send(&self, _cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Poll::Ready(self.try_send(bytes))
    }

    /// Sends a datagram to an address. Always ready.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send_to`].
    pub fn poll_send_to(&self, _cx: &mut Context<'_>, bytes: &[u8], to: SocketAddr) -> Poll<io::Result<usize>> {
        Poll::Ready(self.try_send_to(bytes, to))
    }

    #[inline]
    fn send_to_now(&self, to: &impl ToSocketAddrs, bytes: &[u8]) -> io::Result<usize> {
        if let Some(to) = to.as_socket_addr() {
            return self.send_now(Some(to), None, bytes, Ecn::NotCapable);
        }
        // Names mean what they mean to the host of the socket, also where another task sends.
        match current::on_host(Some(self.host), || to.to_socket_addr()) {
            Ok(to) => self.send_now(Some(&to), None, bytes, Ecn::NotCapable),
            // A name cannot be looked up outside of the run. The error of a socket that may not be used is more useful than the error of the name.
            Err(error) => self.shared.check_open(self.host, KIND).and(Err(error)),
        }
    }

    /// Sends a datagram, from the address `from` of the host if the program names one.
    #[inline]
    pub(crate) fn send_now(&self, to: Option<&SocketAddr>, from: Option<IpAddr>, bytes: &[u8], ecn: Ecn) -> io::Result<usize> {
        // Quinn passes the codepoint of each datagram. All other callers pass none, and the type of service of the socket decides.
        let ecn = if ecn.is_capable() { ecn } else { self.options.ecn() };
        // A socket of IPv6 names an address of IPv4 as `::ffff:10.0.0.1`. The unspecified address stands for none.
        let from = from.map(|from| from.to_canonical()).filter(|from| !from.is_unspecified());
        let outgoing = Outgoing { to, from, bytes, ecn };
        self.shared.open(self.host, KIND, |core| core.send(self.id, outgoing))??;
        Ok(bytes.len())
    }

    /// Returns at once, because sending never waits.
    ///
    /// # Errors
    ///
    /// If the run has ended, or outside of the thread of the run.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn writable(&self) -> io::Result<()> {
        self.shared.check_open(self.host, KIND)
    }

    /// Always ready, because sending never waits.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::writable`].
    pub fn poll_send_ready(&self, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(self.shared.check_open(self.host, KIND))
    }
}
