//! Socket for quinn: a virtual UDP socket, with congestion marks in both directions.

use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use ::quinn::udp::{EcnCodepoint, RecvMeta, Transmit};
use ::quinn::{AsyncUdpSocket, UdpPoller};
use cohaptic_units::Ecn;

use crate::core::Parcel;
use crate::host::Host;
use crate::resolve::ToSocketAddrs;
use crate::socket::UdpSocket;

/// Socket of an endpoint.
#[derive(Debug)]
pub(super) struct VirtualSocket {
    socket: UdpSocket,
}

impl VirtualSocket {
    pub(super) fn new(host: &Host, address: impl ToSocketAddrs) -> io::Result<Self> {
        Ok(Self { socket: host.bind(address)? })
    }
}

impl AsyncUdpSocket for VirtualSocket {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Box::pin(AlwaysWritable)
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        match self.socket.send_now(Some(&transmit.destination), transmit.src_ip, transmit.contents, codepoint(transmit.ecn)) {
            // The host has crashed, so the endpoint must end.
            Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => Err(error),
            // As with the sockets of quinn itself, a datagram that cannot be sent is lost, and the protocol notices the loss. So is a datagram from an address
            // that the host has given up.
            Ok(_) | Err(_) => Ok(()),
        }
    }

    fn poll_recv(&self, cx: &mut Context<'_>, buffers: &mut [IoSliceMut<'_>], metas: &mut [RecvMeta]) -> Poll<io::Result<usize>> {
        let mut count = 0;
        for (buffer, meta) in buffers.iter_mut().zip(metas) {
            let filled = if count == 0 {
                match self.socket.poll_look::<false, _>(cx, |datagram| fill(buffer, datagram)) {
                    Poll::Ready(filled) => filled?,
                    Poll::Pending => return Poll::Pending,
                }
            } else {
                // The first datagram came from `poll_look`, which registers the waker. An error here comes again with the next call.
                let Ok(filled) = self.socket.try_look::<false, _>(|datagram| fill(buffer, datagram)) else { break };
                filled
            };
            *meta = filled;
            count += 1;
        }
        Poll::Ready(Ok(count))
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    fn may_fragment(&self) -> bool {
        false
    }
}

/// Copies a datagram, cut to the length of the buffer, and returns its description.
fn fill(buffer: &mut [u8], datagram: &Parcel) -> RecvMeta {
    let len = datagram.copy_to(buffer);
    RecvMeta { addr: datagram.from(), len, stride: len, ecn: EcnCodepoint::from_bits(datagram.codepoint().bits()), dst_ip: Some(datagram.to()) }
}

/// Returns the codepoint of a datagram of quinn.
fn codepoint(ecn: Option<EcnCodepoint>) -> Ecn {
    ecn.map_or(Ecn::NotCapable, |ecn| Ecn::from_bits(ecn as u8))
}

/// Poller of writability, which is always ready because sending never waits.
#[derive(Debug)]
struct AlwaysWritable;

impl UdpPoller for AlwaysWritable {
    fn poll_writable(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
