//! Calls of programs on connections.

use std::fmt::Display;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::SocketAddr;
use std::task::Waker;

use cohaptic_tcp::{Connection, Error, State};
use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::NodeId;

use super::{ConnId, Core, End, Gone};
use crate::core::mapped;
use crate::errno::Errno;

impl End {
    /// Converts an error of the state machine to an error for programs.
    fn explain(&self, error: Error) -> io::Error {
        match error {
            Error::WouldBlock => io::ErrorKind::WouldBlock.into(),
            Error::ConnectionRefused => Errno::ConnectionRefused.into(),
            Error::ConnectionReset => Errno::ConnectionReset.into(),
            Error::TimedOut => Errno::TimedOut.into(),
            Error::BrokenPipe => Errno::BrokenPipe.into(),
            Error::NotConnected => Errno::NotConnected.into(),
            _ => io::Error::other(format!("{error} ({} to {})", self.machine.local_addr(), self.machine.peer_addr())),
        }
    }

    /// Returns an address of this end in the form for the program.
    pub(super) fn shown(&self, address: SocketAddr) -> SocketAddr {
        if self.is_mapped { mapped(address) } else { address }
    }

    /// Returns whether the system has given up to look for the other end.
    pub(super) fn is_unreachable(&self, now: Instant) -> bool {
        self.unreachable_at.is_some_and(|at| at <= now)
    }
}

impl Core {
    /// Checks that the socket lives. A crash of the host, or a kill of the host's program, ends the socket.
    pub(in crate::core) fn check_gone(&self, gone: Option<Gone>, host: NodeId, local: impl Display) -> io::Result<()> {
        let Some(Gone { at, is_killed }) = gone else { return Ok(()) };
        let name = &self.plan.names()[host.index()];
        let (what, after) = if is_killed { ("the program of host", " was killed") } else { ("host", " crashed") };
        let text = format!("{what} `{name}`{after} at {} s, and this socket ({local}) with it; after `Host::restart`, bind a new one", Seconds(at));
        Err(io::Error::new(io::ErrorKind::ConnectionAborted, text))
    }

    pub(crate) fn check_connection(&self, id: ConnId) -> io::Result<()> {
        let end = self.tcp.end(id);
        self.check_gone(end.gone, end.host, end.machine.local_addr())
    }

    /// Returns the addresses of both ends of a connection, the own one first, as the program sees the addresses.
    pub(crate) fn ends_of(&self, id: ConnId) -> [SocketAddr; 2] {
        let end = self.tcp.end(id);
        [end.machine.local_addr(), end.machine.peer_addr()].map(|address| end.shown(address))
    }

    /// Returns the operations that would not block now, as in the `poll` of Linux: reading, writing, the end of reading, and the end of writing. Linux reports
    /// the end of writing only when both directions have ended, not after a shutdown of the own direction alone.
    #[cfg(feature = "facade")]
    pub(crate) fn readiness(&self, id: ConnId) -> [bool; 4] {
        let [readable, writable] = self.is_ready(id);
        let connection = self.connection(id);
        let read_closed = connection.is_read_closed();
        [readable, writable, read_closed, read_closed && connection.is_write_closed()]
    }

    /// Returns the state machine of a connection.
    pub(crate) fn connection(&self, id: ConnId) -> &Connection {
        &self.tcp.end(id).machine
    }

    /// Applies `change` to a connection, and follows up the change.
    pub(crate) fn change_connection<T>(&mut self, id: ConnId, change: impl FnOnce(Instant, &mut Connection) -> T) -> io::Result<T> {
        self.check_connection(id)?;
        let now = self.now();
        let value = change(now, &mut self.tcp.end_mut(id).machine);
        self.after_call(id);
        Ok(value)
    }

    /// Follows up a call of a program: segments leave, and packets that need no time arrive.
    pub(super) fn after_call(&mut self, id: ConnId) {
        self.tcp.calls += 1;
        self.settle(id);
        self.take_arrivals();
    }

    /// Returns the outcome of the handshake, or `None` while the handshake is under way.
    pub(crate) fn is_settled(&mut self, id: ConnId) -> Option<io::Result<()>> {
        if let Err(gone) = self.check_connection(id) {
            return Some(Err(gone));
        }
        let end = self.tcp.connections.get_mut(id.0);
        match end.machine.state() {
            State::SynSent | State::SynReceived => None,
            State::Closed if end.unreachable_at.is_some() => Some(Errno::HostUnreachable.fail()),
            State::Closed => {
                let error = end.machine.take_error().unwrap_or(Error::NotConnected);
                Some(Err(end.explain(error)))
            }
            State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck | State::TimeWait => {
                Some(Ok(()))
            }
        }
    }

    /// Reads received bytes into the buffers of `to`, one after the other. Returns the number of bytes read.
    pub(crate) fn read(&mut self, id: ConnId, to: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        self.note_call(|core| core.tcp.end(id).name());
        self.check_connection(id)?;
        let machine = &mut self.tcp.end_mut(id).machine;
        let mut count = 0;
        // As with tokio, which waits for readiness first, a read into no space waits until there is something to read.
        let mut outcome = if machine.is_readable() { Ok(0) } else { Err(Error::WouldBlock) };
        for buffer in to.iter_mut().filter(|buffer| !buffer.is_empty()) {
            // A further read of an empty receive buffer would turn success into `WouldBlock`.
            if count > 0 && machine.info().unread == 0 {
                break;
            }
            outcome = machine.read(buffer).inspect(|read| count += read);
            if outcome != Ok(buffer.len()) {
                break;
            }
        }
        self.after_call(id);
        outcome.map(|_| count).map_err(|error| self.tcp.end(id).explain(error))
    }

    /// Copies received bytes to `to` without taking the bytes out.
    pub(crate) fn peek_connection(&mut self, id: ConnId, to: &mut [u8]) -> io::Result<usize> {
        self.note_call(|core| core.tcp.end(id).name());
        self.check_connection(id)?;
        let end = self.tcp.end_mut(id);
        end.machine.peek(to).map_err(|error| end.explain(error))
    }

    /// Writes the buffers of `from`, one after the other, until the send buffer is full. Returns the number of bytes written.
    pub(crate) fn write(&mut self, id: ConnId, from: &[IoSlice<'_>]) -> io::Result<usize> {
        self.note_call(|core| core.tcp.end(id).name());
        self.check_connection(id)?;
        let end = self.tcp.end_mut(id);
        let mut count = 0;
        let mut outcome = Ok(0);
        for buffer in from {
            outcome = end.machine.write(buffer).inspect(|written| count += written);
            if outcome != Ok(buffer.len()) {
                break;
            }
        }
        // As with the edge of `epoll`, the end counts as blocked only after a write was refused, and `settle` ends this state.
        end.is_write_blocked |= outcome == Err(Error::WouldBlock);
        self.after_call(id);
        if self.wire.held.is_too_much() {
            self.fail_for(self.tcp.end(id).name());
        }
        match outcome {
            // Bytes written before the error are reported first. The next write returns the error.
            Err(error) if count == 0 => Err(self.tcp.end(id).explain(error)),
            _ => Ok(count),
        }
    }

    /// Returns whether [`Core::read`] and [`Core::write`] would return at once.
    pub(crate) fn is_ready(&self, id: ConnId) -> [bool; 2] {
        let end = self.tcp.end(id);
        // The next call returns the error of the crash or kill at once.
        if end.gone.is_some() { [true; 2] } else { [end.machine.is_readable(), !end.is_write_blocked] }
    }

    /// Registers a task that waits until the connection can be read.
    pub(crate) fn wait_to_read_from(&mut self, id: ConnId, waker: &Waker) {
        self.tcp.end_mut(id).readers.wait(waker);
    }

    /// Registers a task that waits until the connection can be written, or is established.
    pub(crate) fn wait_to_write_to(&mut self, id: ConnId, waker: &Waker) {
        self.tcp.end_mut(id).writers.wait(waker);
    }

    /// Takes the error that the next call would otherwise return.
    pub(crate) fn take_error_of(&mut self, id: ConnId) -> io::Result<Option<io::Error>> {
        self.check_connection(id)?;
        let end = self.tcp.end_mut(id);
        // A connection to an address of nobody has ended without an error of TCP. The error is reported once.
        if end.machine.state() == State::Closed && end.unreachable_at.take().is_some() {
            return Ok(Some(Errno::HostUnreachable.into()));
        }
        let error = end.machine.take_error();
        Ok(error.map(|error| end.explain(error)))
    }

    /// Returns the linger time of the stream. Only zero has an effect.
    pub(crate) fn linger(&mut self, id: ConnId) -> &mut Option<std::time::Duration> {
        &mut self.tcp.end_mut(id).linger
    }

    /// Releases a stream that the program has dropped.
    pub(crate) fn drop_connection(&mut self, id: ConnId) {
        let now = self.now();
        let end = self.tcp.end_mut(id);
        end.is_held = false;
        // Nobody waits for a dropped stream. A later wake would only poll a task in vain.
        end.readers.clear();
        end.writers.clear();
        // The crash has ended the connection already. After a kill the connection may still have to exchange its last segments with the peer.
        if end.gone.is_some_and(|gone| !gone.is_killed) {
            self.remove_connection(id);
            return;
        }
        if end.linger.is_some_and(|linger| linger.is_zero()) {
            end.machine.abort();
        }
        end.machine.close(now);
        self.after_call(id);
    }
}
