//! Unix sockets and pipes of hosts, as handles to the state of the run.

use std::fmt;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::Shutdown;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use cohaptic_sockets::{ByteStream, Ready, UnixDatagrams, UnixListener, UnixName, UnixSocket, UnixStream};
use cohaptic_wan::NodeId;

use crate::core::{Core, Shared, UnixId};

/// Name of the sockets in errors.
const KIND: &str = "a Unix socket or a pipe";

/// Makes a socket or a pipe on a host that is up.
pub(super) fn open<T>(shared: &Shared, host: NodeId, make: impl FnOnce(&mut Core) -> T) -> io::Result<T> {
    shared.open(host, KIND, |core| core.check_up(host).map(|()| make(core)))?
}

/// Defines the handle of a socket in the state of the run. Dropping the handle removes the socket.
macro_rules! handle {
    ($(#[$documentation:meta])* $name:ident, $drop:ident) => {
        $(#[$documentation])*
        pub(super) struct $name {
            shared: Arc<Shared>,
            host: NodeId,
            id: UnixId,
        }

        impl $name {
            pub(super) const fn new(shared: Arc<Shared>, host: NodeId, id: UnixId) -> Self {
                Self { shared, host, id }
            }

            fn ask<T>(&self, ask: impl FnOnce(&mut Core) -> io::Result<T>) -> io::Result<T> {
                self.shared.open(self.host, KIND, ask)?
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.debug_struct(stringify!($name)).field("host", &self.shared.names()[self.host.index()]).finish_non_exhaustive()
            }
        }

        impl Drop for $name {
            fn drop(&mut self) {
                let id = self.id;
                self.shared.release(move |core| core.$drop(id));
            }
        }
    };
}

handle! {
    /// End of a Unix stream or of a pipe; also a socket of streams that is not connected.
    Stream, drop_unix
}

handle! {
    /// Listener of Unix streams.
    Listener, drop_unix_listener
}

handle! {
    /// Unix socket of datagrams.
    Datagrams, drop_unix_datagrams
}

impl ByteStream for Stream {
    fn poll_readable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll(cx, Core::wait_to_read_unix, |core, id| match core.unix_ready(id)? {
            ready if ready.readable || ready.read_closed => Ok(()),
            _ => Err(io::ErrorKind::WouldBlock.into()),
        })
    }

    fn poll_writable(&self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll(cx, Core::wait_to_write_unix, |core, id| match core.unix_ready(id)? {
            ready if ready.writable || ready.write_closed => Ok(()),
            _ => Err(io::ErrorKind::WouldBlock.into()),
        })
    }

    fn ready(&self) -> io::Result<Ready> {
        self.ask(|core| core.unix_ready(self.id))
    }

    fn poll_read(&self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<io::Result<usize>> {
        self.poll(cx, Core::wait_to_read_unix, |core, id| core.read_unix(id, &mut [IoSliceMut::new(buffer)]))
    }

    fn poll_write(&self, cx: &mut Context<'_>, buffers: &[IoSlice<'_>]) -> Poll<io::Result<usize>> {
        self.poll(cx, Core::wait_to_write_unix, |core, id| core.write_unix(id, buffers))
    }

    /// Reads without waiting. Each attempt counts, so that the run notices a task that tries again and again at an instant.
    fn try_read(&self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        self.shared.note_call();
        self.ask(|core| core.read_unix(self.id, buffers))
    }

    fn try_write(&self, buffers: &[IoSlice<'_>]) -> io::Result<usize> {
        self.shared.note_call();
        self.ask(|core| core.write_unix(self.id, buffers))
    }

    fn shut_down(&self) -> io::Result<()> {
        self.ask(|core| core.shut_unix(self.id))
    }

    fn let_write_half_go(&self) {
        let id = self.id;
        // The host of the stream may have crashed: then nobody reads any more.
        self.shared.release(move |core| drop(core.shut_unix(id)));
    }

    fn take_error(&self) -> io::Result<Option<io::Error>> {
        self.ask(|core| core.unix_error(self.id))
    }
}

impl Stream {
    /// Tries `act`, and registers the waker of the context by `wait` if `act` would block.
    fn poll<T>(
        &self,
        cx: &Context<'_>,
        wait: impl FnOnce(&mut Core, UnixId, &Waker),
        act: impl FnOnce(&mut Core, UnixId) -> io::Result<T>,
    ) -> Poll<io::Result<T>> {
        let outcome = self.ask(|core| {
            let outcome = act(core, self.id);
            if would_block(&outcome) {
                wait(core, self.id, cx.waker());
            }
            outcome
        });
        if would_block(&outcome) { Poll::Pending } else { Poll::Ready(outcome) }
    }
}

fn would_block<T>(outcome: &io::Result<T>) -> bool {
    matches!(outcome, Err(error) if error.kind() == io::ErrorKind::WouldBlock)
}

impl UnixStream for Stream {
    fn local_name(&self) -> io::Result<UnixName> {
        self.ask(|core| core.unix_names(self.id)).map(|[own, _]| own)
    }

    fn peer_name(&self) -> io::Result<UnixName> {
        self.ask(|core| core.unix_names(self.id)).map(|[_, peer]| peer)
    }
}

impl UnixSocket for Stream {
    fn bind(&self, name: &UnixName) -> io::Result<()> {
        self.ask(|core| core.bind_unix_stream(self.id, name))
    }

    fn connect(self: Box<Self>, name: &UnixName) -> io::Result<Box<dyn UnixStream>> {
        self.ask(|core| core.connect_unix_stream(self.id, name))?;
        Ok(self)
    }

    fn listen(self: Box<Self>, backlog: u32) -> io::Result<Box<dyn UnixListener>> {
        let id = self.ask(|core| core.listen_unix(self.id, backlog as usize))?;
        Ok(Box::new(Listener::new(Arc::clone(&self.shared), self.host, id)))
    }
}

impl UnixListener for Listener {
    fn poll_accept(&self, cx: &mut Context<'_>) -> Poll<io::Result<(Box<dyn UnixStream>, UnixName)>> {
        let polled = self.shared.open(self.host, KIND, |core| core.accept_unix(self.id, cx.waker()).map_ok(|id| (id, core.unix_names(id))));
        let accepted = match polled {
            Ok(Poll::Pending) => return Poll::Pending,
            Ok(Poll::Ready(accepted)) => accepted,
            Err(error) => Err(error),
        };
        Poll::Ready(accepted.and_then(|(id, names)| {
            let stream = Stream::new(Arc::clone(&self.shared), self.host, id);
            names.map(|[_, peer]| (Box::new(stream) as Box<dyn UnixStream>, peer))
        }))
    }

    fn local_name(&self) -> io::Result<UnixName> {
        self.ask(|core| core.unix_listener_name(self.id))
    }
}

impl Datagrams {
    /// Counts a call that does not wait, so that the run notices a task that tries again and again at an instant.
    fn note_attempt(&self, waker: Option<&Waker>) {
        if waker.is_none() {
            self.shared.note_call();
        }
    }
}

impl UnixDatagrams for Datagrams {
    fn bind(&self, name: &UnixName) -> io::Result<()> {
        self.ask(|core| core.bind_unix_datagrams(self.id, name))
    }

    fn connect(&self, name: &UnixName) -> io::Result<()> {
        self.ask(|core| core.connect_unix_datagrams(self.id, name))
    }

    fn send(&self, waker: Option<&Waker>, bytes: &[u8], to: Option<&UnixName>) -> io::Result<usize> {
        self.note_attempt(waker);
        self.ask(|core| core.send_unix(self.id, waker, bytes, to))
    }

    fn receive(&self, waker: Option<&Waker>, buffer: &mut [u8]) -> io::Result<(usize, UnixName)> {
        self.note_attempt(waker);
        self.ask(|core| core.receive_unix(self.id, waker, buffer))
    }

    fn ready(&self, waker: Option<&Waker>) -> io::Result<Ready> {
        self.ask(|core| core.unix_datagrams_ready(self.id, waker))
    }

    fn local_name(&self) -> io::Result<UnixName> {
        self.ask(|core| core.unix_datagrams_name(self.id))
    }

    fn peer_name(&self) -> io::Result<UnixName> {
        self.ask(|core| core.unix_datagrams_peer(self.id))
    }

    fn shut_down(&self, how: Shutdown) -> io::Result<()> {
        self.ask(|core| core.shut_unix_datagrams(self.id, how))
    }
}
