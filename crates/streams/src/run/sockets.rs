//! Sockets of a relay of TCP: listeners, and two connected sockets per connection, none of which blocks.

use std::collections::BTreeSet;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr};
use std::time::Duration;

use cohaptic_realtime::Lateness;
use cohaptic_realtime::own::reaches;
use cohaptic_units::Instant;
use mio::net::{TcpListener, TcpStream};
use mio::{Events, Interest, Poll, Token};
use socket2::SockRef;

use super::StreamsError;
use crate::config::StreamsConfig;
use crate::engine::{Close, ConnectionId, Engine, Event, Side};

/// Bytes read in one call of the system, at most.
const READ: usize = 64 * 1024;

/// Wait after the system has refused a descriptor. Readiness of a listener is told once, so without a new attempt a client would wait for the next client.
const AGAIN: Duration = Duration::from_millis(20);

/// Largest number of ready sockets from one call.
const EVENTS: usize = 1024;

pub(super) struct Sockets {
    poll: Poll,
    events: Events,
    listeners: Vec<TcpListener>,
    /// Local address of each listener.
    addresses: Vec<SocketAddr>,
    /// Address of each program.
    targets: Vec<SocketAddr>,
    /// Sockets of each connection, indexed by [`ConnectionId::slot`].
    pairs: Vec<Option<Pair>>,
    /// Ends with possible bytes to read. Readiness is told once, so that the ends stay here until a read would block.
    readable: BTreeSet<(ConnectionId, Side)>,
    /// Listeners with possible clients.
    waiting: BTreeSet<usize>,
    /// `true` if the system refused a descriptor: clients are accepted again after [`AGAIN`].
    is_short: bool,
    buffer: Vec<u8>,
}

/// Two sockets of a connection.
struct Pair {
    id: ConnectionId,
    client: TcpStream,
    server: TcpStream,
    /// `false` until the program has accepted the connection.
    is_connected: bool,
    /// `true` if the stream to the program has ended before the program has accepted the connection.
    ends_once_connected: bool,
    /// Ends whose system buffer was full at the last write: client, server.
    is_full: [bool; 2],
}

impl Pair {
    const fn socket(&mut self, side: Side) -> &mut TcpStream {
        match side {
            Side::Client => &mut self.client,
            Side::Server => &mut self.server,
        }
    }
}

impl std::fmt::Debug for Sockets {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sockets").field("addresses", &self.addresses).finish_non_exhaustive()
    }
}

impl Sockets {
    /// Opens a listener per proxy.
    pub(super) fn listen(config: &StreamsConfig) -> Result<Self, StreamsError> {
        let poll = Poll::new()?;
        let mut listeners = Vec::new();
        let mut addresses = Vec::new();
        for (place, proxy) in config.proxies.iter().enumerate() {
            let listen = |source| StreamsError::Listen { address: proxy.listen, source };
            let mut listener = TcpListener::bind(proxy.listen).map_err(listen)?;
            poll.registry().register(&mut listener, Token(place), Interest::READABLE)?;
            addresses.push(listener.local_addr().map_err(listen)?);
            listeners.push(listener);
        }
        let targets: Vec<SocketAddr> = config.proxies.iter().map(|proxy| proxy.to).collect();
        // A listener at [::] takes clients of IPv4 too, on most systems.
        if let Some(to) = targets.iter().find(|to| addresses.iter().any(|own| reaches(**to, *own, true))) {
            return Err(StreamsError::ToItself { to: *to });
        }
        Ok(Self {
            poll,
            events: Events::with_capacity(EVENTS),
            // A client may have connected before the registration.
            waiting: (0..listeners.len()).collect(),
            listeners,
            addresses,
            targets,
            pairs: Vec::new(),
            readable: BTreeSet::new(),
            is_short: false,
            buffer: vec![0; READ],
        })
    }

    pub(super) fn addresses(&self) -> &[SocketAddr] {
        &self.addresses
    }

    /// Returns the instant at which refused clients are accepted again.
    pub(super) fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        self.is_short.then(|| now.saturating_add(AGAIN))
    }

    /// Waits until a socket is ready, at most for `span`. Returns whether a socket is ready.
    pub(super) fn wait(&mut self, span: Duration) -> io::Result<bool> {
        match self.poll.poll(&mut self.events, Some(span)) {
            Ok(()) => Ok(!self.events.is_empty()),
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Handles the readiness found by [`wait`](Self::wait): accepts clients, finishes connections to programs, and reads.
    pub(super) fn serve(&mut self, engine: &mut Engine, now: Instant) -> io::Result<()> {
        let mut writable = Vec::new();
        for event in &self.events {
            let Token(token) = event.token();
            let Some(stream) = token.checked_sub(self.listeners.len()) else {
                self.waiting.insert(token);
                continue;
            };
            // A place may have another connection since the event. Reading and writing too early does no harm.
            let Some(pair) = self.pairs.get(stream / 2).and_then(Option::as_ref) else { continue };
            let side = if stream.is_multiple_of(2) { Side::Client } else { Side::Server };
            // The next read returns the error.
            if event.is_readable() || event.is_error() || event.is_read_closed() {
                self.readable.insert((pair.id, side));
            }
            if event.is_writable() || event.is_error() {
                writable.push((pair.id, side));
            }
        }
        self.events.clear();
        for (id, side) in writable {
            self.made_writable(engine, now, id, side);
        }
        self.accept(engine, now)?;
        self.read(engine, now);
        Ok(())
    }

    fn accept(&mut self, engine: &mut Engine, now: Instant) -> io::Result<()> {
        self.is_short = false;
        for place in std::mem::take(&mut self.waiting) {
            loop {
                match self.listeners[place].accept() {
                    Ok((client, _)) => self.open(engine, now, place, client)?,
                    Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                    // The client has left before being accepted.
                    Err(error) if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset | ErrorKind::Interrupted) => {}
                    // The system has no descriptor or no memory: clients wait in the queue of the listener.
                    Err(_) => {
                        self.waiting.insert(place);
                        self.is_short = true;
                        break;
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes a client, and begins to connect to its program.
    fn open(&mut self, engine: &mut Engine, now: Instant, proxy: usize, mut client: TcpStream) -> io::Result<()> {
        let id = engine.open(now, proxy);
        let Ok(mut server) = TcpStream::connect(self.targets[proxy]) else {
            engine.handle_refused(now, id);
            reset(&client);
            return Ok(());
        };
        // Without Nagle's algorithm small writes leave at once, not after an acknowledgement. If the system refuses, writes are late.
        let _ = client.set_nodelay(true);
        let token = self.listeners.len() + 2 * id.slot();
        let both = Interest::READABLE | Interest::WRITABLE;
        self.poll.registry().register(&mut client, Token(token), both)?;
        self.poll.registry().register(&mut server, Token(token + 1), both)?;
        if self.pairs.len() <= id.slot() {
            self.pairs.resize_with(id.slot() + 1, || None);
        }
        self.pairs[id.slot()] = Some(Pair { id, client, server, is_connected: false, ends_once_connected: false, is_full: [false; 2] });
        Ok(())
    }

    fn pair(&mut self, id: ConnectionId) -> Option<&mut Pair> {
        self.pairs.get_mut(id.slot())?.as_mut().filter(|pair| pair.id == id)
    }

    /// Finishes the connection to a program, or makes a full end writable again.
    fn made_writable(&mut self, engine: &mut Engine, now: Instant, id: ConnectionId, side: Side) {
        let Some(pair) = self.pair(id) else { return };
        if side == Side::Server && !pair.is_connected {
            let is_refused = matches!(pair.server.take_error(), Ok(Some(_)) | Err(_));
            match pair.server.peer_addr() {
                Ok(_) if !is_refused => {
                    let _ = pair.server.set_nodelay(true);
                    pair.is_connected = true;
                    if pair.ends_once_connected {
                        end_writing(&pair.server);
                    }
                }
                // Not connected yet: some systems tell readiness too early.
                Err(error) if !is_refused && error.kind() == ErrorKind::NotConnected => return,
                _ => return engine.handle_refused(now, id),
            }
        }
        pair.is_full[usize::from(side == Side::Server)] = false;
        engine.make_ready(id, side);
    }

    /// Reads from every end that may have bytes and for which the engine has room.
    pub(super) fn read(&mut self, engine: &mut Engine, now: Instant) {
        let Self { readable, pairs, buffer, .. } = self;
        readable.retain(|(id, side)| {
            let Some(pair) = pairs.get_mut(id.slot()).and_then(Option::as_mut).filter(|pair| pair.id == *id) else { return false };
            if *side == Side::Server && !pair.is_connected {
                return true;
            }
            let socket = pair.socket(*side);
            loop {
                let room = engine.room(*id, *side).min(READ);
                if room == 0 {
                    // The end stays readable, and is asked again after bytes have been written.
                    return true;
                }
                match socket.read(&mut buffer[..room]) {
                    Ok(0) => {
                        engine.handle_end(now, *id, *side);
                        return false;
                    }
                    Ok(count) => engine.handle_bytes(now, *id, *side, &buffer[..count]),
                    Err(error) if error.kind() == ErrorKind::WouldBlock => return false,
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(_) => {
                        engine.handle_reset(now, *id, *side);
                        return false;
                    }
                }
            }
        });
    }

    /// Writes to an end until nothing may be written any more or the system has no room.
    pub(super) fn write(&mut self, engine: &mut Engine, id: ConnectionId, side: Side, clock: &impl Fn() -> Instant, release: &mut Lateness) {
        let Some(pair) = self.pair(id) else { return };
        let place = usize::from(side == Side::Server);
        if pair.is_full[place] || (side == Side::Server && !pair.is_connected) {
            // The relay is not to blame for bytes that wait for a slow receiver.
            engine.take_due(id, side);
            return;
        }
        loop {
            let Some(bytes) = engine.writable(id, side) else { return };
            match pair.socket(side).write(bytes) {
                Ok(count) => {
                    let now = clock();
                    if let Some(due) = engine.take_due(id, side) {
                        release.record(now.saturating_duration_since(due));
                    }
                    engine.wrote(now, id, side, count);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    engine.take_due(id, side);
                    pair.is_full[place] = true;
                    return;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return engine.handle_reset(clock(), id, side),
            }
        }
    }

    /// Ends a stream or a connection.
    pub(super) fn handle(&mut self, engine: &mut Engine, event: Event) {
        match event {
            Event::Ready(..) => {}
            Event::Finish(id, side) => self.finish(id, &[side]),
            Event::FinishBoth(id) => {
                self.finish(id, &[Side::Client, Side::Server]);
                // Bytes waiting in the system are read now, because the socket may have no further event.
                self.readable.extend([(id, Side::Client), (id, Side::Server)]);
                let is_connected = self.pair(id).is_none_or(|pair| pair.is_connected);
                if !is_connected {
                    engine.handle_end(Instant::ZERO, id, Side::Server);
                }
            }
            Event::Close(id, close) => {
                if self.pair(id).is_some()
                    && let Some(pair) = self.pairs[id.slot()].take()
                    && close == Close::Reset
                {
                    reset(&pair.client);
                    reset(&pair.server);
                }
            }
        }
    }

    fn finish(&mut self, id: ConnectionId, sides: &[Side]) {
        let Some(pair) = self.pair(id) else { return };
        for side in sides {
            if *side == Side::Server && !pair.is_connected {
                // Linux gives up a connection that is shut down while it is opened, and tells nobody.
                pair.ends_once_connected = true;
            } else {
                end_writing(pair.socket(*side));
            }
        }
    }
}

/// Ends the stream to an end.
fn end_writing(socket: &TcpStream) {
    // The call fails if the other program is gone, and a failure needs no answer.
    let _ = socket.shutdown(Shutdown::Write);
}

/// Makes the close of a socket a reset. If the system refuses, the close is an ordinary close.
fn reset(socket: &TcpStream) {
    let _ = SockRef::from(socket).set_linger(Some(Duration::ZERO));
}
