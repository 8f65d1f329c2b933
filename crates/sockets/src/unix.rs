//! Unix sockets and pipes. In a test bed, sockets and pipes live in memory, and the names of sockets belong to one host.

use std::fmt;
use std::io;
use std::net::Shutdown;
use std::path::PathBuf;
use std::task::{Context, Poll, Waker};

use crate::{ByteStream, Ready};

/// Name of a Unix socket.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Default, Debug)]
pub enum UnixName {
    /// No name: the socket was not bound.
    #[default]
    Unnamed,
    /// Path of a file.
    Path(PathBuf),
    /// Name of the abstract namespace of Linux, without the leading zero.
    Abstract(Vec<u8>),
}

impl fmt::Display for UnixName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unnamed => f.write_str("without a name"),
            Self::Path(path) => write!(f, "`{}`", path.display()),
            Self::Abstract(name) => write!(f, "`@{}`", name.escape_ascii()),
        }
    }
}

/// Connection of a Unix socket.
#[expect(clippy::missing_errors_doc, reason = "the documentation of `ByteStream` names the errors of all methods")]
pub trait UnixStream: ByteStream {
    /// Returns the name of this end.
    fn local_name(&self) -> io::Result<UnixName>;
    /// Returns the name of the other end.
    fn peer_name(&self) -> io::Result<UnixName>;
}

/// Listener of a Unix socket. All methods fail as the methods of [`ByteStream`] do.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait UnixListener: fmt::Debug + Send + Sync {
    /// Accepts a connection, and returns the name of the connection's other end.
    fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(Box<dyn UnixStream>, UnixName)>>;
    /// Returns the name at which the listener listens.
    fn local_name(&self) -> io::Result<UnixName>;
}

/// Unix socket of streams, neither connected nor listening. All methods fail as the methods of [`ByteStream`] do.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait UnixSocket: fmt::Debug + Send + Sync {
    /// Binds the socket to a name.
    fn bind(&self, name: &UnixName) -> io::Result<()>;
    /// Connects to the listener at `name`. Nothing waits: the connection is established at once, or not at all.
    fn connect(self: Box<Self>, name: &UnixName) -> io::Result<Box<dyn UnixStream>>;
    /// Listens. `backlog` + 1 connections may wait to be accepted.
    fn listen(self: Box<Self>, backlog: u32) -> io::Result<Box<dyn UnixListener>>;
}

/// Unix socket of datagrams.
///
/// Sending and receiving return [`io::ErrorKind::WouldBlock`] in place of waiting, and then wake `waker` when another attempt is worth its while. All methods
/// fail as the methods of [`ByteStream`] do.
#[expect(clippy::missing_errors_doc, reason = "the documentation of the trait names the errors of all methods")]
pub trait UnixDatagrams: fmt::Debug + Send + Sync {
    /// Binds the socket to a name.
    fn bind(&self, name: &UnixName) -> io::Result<()>;
    /// Connects the socket to the socket at `name`.
    fn connect(&self, name: &UnixName) -> io::Result<()>;
    /// Sends a datagram to the socket at `to`, or to the peer if the socket is connected. Returns the number of bytes.
    fn send(&self, waker: Option<&Waker>, bytes: &[u8], to: Option<&UnixName>) -> io::Result<usize>;
    /// Receives a datagram, cut to the length of the buffer. Returns the number of bytes and the name of the sender.
    fn receive(&self, waker: Option<&Waker>, buffer: &mut [u8]) -> io::Result<(usize, UnixName)>;
    /// Returns the operations that would not block now. Wakes `waker` when another operation does not block any more.
    fn ready(&self, waker: Option<&Waker>) -> io::Result<Ready>;
    /// Returns the name of the socket.
    fn local_name(&self) -> io::Result<UnixName>;
    /// Returns the name of the peer of a connected socket.
    fn peer_name(&self) -> io::Result<UnixName>;
    /// Refuses to receive, to send, or both.
    fn shut_down(&self, how: Shutdown) -> io::Result<()>;
}
