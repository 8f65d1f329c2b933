//! Implementations of the traits of `cohaptic-sockets`: see [`crate::facade`].

use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::Duration;

use cohaptic_sockets::{ByteStream, Connecting, Flag, Listener, Number, Ready, Socket, Stream};

use super::socket::TcpSocket;
use super::{TcpListener, TcpStream};

impl ByteStream for TcpStream {
    fn poll_readable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll_read_ready(cx)
    }

    fn poll_writable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll_write_ready(cx)
    }

    fn ready(&self) -> io::Result<Ready> {
        self.open(|core| {
            let [readable, writable, read_closed, write_closed] = core.readiness(self.id);
            Ready { readable, writable, read_closed, write_closed }
        })
    }

    fn poll_read(&self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        self.poll_read_into(cx, buffer)
    }

    fn poll_write(&self, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        self.poll_write_from(cx, buffers)
    }

    fn try_read(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        self.try_read_vectored(buffers)
    }

    fn try_write(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
        self.try_write_vectored(buffers)
    }

    fn shut_down(&self) -> io::Result<()> {
        self.shut_write_half()
    }

    fn let_write_half_go(&self) {
        Self::let_write_half_go(self);
    }

    fn take_error(&self) -> io::Result<Option<io::Error>> {
        Self::take_error(self)
    }
}

impl Stream for TcpStream {
    fn poll_peek(&self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        self.poll_peek_into(cx, buffer)
    }

    fn try_peek(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.open(|core| core.peek_connection(self.id, buffer))?
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Self::local_addr(self)
    }

    fn peer_addr(&self) -> io::Result<SocketAddr> {
        Self::peer_addr(self)
    }

    fn nodelay(&self) -> io::Result<bool> {
        Self::nodelay(self)
    }

    fn set_nodelay(&self, nodelay: bool) -> io::Result<()> {
        Self::set_nodelay(self, nodelay)
    }

    fn quickack(&self) -> io::Result<bool> {
        Self::quickack(self)
    }

    fn set_quickack(&self, quickack: bool) -> io::Result<()> {
        Self::set_quickack(self, quickack)
    }

    fn linger(&self) -> io::Result<Option<Duration>> {
        Self::linger(self)
    }

    fn set_linger(&self, linger: Option<Duration>) -> io::Result<()> {
        Self::set_linger(self, linger)
    }

    fn ttl(&self) -> io::Result<u32> {
        Self::ttl(self)
    }

    fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        Self::set_ttl(self, ttl)
    }
}

impl Listener for TcpListener {
    fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(Box<dyn Stream>, SocketAddr)>> {
        Self::poll_accept(self, cx).map_ok(|(stream, peer)| (Box::new(stream) as Box<dyn Stream>, peer))
    }

    fn try_accept(&self) -> io::Result<(Box<dyn Stream>, SocketAddr)> {
        let accepted = self.take_waiting()?.ok_or(io::ErrorKind::WouldBlock)?;
        Ok((Box::new(accepted.0), accepted.1))
    }

    fn is_ready(&self) -> io::Result<bool> {
        self.has_waiting()
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Self::local_addr(self)
    }

    fn ttl(&self) -> io::Result<u32> {
        Self::ttl(self)
    }

    fn set_ttl(&self, ttl: u32) -> io::Result<()> {
        Self::set_ttl(self, ttl)
    }
}

impl Socket for TcpSocket {
    fn bind(&self, at: SocketAddr) -> io::Result<()> {
        Self::bind(self, at)
    }

    fn connect(self: Box<Self>, to: SocketAddr) -> Connecting {
        Box::pin(async move { Ok(Box::new(Self::connect(*self, to).await?) as Box<dyn Stream>) })
    }

    fn begin(self: Box<Self>, to: SocketAddr) -> io::Result<Box<dyn Stream>> {
        Ok(Box::new(self.begin_to(to)?))
    }

    fn listen(self: Box<Self>, backlog: u32) -> io::Result<Box<dyn Listener>> {
        Ok(Box::new(Self::listen(*self, backlog)?))
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Self::local_addr(self)
    }

    fn flag(&self, flag: Flag) -> io::Result<bool> {
        match flag {
            Flag::KeepAlive => self.keepalive(),
            Flag::ReuseAddress => self.reuseaddr(),
            Flag::ReusePort => self.reuseport(),
            Flag::NoDelay => self.nodelay(),
        }
    }

    fn set_flag(&self, flag: Flag, on: bool) -> io::Result<()> {
        match flag {
            Flag::KeepAlive => self.set_keepalive(on),
            Flag::ReuseAddress => self.set_reuseaddr(on),
            Flag::ReusePort => self.set_reuseport(on),
            Flag::NoDelay => self.set_nodelay(on),
        }
    }

    fn number(&self, number: Number) -> io::Result<u32> {
        match number {
            Number::SendBuffer => self.send_buffer_size(),
            Number::ReceiveBuffer => self.recv_buffer_size(),
            Number::TypeOfService => self.tos_v4(),
        }
    }

    fn set_number(&self, number: Number, value: u32) -> io::Result<()> {
        match number {
            Number::SendBuffer => self.set_send_buffer_size(value),
            Number::ReceiveBuffer => self.set_recv_buffer_size(value),
            Number::TypeOfService => self.set_tos_v4(value),
        }
    }

    fn linger(&self) -> io::Result<Option<Duration>> {
        Self::linger(self)
    }

    fn set_linger(&self, linger: Option<Duration>) -> io::Result<()> {
        Self::set_linger(self, linger)
    }
}
