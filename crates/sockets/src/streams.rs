//! TCP: streams, listeners, and sockets before the choice between stream and listener.

use std::fmt;
use std::future::Future;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use crate::Configured;

/// Future of a connection under way. `Sync`, because the future of tokio's `TcpStream::connect` is `Sync`.
pub type Connecting = Pin<Box<dyn Future<Output = io::Result<Box<dyn Stream>>> + Send + Sync>>;

/// Readiness of a socket.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Ready {
    /// `true` if a read would not block.
    pub readable: bool,
    /// `true` if a write would not block.
    pub writable: bool,
    /// `true` if the peer sends nothing any more.
    pub read_closed: bool,
    /// `true` if nothing can be written any more.
    pub write_closed: bool,
}

/// Stream of bytes, or an end of a pipe. Dropping the value closes the stream, as dropping a stream of tokio does.
///
/// Methods named `poll_…` register the waker of the context with [`Poll::Pending`]. Methods named `try_…` return [`io::ErrorKind::WouldBlock`] instead. All
/// methods fail after the host of the stream has crashed, after the run of the test bed, and on every thread but the thread of the run.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait ByteStream: fmt::Debug + Send + Sync {
    /// Waits until bytes can be read, or the connection is over.
    fn poll_readable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>>;
    /// Waits until bytes can be written, or the connection is over.
    fn poll_writable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>>;
    /// Returns the operations that would not block now.
    fn ready(&self) -> io::Result<Ready>;
    /// Reads received bytes, and returns the number of bytes; 0 is the end of the stream.
    fn poll_read(&self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>>;
    /// Writes bytes, and returns the number of bytes taken by the send buffer.
    fn poll_write(&self, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>>;
    /// Reads received bytes into the buffers, first to last.
    fn try_read(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize>;
    /// Writes the buffers, first to last.
    fn try_write(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize>;
    /// Ends the stream for the reader after the bytes written so far. TCP sends FIN.
    fn shut_down(&self) -> io::Result<()>;
    /// Like [`ByteStream::shut_down`], for a write half that is dropped. Never fails, and works on every thread: a destructor cannot return an error.
    fn let_write_half_go(&self);
    /// Takes the pending error, with which the next call would fail.
    fn take_error(&self) -> io::Result<Option<io::Error>>;
}

/// TCP connection.
#[expect(clippy::missing_errors_doc, reason = "the documentation of `ByteStream` names the errors of all methods")]
pub trait Stream: ByteStream + Configured {
    /// Like [`ByteStream::poll_read`], but leaves the bytes in the stream.
    fn poll_peek(&self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>>;
    /// Copies received bytes, which stay in the stream, without waiting.
    fn try_peek(&self, buffer: &mut [u8]) -> io::Result<usize>;
    /// Returns the address of this end.
    fn local_addr(&self) -> io::Result<SocketAddr>;
    /// Returns the address of the other end. Fails while the connection is not established.
    fn peer_addr(&self) -> io::Result<SocketAddr>;
    /// Returns whether small segments leave while earlier segments are not acknowledged.
    fn nodelay(&self) -> io::Result<bool>;
    /// Sets whether small segments leave while earlier segments are not acknowledged.
    fn set_nodelay(&self, nodelay: bool) -> io::Result<()>;
    /// Returns whether acknowledgements leave at once.
    fn quickack(&self) -> io::Result<bool>;
    /// Sets whether acknowledgements leave at once.
    fn set_quickack(&self, quickack: bool) -> io::Result<()>;
    /// Returns the time for which closing waits for unsent bytes (`SO_LINGER`), or `None` if closing does not wait.
    fn linger(&self) -> io::Result<Option<Duration>>;
    /// Sets the time for which closing waits for unsent bytes (`SO_LINGER`). `None`: closing does not wait.
    fn set_linger(&self, linger: Option<Duration>) -> io::Result<()>;
    /// Returns the time to live of packets, from 1 to 255.
    fn ttl(&self) -> io::Result<u32>;
    /// Sets the time to live of packets, from 1 to 255.
    fn set_ttl(&self, ttl: u32) -> io::Result<()>;
}

/// TCP listener. All methods fail as the methods of [`ByteStream`] do.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait Listener: Configured + fmt::Debug + Send + Sync {
    /// Accepts a connection, and returns the address of the connection's other end.
    fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(Box<dyn Stream>, SocketAddr)>>;
    /// Like [`Listener::poll_accept`], but returns [`io::ErrorKind::WouldBlock`] in place of waiting.
    fn try_accept(&self) -> io::Result<(Box<dyn Stream>, SocketAddr)>;
    /// Returns whether a connection can be accepted.
    fn is_ready(&self) -> io::Result<bool>;
    /// Returns the address at which the listener listens.
    fn local_addr(&self) -> io::Result<SocketAddr>;
    /// Returns the time to live of packets of accepted connections.
    fn ttl(&self) -> io::Result<u32>;
    /// Sets the time to live of packets of accepted connections.
    fn set_ttl(&self, ttl: u32) -> io::Result<()>;
}

/// Option of a [`Socket`] with the values on and off.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Flag {
    /// `SO_KEEPALIVE`.
    KeepAlive,
    /// `SO_REUSEADDR`.
    ReuseAddress,
    /// `SO_REUSEPORT`.
    ReusePort,
    /// `TCP_NODELAY`.
    NoDelay,
}

/// Option of a [`Socket`] with a number as its value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Number {
    /// Size of the send buffer \[byte\].
    SendBuffer,
    /// Size of the receive buffer \[byte\].
    ReceiveBuffer,
    /// Type of service of IPv4 and traffic class of IPv6.
    TypeOfService,
}

/// TCP socket, neither connected nor listening. All methods fail as the methods of [`ByteStream`] do.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait Socket: Configured + fmt::Debug + Send + Sync {
    /// Binds the socket to a local address.
    fn bind(&self, at: SocketAddr) -> io::Result<()>;
    /// Opens a connection.
    fn connect(self: Box<Self>, to: SocketAddr) -> Connecting;
    /// Opens a connection without waiting. The stream can be written as soon as the connection is established or has failed, and [`ByteStream::take_error`]
    /// then tells which.
    fn begin(self: Box<Self>, to: SocketAddr) -> io::Result<Box<dyn Stream>>;
    /// Listens. `backlog` + 1 connections may wait to be accepted.
    fn listen(self: Box<Self>, backlog: u32) -> io::Result<Box<dyn Listener>>;
    /// Returns the socket's local address.
    fn local_addr(&self) -> io::Result<SocketAddr>;
    /// Returns whether an option is on.
    fn flag(&self, flag: Flag) -> io::Result<bool>;
    /// Switches an option on or off.
    fn set_flag(&self, flag: Flag, on: bool) -> io::Result<()>;
    /// Returns the value of an option that is a number.
    fn number(&self, number: Number) -> io::Result<u32>;
    /// Sets the value of an option that is a number.
    fn set_number(&self, number: Number, value: u32) -> io::Result<()>;
    /// Returns the time for which closing waits for unsent bytes (`SO_LINGER`), or `None` if closing does not wait.
    fn linger(&self) -> io::Result<Option<Duration>>;
    /// Sets the time for which closing waits for unsent bytes (`SO_LINGER`). `None`: closing does not wait.
    fn set_linger(&self, linger: Option<Duration>) -> io::Result<()>;
}
