//! What a socket sends.

use std::future::{Future, poll_fn};
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use super::{KIND, UdpSocket};
use crate::core::Outgoing;
use crate::resolve::ToSocketAddrs;

impl UdpSocket {
    /// Sends to the peer; gives the length.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotConnected`] without a peer, `ConnectionRefused` if the peer has told that nobody is at its port, `InvalidInput` if it is too long.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn send(&self, bytes: &[u8]) -> io::Result<usize> {
        self.try_send(bytes)
    }

    /// Sends to the peer; gives the length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`].
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<usize> {
        self.send_now(None, bytes, false)
    }

    /// Sends to an address; gives the length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`]; [`io::ErrorKind::HostUnreachable`] if no host ever had that address.
    #[inline]
    pub fn send_to<'a>(&'a self, bytes: &'a [u8], to: impl ToSocketAddrs + 'a) -> impl Future<Output = io::Result<usize>> + 'a {
        poll_fn(move |_| Poll::Ready(self.send_to_now(&to, bytes)))
    }

    /// Sends to an address; gives the length.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send_to`].
    pub fn try_send_to(&self, bytes: &[u8], to: SocketAddr) -> io::Result<usize> {
        self.send_now(Some(&to), bytes, false)
    }

    /// Sends to the peer; ready at once.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send`].
    pub fn poll_send(&self, _cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Poll::Ready(self.try_send(bytes))
    }

    /// Sends to an address; ready at once.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::send_to`].
    pub fn poll_send_to(&self, _cx: &mut Context<'_>, bytes: &[u8], to: SocketAddr) -> Poll<io::Result<usize>> {
        Poll::Ready(self.try_send_to(bytes, to))
    }

    #[inline]
    fn send_to_now(&self, to: &impl ToSocketAddrs, bytes: &[u8]) -> io::Result<usize> {
        match to.to_socket_addr() {
            Ok(to) => self.send_now(Some(&to), bytes, false),
            // A name means nothing where the socket may not be used, which is the better reason.
            Err(error) => self.shared.check_open(self.host, KIND).and(Err(error)),
        }
    }

    #[inline]
    pub(crate) fn send_now(&self, to: Option<&SocketAddr>, bytes: &[u8], ecn_capable: bool) -> io::Result<usize> {
        let ecn_capable = ecn_capable || self.options.is_ecn_capable();
        let outgoing = Outgoing { to, bytes, ecn_capable };
        self.shared.open(self.host, KIND, |core| core.send(self.id, outgoing))??;
        Ok(bytes.len())
    }

    /// Waits until something can be sent: not at all.
    ///
    /// # Errors
    ///
    /// If the run has ended, or this is another thread.
    #[expect(clippy::unused_async, reason = "as tokio's")]
    pub async fn writable(&self) -> io::Result<()> {
        self.shared.check_open(self.host, KIND)
    }

    /// Always ready: sending never waits.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::writable`].
    pub fn poll_send_ready(&self, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(self.shared.check_open(self.host, KIND))
    }
}
