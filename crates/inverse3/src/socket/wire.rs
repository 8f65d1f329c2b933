//! A WebSocket that never blocks after its handshake.

use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use tungstenite::error::Error;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, WebSocketConfig};
use tungstenite::{HandshakeError, Message, WebSocket};

use crate::protocol::Version;

/// Time that connecting and shaking hands may take. The service is on this machine.
const PATIENCE: Duration = Duration::from_millis(250);
/// Greatest length of a message \[bytes\]. A reply has about a thousand.
const LONGEST: usize = 1 << 20;

/// WebSocket at either end of a connection.
#[derive(Debug)]
pub(super) struct Wire(WebSocket<TcpStream>);

impl Wire {
    /// Opens a connection to a service.
    pub(super) fn connect(address: SocketAddr) -> io::Result<Self> {
        let stream = open(address)?;
        let (socket, _) = tungstenite::client::client_with_config(format!("ws://{address}/"), stream, Some(config())).map_err(of_handshake)?;
        Self::of(socket)
    }

    /// Answers the handshake of a program. Returns `None` for a program that asked for the version, and has got `version`.
    pub(super) fn accept(stream: TcpStream, version: &str) -> io::Result<Option<Self>> {
        prepare(&stream)?;
        let mut begin = [0; 32];
        let count = stream.peek(&mut begin)?;
        if begin[..count].starts_with(b"GET /version") {
            tell(stream, version)?;
            return Ok(None);
        }
        let socket = tungstenite::accept_with_config(stream, Some(config())).map_err(of_handshake)?;
        Self::of(socket).map(Some)
    }

    fn of(socket: WebSocket<TcpStream>) -> io::Result<Self> {
        socket.get_ref().set_nonblocking(true)?;
        Ok(Self(socket))
    }

    /// Sends a text frame, or keeps the frame until the next call of `send` or `receive` if the other end does not read.
    pub(super) fn send(&mut self, text: String) -> io::Result<()> {
        waiting(self.0.send(Message::text(text)))
    }

    /// Returns the next text frame; `None` if no whole frame has come. Frames of other kinds are passed over.
    pub(super) fn receive(&mut self) -> io::Result<Option<String>> {
        waiting(self.0.flush())?;
        loop {
            match self.0.read() {
                Ok(Message::Text(text)) => return Ok(Some(text.as_str().to_owned())),
                Ok(Message::Close(_)) => return Err(io::ErrorKind::ConnectionAborted.into()),
                Ok(_) => {}
                Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                Err(error) => return Err(of_socket(error)),
            }
        }
    }

    /// Closes the connection with status 1000. The other end may be gone already.
    pub(super) fn close(mut self) {
        let _ = self.0.close(Some(CloseFrame { code: CloseCode::Normal, reason: "".into() }));
        let _ = self.0.flush();
    }
}

impl AsFd for Wire {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.get_ref().as_fd()
    }
}

/// Asks a service for its version. `None` if the service has no such answer.
pub(super) fn ask_version(address: SocketAddr) -> io::Result<Option<Version>> {
    let mut stream = open(address)?;
    stream.write_all(format!("GET /version HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes())?;
    let (mut response, mut part) = (Vec::new(), [0; 4096]);
    // A service that keeps the connection open ends the reading by the time-out: what came until then counts.
    while let Ok(count @ 1..) = stream.read(&mut part) {
        response.extend(&part[..count]);
        let version = Version::of_response(&String::from_utf8_lossy(&response));
        if version.is_some() || response.len() > LONGEST {
            return Ok(version);
        }
    }
    Ok(None)
}

fn open(address: SocketAddr) -> io::Result<TcpStream> {
    let stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    prepare(&stream)?;
    Ok(stream)
}

fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))
}

/// Answers a question for the version.
fn tell(mut stream: TcpStream, version: &str) -> io::Result<()> {
    // The question is read, because closing a socket with unread bytes resets the connection.
    let _ = stream.read(&mut [0; 4096])?;
    let length = version.len();
    write!(stream, "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{version}")
}

fn config() -> WebSocketConfig {
    WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST)).max_write_buffer_size(2 * LONGEST).write_buffer_size(0)
}

/// Passes over an attempt that would have to wait: the frame is kept.
fn waiting(result: Result<(), Error>) -> io::Result<()> {
    match result {
        Err(Error::Io(error)) if error.kind() == io::ErrorKind::WouldBlock => Ok(()),
        result => result.map_err(of_socket),
    }
}

fn of_socket(error: Error) -> io::Error {
    if let Error::Io(error) = error { error } else { io::Error::other(error) }
}

fn of_handshake<R: tungstenite::handshake::HandshakeRole>(error: HandshakeError<R>) -> io::Error {
    match error {
        HandshakeError::Interrupted(_) => io::ErrorKind::TimedOut.into(),
        HandshakeError::Failure(error) => of_socket(error),
    }
}
