//! Ends of Unix streams and of pipes.

use std::io::{self, IoSlice, IoSliceMut};
use std::task::Waker;

use cohaptic_sockets::{Ready, UnixName};
use cohaptic_wan::NodeId;

use super::channel::{Channel, Law};
use super::{Owner, Unix, UnixId, wake_both};
use crate::core::Core;
use crate::core::tcp::Gone;
use crate::core::waking::Woken;
use crate::errno::Errno;

/// End of a stream or of a pipe. A stream that is not connected has no channels.
#[derive(Debug)]
pub(super) struct End {
    pub(super) host: NodeId,
    law: Law,
    /// Name of this end. An accepted end has the name of the listener.
    name: UnixName,
    peer: UnixName,
    /// `true` if the name ends with this end.
    owns_name: bool,
    /// Channel from which this end reads.
    pub(super) incoming: Option<UnixId>,
    /// Channel into which this end writes.
    pub(super) outgoing: Option<UnixId>,
    pub(super) gone: Option<Gone>,
}

impl End {
    pub(super) fn words(&self) -> String {
        match self.law {
            Law::Pipe => "a pipe".to_owned(),
            Law::Stream => format!("the Unix stream {} to {}", self.name, self.peer),
        }
    }
}

impl Unix {
    pub(super) fn insert(&mut self, host: NodeId, law: Law, name: UnixName) -> UnixId {
        let id = self.number();
        let end = End { host, law, name, peer: UnixName::Unnamed, owns_name: false, incoming: None, outgoing: None, gone: None };
        self.ends.insert(id, end);
        id
    }

    fn end(&self, id: UnixId) -> &End {
        self.ends.get(&id).expect("an end is there as long as its number is held")
    }

    pub(super) fn end_mut(&mut self, id: UnixId) -> &mut End {
        self.ends.get_mut(&id).expect("an end is there as long as its number is held")
    }

    /// Makes a channel from one end to another.
    pub(super) fn join(&mut self, from: UnixId, to: UnixId) {
        let channel = self.number();
        let (writer, reader) = (self.end(from), self.end(to));
        let (law, own, other) = (writer.law, writer.name.clone(), reader.name.clone());
        self.channels.insert(channel, Channel::new(law));
        let writer = self.end_mut(from);
        (writer.outgoing, writer.peer) = (Some(channel), other);
        let reader = self.end_mut(to);
        (reader.incoming, reader.peer) = (Some(channel), own);
    }

    /// Closes an end, as the end of a process does. The entry remains until [`Core::drop_unix`].
    pub(super) fn close(&mut self, id: UnixId, woken: &mut Woken) {
        let end = self.end_mut(id);
        let (host, name) = (end.host, end.name.clone());
        let (incoming, outgoing, owns_name) = (end.incoming.take(), end.outgoing.take(), std::mem::take(&mut end.owns_name));
        let is_stream = end.law == Law::Stream;
        let mut is_unread = false;
        if let Some(id) = incoming
            && let Some(channel) = self.channels.get_mut(&id)
        {
            // As with Linux, an end that closes with unread bytes resets the peer: the peer reads `ECONNRESET`.
            is_unread = !channel.is_empty();
            channel.clear();
            channel.is_unread = true;
            wake_both(channel, woken);
            self.forget(id);
        }
        if let Some(id) = outgoing
            && let Some(channel) = self.channels.get_mut(&id)
        {
            channel.is_ended = true;
            channel.is_reset = is_stream && is_unread;
            wake_both(channel, woken);
            self.forget(id);
        }
        if owns_name {
            self.unbind(host, &name);
        }
    }

    /// Notes that an end no longer uses a channel, and removes the channel after the second end.
    fn forget(&mut self, id: UnixId) {
        let Some(channel) = self.channels.get_mut(&id) else { return };
        channel.users -= 1;
        if channel.users == 0 {
            self.channels.remove(&id);
        }
    }
}

impl Core {
    /// Checks that the end lives.
    fn check_unix(&self, id: UnixId) -> io::Result<()> {
        let end = self.unix.end(id);
        // The words are made for the error alone.
        if end.gone.is_none() { Ok(()) } else { self.check_gone(end.gone, end.host, end.words()) }
    }

    /// Creates a stream that is not connected.
    pub(crate) fn unix_stream(&mut self, host: NodeId) -> UnixId {
        self.unix.insert(host, Law::Stream, UnixName::Unnamed)
    }

    /// Creates two connected streams.
    pub(crate) fn unix_pair(&mut self, host: NodeId) -> [UnixId; 2] {
        let ends = [self.unix_stream(host), self.unix_stream(host)];
        self.unix.join(ends[0], ends[1]);
        self.unix.join(ends[1], ends[0]);
        ends
    }

    /// Creates a pipe: the writing end, and the reading end.
    pub(crate) fn pipe(&mut self, host: NodeId) -> [UnixId; 2] {
        let ends = [(); 2].map(|()| self.unix.insert(host, Law::Pipe, UnixName::Unnamed));
        self.unix.join(ends[0], ends[1]);
        ends
    }

    /// Binds a stream that is not connected.
    pub(crate) fn bind_unix_stream(&mut self, id: UnixId, name: &UnixName) -> io::Result<()> {
        self.check_unix(id)?;
        let end = self.unix.end(id);
        // A socket has one name.
        if end.name != UnixName::Unnamed {
            return Errno::InvalidInput.fail();
        }
        self.unix.bind(end.host, name, Owner::Stream)?;
        let end = self.unix.end_mut(id);
        (end.name, end.owns_name) = (name.clone(), true);
        Ok(())
    }

    /// Connects a stream to the listener at `name`.
    pub(crate) fn connect_unix_stream(&mut self, id: UnixId, name: &UnixName) -> io::Result<()> {
        self.check_unix(id)?;
        let host = self.unix.end(id).host;
        let listener = match self.unix.owner(host, name)? {
            Owner::Listener(listener) => listener,
            Owner::Datagrams(_) => return Errno::WrongType.fail(),
            Owner::Nobody | Owner::Stream => return Errno::ConnectionRefused.fail(),
        };
        self.unix.offer(listener, id, &mut self.woken)
    }

    /// Returns the names of both ends, the own one first.
    pub(crate) fn unix_names(&self, id: UnixId) -> io::Result<[UnixName; 2]> {
        self.check_unix(id)?;
        let end = self.unix.end(id);
        Ok([end.name.clone(), end.peer.clone()])
    }

    /// Returns the operations on an end that would not block: see `unix_poll` and `pipe_poll` of Linux.
    pub(crate) fn unix_ready(&self, id: UnixId) -> io::Result<Ready> {
        self.check_unix(id)?;
        let end = self.unix.end(id);
        let of = |id: Option<UnixId>| id.and_then(|id| self.unix.channels.get(&id));
        let (incoming, outgoing) = (of(end.incoming), of(end.outgoing));
        let has_ended = incoming.is_none_or(|channel| channel.is_ended);
        let mut ready = Ready::default();
        if let Some(channel) = incoming {
            (ready.readable, ready.read_closed) = (channel.is_readable(), channel.is_ended);
            // An error is readiness of both kinds.
            ready.write_closed = channel.is_reset;
        }
        if let Some(channel) = outgoing {
            ready.writable = channel.is_writable();
            // The system reports the end of writing when nothing can be read any more either.
            ready.write_closed |= has_ended && (channel.is_ended || channel.is_unread);
        }
        Ok(ready)
    }

    /// Wakes `waker` when something can be read.
    pub(crate) fn wait_to_read_unix(&mut self, id: UnixId, waker: &Waker) {
        let incoming = self.unix.end(id).incoming;
        if let Some(channel) = incoming.and_then(|id| self.unix.channels.get_mut(&id)) {
            channel.readers.wait(waker);
        }
    }

    /// Wakes `waker` when something can be written.
    pub(crate) fn wait_to_write_unix(&mut self, id: UnixId, waker: &Waker) {
        let outgoing = self.unix.end(id).outgoing;
        if let Some(channel) = outgoing.and_then(|id| self.unix.channels.get_mut(&id)) {
            channel.writers.wait(waker);
        }
    }

    /// Reads from an end. Returns [`io::ErrorKind::WouldBlock`] if there is nothing to read.
    pub(crate) fn read_unix(&mut self, id: UnixId, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        self.check_unix(id)?;
        let incoming = self.unix.end(id).incoming;
        let Some(channel) = incoming.and_then(|id| self.unix.channels.get_mut(&id)) else { return Errno::NotConnected.fail() };
        if !channel.is_empty() {
            return Ok(channel.take(buffers, &mut self.woken));
        }
        // As with Linux, the reset is reported once, after all bytes. Afterwards the stream has ended.
        if std::mem::take(&mut channel.is_reset) {
            return Errno::ConnectionReset.fail();
        }
        if channel.is_ended { Ok(0) } else { Err(io::ErrorKind::WouldBlock.into()) }
    }

    /// Writes to an end. Returns [`io::ErrorKind::WouldBlock`] if there is no room.
    pub(crate) fn write_unix(&mut self, id: UnixId, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
        self.check_unix(id)?;
        let outgoing = self.unix.end(id).outgoing;
        let Some(channel) = outgoing.and_then(|id| self.unix.channels.get_mut(&id)) else { return Errno::NotConnected.fail() };
        if channel.is_ended || channel.is_unread {
            return Errno::BrokenPipe.fail();
        }
        channel.put(buffers, &mut self.woken).ok_or_else(|| io::ErrorKind::WouldBlock.into())
    }

    /// Ends the stream for the reader at the other end.
    pub(crate) fn shut_unix(&mut self, id: UnixId) -> io::Result<()> {
        self.check_unix(id)?;
        let outgoing = self.unix.end(id).outgoing;
        if let Some(channel) = outgoing.and_then(|id| self.unix.channels.get_mut(&id)) {
            channel.is_ended = true;
            wake_both(channel, &mut self.woken);
        }
        Ok(())
    }

    /// Takes the error that the next read would return.
    pub(crate) fn unix_error(&mut self, id: UnixId) -> io::Result<Option<io::Error>> {
        self.check_unix(id)?;
        let incoming = self.unix.end(id).incoming;
        let channel = incoming.and_then(|id| self.unix.channels.get_mut(&id));
        let is_reset = channel.is_some_and(|channel| std::mem::take(&mut channel.is_reset));
        Ok(is_reset.then(|| Errno::ConnectionReset.into()))
    }

    /// Closes and removes an end that a program drops.
    pub(crate) fn drop_unix(&mut self, id: UnixId) {
        // A stream that has become a listener is gone already.
        if self.unix.ends.contains_key(&id) {
            self.unix.close(id, &mut self.woken);
            self.unix.ends.remove(&id);
        }
    }
}
