//! Unix sockets and pipes of a run, in memory: no packet touches a link, and bytes arrive at the instant of the write.
//!
//! Names belong to a host: two hosts that bind the same path have two sockets. All effects of a call are over when the call returns, and tasks are woken in the
//! order of the beginnings of their waits, so that a run repeats itself.

mod channel;
mod datagram;
mod listener;
mod stream;

use std::collections::BTreeMap;
use std::io;

use cohaptic_sockets::UnixName;
use cohaptic_wan::NodeId;

use super::Core;
use super::tcp::Gone;
use super::waking::Woken;
use crate::errno::Errno;
use channel::Channel;
use datagram::Datagrams;
use listener::Listener;
use stream::End;

/// Number of a Unix socket, of an end of a pipe, or of a channel. No number is used twice in a run.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct UnixId(u64);

/// Unix sockets and pipes of all hosts.
#[derive(Debug, Default)]
pub(super) struct Unix {
    /// Number of the next socket or channel.
    next: u64,
    /// Bound names, also of sockets that are gone: as with Linux a path stays.
    names: BTreeMap<(NodeId, UnixName), Owner>,
    ends: BTreeMap<UnixId, End>,
    channels: BTreeMap<UnixId, Channel>,
    listeners: BTreeMap<UnixId, Listener>,
    datagrams: BTreeMap<UnixId, Datagrams>,
}

/// Owner of a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Owner {
    /// The socket is gone, and the path is left.
    Nobody,
    /// A socket of streams that does not listen.
    Stream,
    Listener(UnixId),
    Datagrams(UnixId),
}

impl Unix {
    fn number(&mut self) -> UnixId {
        self.next += 1;
        UnixId(self.next)
    }

    /// Returns the owner of the name `name` of `host`.
    ///
    /// # Errors
    ///
    /// `ENOENT` for a path that nobody has bound, `ECONNREFUSED` for an abstract name, and `EINVAL` without a name.
    fn owner(&self, host: NodeId, name: &UnixName) -> io::Result<Owner> {
        match (self.names.get(&(host, name.clone())), name) {
            (Some(owner), _) => Ok(*owner),
            (None, UnixName::Path(_)) => Errno::NoEntry.fail(),
            (None, UnixName::Abstract(_)) => Errno::ConnectionRefused.fail(),
            (None, UnixName::Unnamed) => Errno::InvalidInput.fail(),
        }
    }

    /// Binds a name. A path whose socket is gone is free again: a program removes the path by `std::fs`, which a test bed does not see.
    ///
    /// # Errors
    ///
    /// `EADDRINUSE` if a socket has the name, and `EINVAL` without a name.
    fn bind(&mut self, host: NodeId, name: &UnixName, owner: Owner) -> io::Result<()> {
        if *name == UnixName::Unnamed {
            return Errno::InvalidInput.fail();
        }
        if self.names.get(&(host, name.clone())).is_some_and(|owner| *owner != Owner::Nobody) {
            return Errno::AddrInUse.fail();
        }
        self.names.insert((host, name.clone()), owner);
        Ok(())
    }

    /// Notes that the socket with the name `name` is gone. A path is left, an abstract name is not.
    fn unbind(&mut self, host: NodeId, name: &UnixName) {
        match name {
            UnixName::Unnamed => {}
            UnixName::Path(_) => drop(self.names.insert((host, name.clone()), Owner::Nobody)),
            UnixName::Abstract(_) => drop(self.names.remove(&(host, name.clone()))),
        }
    }
}

impl Core {
    /// Ends all Unix sockets and pipes of a host that has crashed, or whose program was killed. A socket stays in memory as long as a program holds the socket,
    /// so that the next call returns the error.
    pub(super) fn end_unix(&mut self, host: NodeId, gone: Gone) {
        let unix = &mut self.unix;
        let woken = &mut self.woken;
        // The numbers are collected first, because closing an end changes the maps. Sorted maps give every run the same order of waking.
        let ends: Vec<UnixId> = unix.ends.iter().filter(|(_, end)| end.host == host && end.gone.is_none()).map(|(id, _)| *id).collect();
        for id in ends {
            unix.close(id, woken);
            if let Some(end) = unix.ends.get_mut(&id) {
                end.gone = Some(gone);
            }
        }
        let listeners: Vec<UnixId> = unix.listeners.iter().filter(|(_, listener)| listener.host == host).map(|(id, _)| *id).collect();
        for id in listeners {
            unix.stop_listening(id, woken);
            if let Some(listener) = unix.listeners.get_mut(&id) {
                // The first cause stays: a crash after a kill does not change the error.
                listener.gone.get_or_insert(gone);
            }
        }
        let datagrams: Vec<UnixId> =
            unix.datagrams.iter().filter(|(_, socket)| socket.host == host && socket.gone.is_none()).map(|(id, _)| *id).collect();
        for id in datagrams {
            unix.leave(id, woken);
            if let Some(socket) = unix.datagrams.get_mut(&id) {
                socket.gone = Some(gone);
            }
        }
    }

    /// Returns a line for each Unix socket and pipe for which a task waits.
    pub(super) fn unix_waits(&self) -> impl Iterator<Item = String> {
        let (unix, names) = (&self.unix, self.plan.names());
        let ends = unix.ends.values().filter_map(move |end| {
            let of = |id: Option<UnixId>| id.and_then(|id| unix.channels.get(&id));
            let is_reading = of(end.incoming).is_some_and(|channel| !channel.readers.is_empty());
            let is_writing = of(end.outgoing).is_some_and(|channel| !channel.writers.is_empty());
            Some((end.host, format!("{} waits to {}", end.words(), waits(is_reading, is_writing)?)))
        });
        let listeners = unix.listeners.values().filter(|listener| !listener.wakers.is_empty());
        let listeners = listeners.map(|listener| (listener.host, format!("the Unix listener at {} waits for a connection", listener.name)));
        let datagrams = unix.datagrams.values().filter_map(|socket| {
            let what = waits(!socket.readers.is_empty(), !socket.writers.is_empty())?;
            Some((socket.host, format!("the Unix socket {} waits to {what}", socket.name)))
        });
        let lines = ends.chain(listeners).chain(datagrams);
        lines.map(move |(host, line)| format!("host `{}`: {line}", names[host.index()]))
    }

    /// Returns descriptions of the Unix sockets for which the task with the waker `waker` waits.
    pub(super) fn unix_awaited_by(&self, waker: &std::task::Waker) -> impl Iterator<Item = String> {
        let unix = &self.unix;
        let ends = unix.ends.values().filter_map(move |end| {
            let of = |id: Option<UnixId>| id.and_then(|id| unix.channels.get(&id));
            let is_reading = of(end.incoming).is_some_and(|channel| channel.readers.has(waker));
            let is_writing = of(end.outgoing).is_some_and(|channel| channel.writers.has(waker));
            let what = match (is_reading, is_writing) {
                (false, false) => return None,
                (true, _) => "bytes at",
                (false, true) => "room at",
            };
            Some(format!("{what} {}", end.words()))
        });
        let listeners = unix.listeners.values().filter(move |listener| listener.wakers.has(waker));
        let listeners = listeners.map(|listener| format!("a connection at the Unix listener {}", listener.name));
        let datagrams = unix.datagrams.values().filter_map(move |socket| {
            let what = match (socket.readers.has(waker), socket.writers.has(waker)) {
                (false, false) => return None,
                (true, _) => "a datagram at",
                (false, true) => "room at",
            };
            Some(format!("{what} the Unix socket {}", socket.name))
        });
        ends.chain(listeners).chain(datagrams)
    }
}

/// Returns the operations for which tasks wait, in words; `None` if no task waits.
const fn waits(is_reading: bool, is_writing: bool) -> Option<&'static str> {
    match (is_reading, is_writing) {
        (false, false) => None,
        (true, false) => Some("read"),
        (false, true) => Some("write"),
        (true, true) => Some("read and to write"),
    }
}

/// Wakes the tasks that wait at either end of a channel.
fn wake_both(channel: &mut Channel, woken: &mut Woken) {
    channel.readers.wake(woken);
    channel.writers.wake(woken);
}
