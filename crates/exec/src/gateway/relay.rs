//! Connection beyond the link: the end of TCP inside, the socket outside, and the data between both.

use std::io::{self, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};

use cohaptic_tcp::{Connection, Error, Segment};
use cohaptic_units::Instant;
use rustix::net::sockopt::set_socket_linger;

/// Bytes moved by one call at most.
pub(super) const PIECE: usize = 1 << 16;

/// Two ends with data passed between both: a connection with the program inside, and a socket of the real machine.
///
/// Each direction ends by itself, as TCP allows: an end of data on one side becomes an end of data on the other side, after all data. A reset on one side
/// becomes a reset on the other side, and waiting data is lost with both, as on one connection.
#[derive(Debug)]
pub(super) struct Relay {
    pub(super) connection: Connection,
    /// Socket, or `None` once both directions have ended.
    socket: Option<TcpStream>,
    /// The socket may have data. Cleared when a read would wait, and set by the system's next event.
    pub(super) may_read: bool,
    /// The socket may take data.
    pub(super) may_write: bool,
    /// Data on the way out.
    outward: Waiting,
    /// Data on the way in.
    inward: Waiting,
}

/// Data of one direction, given by one side and not yet taken by the other side.
#[derive(Debug, Default)]
struct Waiting {
    data: Vec<u8>,
    /// Bytes of `data` taken by the other side so far.
    taken: usize,
    /// The giving side has ended its data.
    is_ended: bool,
    /// The end of the data was passed on.
    is_shut: bool,
}

impl Waiting {
    fn rest(&self) -> &[u8] {
        &self.data[self.taken..]
    }

    const fn is_empty(&self) -> bool {
        self.taken == self.data.len()
    }

    /// Returns whether more data can be asked of the giving side: all earlier data was taken, which bounds the memory.
    const fn wants(&self) -> bool {
        self.is_empty() && !self.is_ended
    }

    /// Returns whether the end of the data is due.
    const fn shuts(&self) -> bool {
        self.is_empty() && self.is_ended && !self.is_shut
    }

    fn fill(&mut self, data: &[u8]) {
        self.data.clear();
        self.data.extend_from_slice(data);
        self.taken = 0;
        self.is_ended = data.is_empty();
    }
}

impl Relay {
    pub(super) fn new(connection: Connection, socket: TcpStream) -> Self {
        Self { connection, socket: Some(socket), may_read: true, may_write: true, outward: Waiting::default(), inward: Waiting::default() }
    }

    /// Passes data in both directions until neither can go on. `buffer` has [`PIECE`] bytes of room.
    pub(super) fn pass(&mut self, now: Instant, buffer: &mut [u8]) {
        while let Some(socket) = &self.socket {
            let outward = pass_outward(&mut self.connection, socket, &mut self.outward, &mut self.may_write, buffer);
            let moved = outward.and_then(|outward| {
                let inward = pass_inward(&mut self.connection, socket, &mut self.inward, &mut self.may_read, buffer)?;
                Ok(outward || inward)
            });
            match moved {
                Ok(true) => {}
                Ok(false) => break,
                Err(Broken) => return self.reset(now),
            }
        }
        // With both ends of data passed on, the real connection is over. The connection inside still acknowledges and lingers by itself.
        if self.outward.is_shut && self.inward.is_shut {
            self.socket = None;
            self.connection.close(now);
        }
    }

    /// Ends both sides at once.
    pub(super) fn reset(&mut self, now: Instant) {
        if let Some(socket) = self.socket.take() {
            // With a linger of zero, closing the socket resets the connection. If the option fails, the other side sees an ordinary end.
            let _ = set_socket_linger(&socket, Some(std::time::Duration::ZERO));
        }
        self.connection.abort();
        self.connection.close(now);
    }

    /// Returns whether the program inside has ended its data, and all data has gone out to the socket.
    pub(super) fn is_delivered(&self) -> bool {
        self.socket.is_none() || self.outward.is_shut
    }

    /// Returns whether both sides have ended and nothing is left to send.
    pub(super) fn is_over(&self) -> bool {
        self.socket.is_none() && self.connection.is_finished()
    }

    /// Returns the next segment to the program inside.
    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Segment<'static>> {
        self.connection.poll_transmit(now)
    }
}

/// End of a side by a reset, a time-out or another failure.
struct Broken;

impl From<Error> for Broken {
    fn from(_: Error) -> Self {
        Self
    }
}

/// Passes data of the program inside to the socket. Returns whether anything was passed on.
fn pass_outward(
    connection: &mut Connection,
    mut socket: &TcpStream,
    waiting: &mut Waiting,
    may_write: &mut bool,
    buffer: &mut [u8],
) -> Result<bool, Broken> {
    let mut has_moved = false;
    if waiting.is_ended
        && let Some(error) = connection.take_error()
    {
        // A reset may follow the end of the data.
        return Err(error.into());
    }
    if waiting.wants() {
        match connection.read(buffer) {
            Ok(count) => {
                waiting.fill(&buffer[..count]);
                has_moved = true;
            }
            Err(Error::WouldBlock) => {}
            Err(error) => return Err(error.into()),
        }
    }
    // The system reports room once, after a refused write. So writing goes on until the socket refuses or nothing waits.
    while *may_write && !waiting.is_empty() {
        match socket.write(waiting.rest()) {
            Ok(count) => {
                waiting.taken += count;
                has_moved = true;
            }
            Err(error) => *may_write = is_to_repeat(&error)?,
        }
    }
    if waiting.shuts() {
        waiting.is_shut = true;
        socket.shutdown(Shutdown::Write).map_err(|_| Broken)?;
    }
    Ok(has_moved)
}

/// Passes data of the socket to the program inside. Returns whether anything was passed on.
fn pass_inward(
    connection: &mut Connection,
    mut socket: &TcpStream,
    waiting: &mut Waiting,
    may_read: &mut bool,
    buffer: &mut [u8],
) -> Result<bool, Broken> {
    let mut has_moved = false;
    // Without room in the connection the data stays in the socket, whose window then tells the sender outside to wait.
    if *may_read && waiting.wants() && connection.is_writable() {
        match socket.read(buffer) {
            Ok(count) => {
                waiting.fill(&buffer[..count]);
                has_moved = true;
            }
            Err(error) => *may_read = is_to_repeat(&error)?,
        }
    }
    while !waiting.is_empty() {
        match connection.write(waiting.rest()) {
            Ok(count) => {
                waiting.taken += count;
                has_moved = true;
            }
            Err(Error::WouldBlock) => break,
            Err(error) => return Err(error.into()),
        }
    }
    if waiting.shuts() {
        waiting.is_shut = true;
        connection.shutdown();
    }
    Ok(has_moved)
}

/// Returns whether a call can be repeated at once (`true`), or only after the next event of the system (`false`).
fn is_to_repeat(error: &io::Error) -> Result<bool, Broken> {
    if error.kind() == io::ErrorKind::Interrupted {
        Ok(true)
    } else if error.kind() == io::ErrorKind::WouldBlock {
        Ok(false)
    } else {
        Err(Broken)
    }
}
