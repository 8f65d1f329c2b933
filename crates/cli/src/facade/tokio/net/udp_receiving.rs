//! Receiving of datagrams.

use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use cohaptic_sockets::Datagrams;
use real::io::ReadBuf;

use super::super::{Either, either};
use super::{UdpSocket, copy, fill};

/// Hands the next datagram to `look`, and waits for one.
async fn receive<T>(socket: &dyn Datagrams, peek: bool, mut look: impl FnMut(&[u8], SocketAddr) -> T) -> io::Result<T> {
    poll_fn(|cx| poll(socket, cx, peek, &mut look)).await
}

fn poll<T>(socket: &dyn Datagrams, cx: &mut Context<'_>, peek: bool, mut look: impl FnMut(&[u8], SocketAddr) -> T) -> Poll<io::Result<T>> {
    let mut seen = None;
    socket.poll_receive(cx, peek, &mut |datagram| seen = Some(look(datagram.bytes, datagram.from))).map_ok(|()| seen.expect("a received datagram is handed over"))
}

fn try_receive<T>(socket: &dyn Datagrams, peek: bool, mut look: impl FnMut(&[u8], SocketAddr) -> T) -> io::Result<T> {
    let mut seen = None;
    socket.try_receive(peek, &mut |datagram| seen = Some(look(datagram.bytes, datagram.from)))?;
    Ok(seen.expect("a received datagram is handed over"))
}

impl UdpSocket {
    /// See `tokio::net::UdpSocket::readable`.
    pub async fn readable(&self) -> io::Result<()> {
        match &self.0 {
            Either::Real(socket) => socket.readable().await,
            Either::Bed(socket) => poll_fn(|cx| socket.poll_readable(cx)).await,
        }
    }

    /// See `tokio::net::UdpSocket::poll_recv_ready`.
    pub fn poll_recv_ready(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |socket| socket.poll_recv_ready(cx), socket.poll_readable(cx))
    }

    /// See `tokio::net::UdpSocket::recv`.
    pub async fn recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.recv(buffer).await,
            Either::Bed(socket) => receive(&**socket, false, |bytes, _| copy(buffer, bytes)).await,
        }
    }

    /// See `tokio::net::UdpSocket::poll_recv`.
    pub fn poll_recv(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |socket| socket.poll_recv(cx, buffer), poll(&**socket, cx, false, |bytes, _| fill(buffer, bytes)))
    }

    /// See `tokio::net::UdpSocket::try_recv`.
    pub fn try_recv(&self, buffer: &mut [u8]) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_recv(buffer), try_receive(&**socket, false, |bytes, _| copy(buffer, bytes)))
    }

    /// See `tokio::net::UdpSocket::recv_from`.
    pub async fn recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        match &self.0 {
            Either::Real(socket) => socket.recv_from(buffer).await,
            Either::Bed(socket) => receive(&**socket, false, |bytes, from| (copy(buffer, bytes), from)).await,
        }
    }

    /// See `tokio::net::UdpSocket::poll_recv_from`.
    pub fn poll_recv_from(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        either!(&self.0, |socket| socket.poll_recv_from(cx, buffer), {
            poll(&**socket, cx, false, |bytes, from| {
                fill(buffer, bytes);
                from
            })
        })
    }

    /// See `tokio::net::UdpSocket::try_recv_from`.
    pub fn try_recv_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        either!(&self.0, |socket| socket.try_recv_from(buffer), try_receive(&**socket, false, |bytes, from| (copy(buffer, bytes), from)))
    }

    /// See `tokio::net::UdpSocket::peek`.
    pub async fn peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.peek(buffer).await,
            Either::Bed(socket) => receive(&**socket, true, |bytes, _| copy(buffer, bytes)).await,
        }
    }

    /// See `tokio::net::UdpSocket::poll_peek`.
    pub fn poll_peek(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        either!(&self.0, |socket| socket.poll_peek(cx, buffer), poll(&**socket, cx, true, |bytes, _| fill(buffer, bytes)))
    }

    /// See `tokio::net::UdpSocket::try_peek`.
    pub fn try_peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_peek(buffer), try_receive(&**socket, true, |bytes, _| copy(buffer, bytes)))
    }

    /// See `tokio::net::UdpSocket::peek_from`.
    pub async fn peek_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        match &self.0 {
            Either::Real(socket) => socket.peek_from(buffer).await,
            Either::Bed(socket) => receive(&**socket, true, |bytes, from| (copy(buffer, bytes), from)).await,
        }
    }

    /// See `tokio::net::UdpSocket::poll_peek_from`.
    pub fn poll_peek_from(&self, cx: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<SocketAddr>> {
        either!(&self.0, |socket| socket.poll_peek_from(cx, buffer), {
            poll(&**socket, cx, true, |bytes, from| {
                fill(buffer, bytes);
                from
            })
        })
    }

    /// See `tokio::net::UdpSocket::try_peek_from`.
    pub fn try_peek_from(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        either!(&self.0, |socket| socket.try_peek_from(buffer), try_receive(&**socket, true, |bytes, from| (copy(buffer, bytes), from)))
    }

    /// See `tokio::net::UdpSocket::peek_sender`.
    pub async fn peek_sender(&self) -> io::Result<SocketAddr> {
        match &self.0 {
            Either::Real(socket) => socket.peek_sender().await,
            Either::Bed(socket) => receive(&**socket, true, |_, from| from).await,
        }
    }

    /// See `tokio::net::UdpSocket::poll_peek_sender`.
    pub fn poll_peek_sender(&self, cx: &mut Context<'_>) -> Poll<io::Result<SocketAddr>> {
        either!(&self.0, |socket| socket.poll_peek_sender(cx), poll(&**socket, cx, true, |_, from| from))
    }

    /// See `tokio::net::UdpSocket::try_peek_sender`.
    pub fn try_peek_sender(&self) -> io::Result<SocketAddr> {
        either!(&self.0, |socket| socket.try_peek_sender(), try_receive(&**socket, true, |_, from| from))
    }
}

/// Receiving into buffers that may grow.
#[cfg(feature = "io-util")]
impl UdpSocket {
    /// See `tokio::net::UdpSocket::recv_buf`.
    pub async fn recv_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
        match &self.0 {
            Either::Real(socket) => socket.recv_buf(buffer).await,
            Either::Bed(socket) => receive(&**socket, false, |bytes, _| put(buffer, bytes)).await,
        }
    }

    /// See `tokio::net::UdpSocket::try_recv_buf`.
    pub fn try_recv_buf<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<usize> {
        either!(&self.0, |socket| socket.try_recv_buf(buffer), try_receive(&**socket, false, |bytes, _| put(buffer, bytes)))
    }

    /// See `tokio::net::UdpSocket::recv_buf_from`.
    pub async fn recv_buf_from<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<(usize, SocketAddr)> {
        match &self.0 {
            Either::Real(socket) => socket.recv_buf_from(buffer).await,
            Either::Bed(socket) => receive(&**socket, false, |bytes, from| (put(buffer, bytes), from)).await,
        }
    }

    /// See `tokio::net::UdpSocket::try_recv_buf_from`.
    pub fn try_recv_buf_from<B: bytes::BufMut>(&self, buffer: &mut B) -> io::Result<(usize, SocketAddr)> {
        either!(&self.0, |socket| socket.try_recv_buf_from(buffer), try_receive(&**socket, false, |bytes, from| (put(buffer, bytes), from)))
    }
}

/// Appends as much of a datagram as a buffer takes.
#[cfg(feature = "io-util")]
fn put(buffer: &mut impl bytes::BufMut, bytes: &[u8]) -> usize {
    let count = bytes.len().min(buffer.remaining_mut());
    buffer.put_slice(&bytes[..count]);
    count
}
