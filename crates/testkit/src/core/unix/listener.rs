//! Listeners of Unix streams.

use std::collections::VecDeque;
use std::io;
use std::task::{Poll, Waker};

use cohaptic_sockets::UnixName;
use cohaptic_wan::NodeId;

use super::channel::Law;
use super::{Owner, Unix, UnixId};
use crate::core::Core;
use crate::core::tcp::Gone;
use crate::core::waking::{Waiters, Woken};
use crate::errno::Errno;

#[derive(Debug)]
pub(super) struct Listener {
    pub(super) host: NodeId,
    pub(super) name: UnixName,
    /// Maximum number of waiting connections, less 1.
    backlog: usize,
    /// Ends of the connections to accept, in the order of arrival.
    waiting: VecDeque<UnixId>,
    pub(super) wakers: Waiters,
    pub(super) gone: Option<Gone>,
}

impl Unix {
    /// Offers the stream `from` to a listener, which has a connected end to accept from then on.
    ///
    /// # Errors
    ///
    /// `EAGAIN` if too many connections wait: as with Linux, a Unix socket that does not block is not made to wait for the listener.
    pub(super) fn offer(&mut self, listener: UnixId, from: UnixId, woken: &mut Woken) -> io::Result<()> {
        let at = self.listeners.get(&listener).expect("a name belongs to a listener as long as the listener lives");
        // As with TCP, Linux lets one connection more wait than the backlog.
        if at.waiting.len() > at.backlog {
            return Errno::TryAgain.fail();
        }
        let (host, name) = (at.host, at.name.clone());
        let accepted = self.insert(host, Law::Stream, name);
        // Both directions exist before the listener accepts: as with Linux, the connecting program may write at once.
        self.join(from, accepted);
        self.join(accepted, from);
        let at = self.listeners.get_mut(&listener).expect("the listener was found above");
        at.waiting.push_back(accepted);
        at.wakers.wake(woken);
        Ok(())
    }

    /// Ends a listener. Connections that nobody has accepted are reset.
    pub(super) fn stop_listening(&mut self, id: UnixId, woken: &mut Woken) {
        let Some(listener) = self.listeners.get_mut(&id).filter(|listener| listener.gone.is_none()) else { return };
        let (host, name, waiting) = (listener.host, listener.name.clone(), std::mem::take(&mut listener.waiting));
        listener.wakers.wake(woken);
        for end in waiting {
            let outgoing = self.ends.get(&end).and_then(|end| end.outgoing);
            self.close(end, woken);
            self.ends.remove(&end);
            // The peer of an end that was never accepted gets an error, whether or not it has written.
            if let Some(channel) = outgoing.and_then(|id| self.channels.get_mut(&id)) {
                channel.is_reset = true;
            }
        }
        self.unbind(host, &name);
    }
}

impl Core {
    fn check_unix_listener(&self, id: UnixId) -> io::Result<()> {
        let listener = &self.unix.listeners[&id];
        self.check_gone(listener.gone, listener.host, format_args!("the Unix listener {}", listener.name))
    }

    /// Makes a listener of a bound stream.
    pub(crate) fn listen_unix(&mut self, id: UnixId, backlog: usize) -> io::Result<UnixId> {
        let [name, _] = self.unix_names(id)?;
        if name == UnixName::Unnamed {
            return Errno::InvalidInput.fail();
        }
        let host = self.unix.end_mut(id).host;
        self.drop_unix(id);
        let id = self.unix.number();
        // The name belonged to the stream until `drop_unix` above freed the name.
        self.unix.bind(host, &name, Owner::Listener(id))?;
        let listener = Listener { host, name, backlog, waiting: VecDeque::new(), wakers: Waiters::default(), gone: None };
        self.unix.listeners.insert(id, listener);
        Ok(id)
    }

    /// Accepts a connection. If no connection waits, `waker` is woken when a connection comes.
    pub(crate) fn accept_unix(&mut self, id: UnixId, waker: &Waker) -> Poll<io::Result<UnixId>> {
        self.check_unix_listener(id)?;
        let listener = self.unix.listeners.get_mut(&id).expect("the listener was found above");
        if let Some(accepted) = listener.waiting.pop_front() {
            return Poll::Ready(Ok(accepted));
        }
        listener.wakers.wait(waker);
        Poll::Pending
    }

    /// Returns the name of a listener.
    pub(crate) fn unix_listener_name(&self, id: UnixId) -> io::Result<UnixName> {
        self.check_unix_listener(id)?;
        Ok(self.unix.listeners[&id].name.clone())
    }

    /// Ends and removes a listener that a program drops.
    pub(crate) fn drop_unix_listener(&mut self, id: UnixId) {
        self.unix.stop_listening(id, &mut self.woken);
        self.unix.listeners.remove(&id);
    }
}
