//! Unix sockets of datagrams.

use std::collections::VecDeque;
use std::io;
use std::net::Shutdown;
use std::task::Waker;

use cohaptic_sockets::{Ready, UnixName};
use cohaptic_wan::NodeId;

use super::channel::{SEND_BUFFER, buffer_cost, pages_of};
use super::{Owner, Unix, UnixId};
use crate::core::Core;
use crate::core::tcp::Gone;
use crate::core::waking::{Waiters, Woken};
use crate::errno::Errno;

/// Number of datagrams, less 1, that may wait at a socket if the sender is not the peer of the socket: `net.unix.max_dgram_qlen`.
const QUEUE: usize = 10;

/// Bytes of a datagram in one block \[byte\]: the rest lies in pages. `SKB_MAX_ALLOC`.
const BLOCK: usize = 16_064;

/// Most bytes of a datagram in pages \[byte\]: `MAX_SKB_FRAGS` pages.
const IN_PAGES: usize = 17 * 4096;

#[derive(Debug)]
struct Datagram {
    bytes: Vec<u8>,
    from: UnixName,
    /// Sender, whose memory the datagram occupies.
    sender: UnixId,
    /// Memory of the datagram \[byte\].
    cost: usize,
}

/// Peer of a connected socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Peer {
    Nobody,
    Socket(UnixId),
    /// The peer is gone, and the next send returns the error.
    Gone,
}

#[derive(Debug)]
pub(super) struct Datagrams {
    pub(super) host: NodeId,
    pub(super) name: UnixName,
    peer: Peer,
    inbox: VecDeque<Datagram>,
    /// Memory of the datagrams from this socket that nobody has received \[byte\].
    sent: usize,
    /// Whether a datagram was refused because `sent` was too large.
    is_blocked: bool,
    receives_no_more: bool,
    sends_no_more: bool,
    pub(super) readers: Waiters,
    /// Tasks that wait until this socket may send.
    pub(super) writers: Waiters,
    /// Tasks of senders, waiting for room in `inbox`.
    room: Waiters,
    pub(super) gone: Option<Gone>,
}

impl Datagrams {
    /// Returns whether a datagram of `sender` finds no room. Between two sockets that are connected to each other there is no limit.
    fn is_full_for(&self, sender: UnixId) -> bool {
        self.peer != Peer::Socket(sender) && self.inbox.len() > QUEUE
    }
}

impl Unix {
    fn socket(&self, id: UnixId) -> &Datagrams {
        self.datagrams.get(&id).expect("a socket is there as long as its number is held")
    }

    fn socket_mut(&mut self, id: UnixId) -> &mut Datagrams {
        self.datagrams.get_mut(&id).expect("a socket is there as long as its number is held")
    }

    /// Returns the socket at `name` to which the socket `from` may send.
    fn target(&self, from: UnixId, name: &UnixName) -> io::Result<UnixId> {
        let to = match self.owner(self.socket(from).host, name)? {
            Owner::Datagrams(to) => to,
            Owner::Nobody => return Errno::ConnectionRefused.fail(),
            Owner::Stream | Owner::Listener(_) => return Errno::WrongType.fail(),
        };
        // A connected socket takes datagrams of its peer alone.
        match self.socket(to).peer {
            Peer::Socket(peer) if peer != from => Errno::NotPermitted.fail(),
            Peer::Nobody | Peer::Socket(_) | Peer::Gone => Ok(to),
        }
    }

    /// Frees the memory of a datagram, and wakes its sender when three quarters are free (`unix_writable`).
    fn credit(&mut self, datagram: &Datagram, woken: &mut Woken) {
        // The sender may be gone by now.
        let Some(sender) = self.datagrams.get_mut(&datagram.sender) else { return };
        sender.sent -= datagram.cost;
        if sender.is_blocked && sender.sent * 4 <= SEND_BUFFER {
            sender.is_blocked = false;
            sender.writers.wake(woken);
        }
    }

    /// Takes a socket out of the reach of other sockets: frees the name, drops the datagrams, and ends the connections to the socket.
    pub(super) fn leave(&mut self, id: UnixId, woken: &mut Woken) {
        let socket = self.socket_mut(id);
        // The socket of a crashed host has left already, and another socket may have the name by now.
        if socket.gone.is_some() {
            return;
        }
        let (host, name) = (socket.host, socket.name.clone());
        let inbox = std::mem::take(&mut socket.inbox);
        socket.readers.wake(woken);
        socket.writers.wake(woken);
        socket.room.wake(woken);
        inbox.iter().for_each(|datagram| self.credit(datagram, woken));
        for other in self.datagrams.values_mut().filter(|other| other.peer == Peer::Socket(id)) {
            other.peer = Peer::Gone;
            other.writers.wake(woken);
        }
        self.unbind(host, &name);
    }
}

impl Core {
    fn check_unix_datagrams(&self, id: UnixId) -> io::Result<()> {
        let socket = self.unix.socket(id);
        self.check_gone(socket.gone, socket.host, format_args!("the Unix socket {}", socket.name))
    }

    /// Creates a socket that is neither bound nor connected.
    pub(crate) fn unix_datagrams(&mut self, host: NodeId) -> UnixId {
        let id = self.unix.number();
        let socket = Datagrams {
            host,
            name: UnixName::Unnamed,
            peer: Peer::Nobody,
            inbox: VecDeque::new(),
            sent: 0,
            is_blocked: false,
            receives_no_more: false,
            sends_no_more: false,
            readers: Waiters::default(),
            writers: Waiters::default(),
            room: Waiters::default(),
            gone: None,
        };
        self.unix.datagrams.insert(id, socket);
        id
    }

    /// Creates two connected sockets.
    pub(crate) fn unix_datagram_pair(&mut self, host: NodeId) -> [UnixId; 2] {
        let [one, other] = [self.unix_datagrams(host), self.unix_datagrams(host)];
        self.unix.socket_mut(one).peer = Peer::Socket(other);
        self.unix.socket_mut(other).peer = Peer::Socket(one);
        [one, other]
    }

    pub(crate) fn bind_unix_datagrams(&mut self, id: UnixId, name: &UnixName) -> io::Result<()> {
        self.check_unix_datagrams(id)?;
        let socket = self.unix.socket(id);
        // A socket has one name.
        if socket.name != UnixName::Unnamed {
            return Errno::InvalidInput.fail();
        }
        self.unix.bind(socket.host, name, Owner::Datagrams(id))?;
        self.unix.socket_mut(id).name = name.clone();
        Ok(())
    }

    pub(crate) fn connect_unix_datagrams(&mut self, id: UnixId, name: &UnixName) -> io::Result<()> {
        self.check_unix_datagrams(id)?;
        let to = self.unix.target(id, name)?;
        self.unix.socket_mut(id).peer = Peer::Socket(to);
        Ok(())
    }

    /// Sends a datagram. Returns [`io::ErrorKind::WouldBlock`] if there is no room, and wakes `waker` when room is free.
    pub(crate) fn send_unix(&mut self, id: UnixId, waker: Option<&Waker>, bytes: &[u8], to: Option<&UnixName>) -> io::Result<usize> {
        self.check_unix_datagrams(id)?;
        let socket = self.unix.socket_mut(id);
        if bytes.len() > SEND_BUFFER - 32 {
            return Errno::TooLong.fail();
        }
        if socket.sends_no_more {
            return Errno::BrokenPipe.fail();
        }
        let target = match (to, socket.peer) {
            (Some(name), _) => self.unix.target(id, name)?,
            (None, Peer::Socket(to)) => to,
            (None, Peer::Nobody) => return Errno::NotConnected.fail(),
            (None, Peer::Gone) => {
                // As with Linux, the refusal is reported once. Afterwards the socket is not connected.
                socket.peer = Peer::Nobody;
                return Errno::ConnectionRefused.fail();
            }
        };
        let socket = self.unix.socket_mut(id);
        // As with the edge of `epoll`, a refused sender stays refused until `credit` has found three quarters of the memory free.
        if socket.is_blocked || socket.sent >= SEND_BUFFER {
            socket.is_blocked = true;
            waker.into_iter().for_each(|waker| socket.writers.wait(waker));
            return Err(io::ErrorKind::WouldBlock.into());
        }
        let from = socket.name.clone();
        let other = self.unix.socket_mut(target);
        if other.receives_no_more {
            return Errno::BrokenPipe.fail();
        }
        // As with Linux, a socket that sends to itself is not refused for a full queue.
        if target != id && other.is_full_for(id) {
            waker.into_iter().for_each(|waker| other.room.wait(waker));
            return Err(io::ErrorKind::WouldBlock.into());
        }
        let cost = cost(bytes.len());
        other.inbox.push_back(Datagram { bytes: bytes.to_vec(), from, sender: id, cost });
        other.readers.wake(&mut self.woken);
        self.unix.socket_mut(id).sent += cost;
        Ok(bytes.len())
    }

    /// Receives a datagram. Returns [`io::ErrorKind::WouldBlock`] if no datagram waits, and wakes `waker` when a datagram comes.
    pub(crate) fn receive_unix(&mut self, id: UnixId, waker: Option<&Waker>, buffer: &mut [u8]) -> io::Result<(usize, UnixName)> {
        self.check_unix_datagrams(id)?;
        let socket = self.unix.socket_mut(id);
        let Some(datagram) = socket.inbox.pop_front() else {
            if socket.receives_no_more {
                return Ok((0, UnixName::Unnamed));
            }
            waker.into_iter().for_each(|waker| socket.readers.wait(waker));
            return Err(io::ErrorKind::WouldBlock.into());
        };
        socket.room.wake(&mut self.woken);
        self.unix.credit(&datagram, &mut self.woken);
        let count = datagram.bytes.len().min(buffer.len());
        buffer[..count].copy_from_slice(&datagram.bytes[..count]);
        Ok((count, datagram.from))
    }

    /// Returns the operations that would not block. `waker` is woken when a further operation does not block any more.
    pub(crate) fn unix_datagrams_ready(&mut self, id: UnixId, waker: Option<&Waker>) -> io::Result<Ready> {
        self.check_unix_datagrams(id)?;
        let socket = self.unix.socket(id);
        // As in `unix_dgram_poll`, a full peer makes a connected socket unwritable. An unconnected socket has no single receiver to look at.
        let full = match socket.peer {
            Peer::Socket(peer) if peer != id && self.unix.socket(peer).is_full_for(id) => Some(peer),
            Peer::Nobody | Peer::Socket(_) | Peer::Gone => None,
        };
        let socket = self.unix.socket_mut(id);
        let ready = Ready {
            readable: !socket.inbox.is_empty() || socket.receives_no_more,
            writable: !socket.is_blocked && full.is_none(),
            read_closed: socket.receives_no_more,
            write_closed: socket.receives_no_more && socket.sends_no_more,
        };
        if let Some(waker) = waker {
            socket.readers.wait(waker);
            socket.writers.wait(waker);
            if let Some(full) = full {
                self.unix.socket_mut(full).room.wait(waker);
            }
        }
        Ok(ready)
    }

    pub(crate) fn unix_datagrams_name(&self, id: UnixId) -> io::Result<UnixName> {
        self.check_unix_datagrams(id)?;
        Ok(self.unix.socket(id).name.clone())
    }

    pub(crate) fn unix_datagrams_peer(&self, id: UnixId) -> io::Result<UnixName> {
        self.check_unix_datagrams(id)?;
        match self.unix.socket(id).peer {
            Peer::Socket(peer) => Ok(self.unix.socket(peer).name.clone()),
            Peer::Gone => Ok(UnixName::Unnamed),
            Peer::Nobody => Errno::NotConnected.fail(),
        }
    }

    pub(crate) fn shut_unix_datagrams(&mut self, id: UnixId, how: Shutdown) -> io::Result<()> {
        self.check_unix_datagrams(id)?;
        let socket = self.unix.socket_mut(id);
        // A shutdown answers waits of both kinds, so every waiting task is woken and looks again.
        socket.receives_no_more |= matches!(how, Shutdown::Read | Shutdown::Both);
        socket.sends_no_more |= matches!(how, Shutdown::Write | Shutdown::Both);
        socket.readers.wake(&mut self.woken);
        socket.writers.wake(&mut self.woken);
        socket.room.wake(&mut self.woken);
        Ok(())
    }

    /// Removes a socket that a program drops.
    pub(crate) fn drop_unix_datagrams(&mut self, id: UnixId) {
        self.unix.leave(id, &mut self.woken);
        self.unix.datagrams.remove(&id);
    }
}

/// Returns the memory of a datagram \[byte\]: see `unix_dgram_sendmsg`.
fn cost(len: usize) -> usize {
    let pages = pages_of(len.saturating_sub(BLOCK).min(IN_PAGES));
    buffer_cost(len.saturating_sub(pages)) + pages
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measured on Linux 6.18: so many datagrams of one size fit between two connected sockets.
    #[test]
    fn a_pair_holds_as_much_as_linux() {
        for (len, expected) in [(1, 278), (1000, 93), (16_064, 13), (30_000, 7), (100_000, 3)] {
            assert_eq!(SEND_BUFFER.div_ceil(cost(len)), expected, "{len}");
        }
    }
}
