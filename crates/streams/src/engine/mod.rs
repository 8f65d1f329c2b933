//! The relay of TCP without sockets and without a clock: bytes with instants come in, and writable bytes come out.

mod connection;
mod counts;
mod direction;
mod event;
mod faults;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use cohaptic_linkfile::stream::StreamConfig;
use cohaptic_realtime::Recent;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, Link, LinkConfig, LinkName, LinkStats};

use crate::config::StreamsConfig;
use connection::{Connection, State, Table};
use direction::Wrote;

pub use connection::ConnectionId;
pub use counts::{Counts, LineCounts};
pub use event::{Close, Event, Side};

/// Bytes of a piece on the line, at most: the payload of a segment of TCP over Ethernet with the usual options. Jitter is drawn and the rate is kept per piece.
pub const PIECE: usize = 1448;

/// Time of a closed connection until its end: bytes arriving meanwhile are read and lost, because a system resets a connection with unread bytes at
/// its close.
const LINGER: Duration = Duration::from_secs(1);

/// End of a stream by its sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum End {
    /// The sender sends no more (FIN).
    Finish,
    /// The sender is gone (RST).
    Reset,
}

/// Error: the relay has no line with the given index.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there is no such line")]
pub struct NoLine;

/// Piece on a line: the end of a stream, or a number of the next bytes of the connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Piece {
    connection: ConnectionId,
    what: What,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum What {
    Bytes(usize),
    End(End),
}

/// State machine of a relay of TCP.
///
/// The driver opens a connection with [`Engine::open`], passes bytes ([`Engine::handle_bytes`]) and ends ([`Engine::handle_end`],
/// [`Engine::handle_reset`]), reads at most [`Engine::room`] bytes, and asks [`Engine::poll_timeout`] for the next deadline. After each deadline and after each
/// input the driver calls [`Engine::handle_timeout`] with the present time and then handles [`Engine::poll_event`] until `None`. Instants never decrease.
///
/// Received bytes of a line are sent, lost or held, and are written in order.
#[derive(Debug)]
pub struct Engine {
    config: StreamsConfig,
    /// Two lines per proxy: forth, then back.
    lines: Vec<Line>,
    counts: Vec<Counts>,
    connections: Table,
    /// Bytes held by all connections.
    held: usize,
    /// Time up to which [`Engine::poll_event`] goes.
    now: Instant,
    timers: BTreeSet<(Instant, ConnectionId, Timer)>,
    /// Pieces at the end of their lines, with the line, in the order of arrival.
    arrivals: BTreeMap<(Instant, u64), (usize, Piece)>,
    /// Number of arrived pieces. Orders pieces of the same instant.
    arrived: u64,
    /// Ends with newly writable bytes, until the event is polled.
    ready: BTreeSet<(ConnectionId, Side)>,
    /// Events to be polled after the events for `ready`.
    events: VecDeque<Event>,
}

#[derive(Debug)]
struct Line {
    link: Link<Piece>,
    counts: LineCounts,
    recent: Recent,
}

/// Next thing to happen.
#[derive(Clone, Copy, Debug)]
enum Next {
    /// The first piece of `arrivals` reaches its connection.
    Arrival(usize, Piece),
    /// A line goes on until the instant.
    Line(usize, Instant),
    Timer,
    /// Nothing is due, or events wait.
    Flush,
}

/// Deadline of a connection.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Timer {
    /// Begin of the stall of bytes from this side.
    Stall(Side),
    /// End of the stall of bytes from this side.
    Resume(Side),
    /// End of the gap before the next piece of bytes from this side.
    Gap(Side),
    /// End of the stream from this side, after `slow-close`.
    SlowClose(Side),
    CloseAfter,
    ResetAfter,
    /// End of [`LINGER`].
    Linger,
}

impl Engine {
    /// Returns a relay without connections at the instant zero.
    #[must_use]
    pub fn new(config: StreamsConfig) -> Self {
        let line = |name: &str, from: &str, to: &str, stream: &StreamConfig| Line {
            link: Link::new(config.seed, &LinkName::between(&format!("{name}/{from}"), &format!("{name}/{to}")), stream.line().clone()),
            counts: LineCounts::default(),
            recent: Recent::default(),
        };
        let lines = config.proxies.iter().flat_map(|proxy| {
            let name = proxy.name.as_str();
            [line(name, "client", "server", &proxy.forth), line(name, "server", "client", &proxy.back)]
        });
        Self {
            lines: lines.collect(),
            counts: vec![Counts::default(); config.proxies.len()],
            connections: Table::default(),
            held: 0,
            now: Instant::ZERO,
            timers: BTreeSet::new(),
            arrivals: BTreeMap::new(),
            arrived: 0,
            ready: BTreeSet::new(),
            events: VecDeque::new(),
            config,
        }
    }

    /// Takes a connection of a client to the proxy with this index, and returns the name of the connection. The connection has the faults of the proxy that its
    /// number and the seed choose.
    ///
    /// # Panics
    ///
    /// If there is no such proxy.
    pub fn open(&mut self, now: Instant, proxy: usize) -> ConnectionId {
        self.now = self.now.max(now);
        let counts = &mut self.counts[proxy];
        let number = counts.opened;
        counts.opened += 1;
        let found = faults::chosen(self.config.seed, &self.config.proxies[proxy], number);
        let connection = self.connections.insert(Connection::new(proxy, found.directions));
        self.timers.extend(found.timers.into_iter().map(|(after, timer)| (now.saturating_add(after), connection, timer)));
        connection
    }

    /// Returns the number of bytes that may be read from this end now. At zero the sender has to wait.
    #[must_use]
    pub fn room(&self, connection: ConnectionId, from: Side) -> usize {
        let Some(found) = self.connections.get(connection) else { return 0 };
        if found.state != State::Open {
            // The bytes of a closed connection are lost, and take no room.
            return usize::MAX;
        }
        let free = usize::try_from(self.config.most_bytes.get()).unwrap_or(usize::MAX).saturating_sub(self.held);
        found.directions[from.index()].room().min(free)
    }

    /// Takes bytes from an end, at most [`room`](Self::room).
    pub fn handle_bytes(&mut self, now: Instant, connection: ConnectionId, from: Side, bytes: &[u8]) {
        let Some(found) = self.connections.get_mut(connection) else { return };
        let line = &mut self.lines[found.line(from)];
        line.counts.received += bytes.len() as u64;
        if found.state != State::Open {
            line.counts.lost += bytes.len() as u64;
            return;
        }
        self.now = self.now.max(now);
        found.directions[from.index()].push(bytes);
        self.held += bytes.len();
        // Pieces of the size of a segment leave one after the other, so that a large write is delayed like the segments of a real connection.
        for piece in bytes.chunks(PIECE) {
            line.offer(self.now, Piece { connection, what: What::Bytes(piece.len()) });
        }
        let place = found.line(from);
        self.collect(place);
    }

    /// Takes note that an end sends no more.
    pub fn handle_end(&mut self, now: Instant, connection: ConnectionId, from: Side) {
        self.handle_last(now, connection, from, End::Finish);
    }

    /// Takes note that an end is gone. The other end is reset after the delay of the line.
    pub fn handle_reset(&mut self, now: Instant, connection: ConnectionId, from: Side) {
        self.handle_last(now, connection, from, End::Reset);
    }

    fn handle_last(&mut self, now: Instant, connection: ConnectionId, from: Side, end: End) {
        self.now = self.now.max(now);
        let Some(found) = self.connections.get_mut(connection) else { return };
        let has_ended = std::mem::replace(&mut found.directions[from.index()].has_ended, true);
        // A closed connection only waits for both ends, and a reset ends the wait. A repeated end changes nothing, but a reset can follow an end.
        if found.state != State::Open {
            if found.directions.iter().all(|direction| direction.has_ended) || end == End::Reset {
                self.close(connection, Close::Ordinary);
            }
        } else if !has_ended || end == End::Reset {
            let place = found.line(from);
            self.lines[place].offer(self.now, Piece { connection, what: What::End(end) });
            self.collect(place);
        }
    }

    /// Takes note that the program cannot be reached. The client is reset.
    pub fn handle_refused(&mut self, now: Instant, connection: ConnectionId) {
        self.now = self.now.max(now);
        let Some(found) = self.connections.get(connection) else { return };
        self.counts[found.proxy].refused += 1;
        self.close(connection, Close::Reset);
    }

    /// Returns the bytes that may be written to this end in the next write, or `None` if nothing may be written now.
    pub fn writable(&mut self, connection: ConnectionId, to: Side) -> Option<&[u8]> {
        let now = self.now;
        let found = self.connections.get_mut(connection).filter(|found| found.state == State::Open)?;
        found.directions[to.other().index()].writable(now)
    }

    /// Queues [`Event::Ready`] if bytes can be written to this end. The driver calls this function when a full socket has room again.
    pub fn make_ready(&mut self, connection: ConnectionId, to: Side) {
        self.offer_writing(connection, to.other());
    }

    /// Returns and forgets the instant at which the bytes of [`writable`](Self::writable) could first be written, from which the lateness of a write counts.
    pub fn take_due(&mut self, connection: ConnectionId, to: Side) -> Option<Instant> {
        self.connections.get_mut(connection)?.directions[to.other().index()].take_due()
    }

    /// Takes note that the first `count` bytes of [`writable`](Self::writable) are written at the instant `now`.
    pub fn wrote(&mut self, now: Instant, connection: ConnectionId, to: Side, count: usize) {
        self.now = self.now.max(now);
        let Some(found) = self.connections.get_mut(connection) else { return };
        let from = to.other();
        let direction = &mut found.directions[from.index()];
        let next = direction.wrote(self.now, count);
        self.held -= count;
        self.lines[found.line(from)].counts.sent += count as u64;
        if let Wrote::At(at) = next {
            self.timers.insert((at, connection, Timer::Gap(from)));
        }
        self.settle(connection, from);
    }

    /// Returns the instant of the next necessary call of [`Engine::handle_timeout`], or `None` if nothing is under way.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        // Events of inputs, and pieces out of a line at an offer, wait to be polled.
        if !self.events.is_empty() || !self.ready.is_empty() || !self.arrivals.is_empty() {
            return Some(self.now);
        }
        let lines = self.lines.iter().filter_map(|line| line.link.poll_timeout());
        lines.chain(self.timers.first().map(|(at, ..)| *at)).min()
    }

    /// Lets time pass until `now`. [`Engine::poll_event`] then returns the events until `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.now = self.now.max(now);
    }

    /// Returns the next request, in the order of happening: bytes that arrive before the end of their connection can be written before the event of the end.
    pub fn poll_event(&mut self) -> Option<Event> {
        loop {
            // Bytes come before later events. Bytes of several pieces make one event, because each event is a call of the system.
            let next = if self.events.is_empty() { self.next() } else { Next::Flush };
            let is_end = match next {
                Next::Arrival(_, Piece { what: What::Bytes(_), .. }) | Next::Line(..) => false,
                Next::Arrival(..) | Next::Timer | Next::Flush => true,
            };
            // An event that may end a connection waits until all bytes before the event are written.
            if is_end && let Some((connection, side)) = self.ready.pop_first() {
                return Some(Event::Ready(connection, side));
            }
            match next {
                Next::Arrival(place, piece) => {
                    if let Some(((at, _), _)) = self.arrivals.pop_first() {
                        self.arrive(at, place, piece);
                    }
                }
                Next::Line(place, at) => {
                    let passed = self.lines[place].link.handle_timeout(at);
                    debug_assert_eq!(passed, Ok(()), "time has not gone back");
                    self.collect(place);
                }
                Next::Timer => {
                    if let Some((at, connection, timer)) = self.timers.pop_first() {
                        self.fire(at, connection, timer);
                    }
                }
                Next::Flush => return self.events.pop_front(),
            }
        }
    }

    /// Returns the next due step. At equal instants a deadline of a connection comes before bytes arrive, so that a fault at the age zero holds for the first
    /// byte too.
    fn next(&self) -> Next {
        let due = |at: Instant| (at <= self.now).then_some(at);
        let arrival = self.arrivals.first_key_value().and_then(|((at, _), (place, piece))| Some((due(*at)?, 1, Next::Arrival(*place, *piece))));
        let lines = self.lines.iter().enumerate().filter_map(|(place, line)| Some((due(line.link.poll_timeout()?)?, place)));
        let line = lines.min().map(|(at, place)| (at, 2, Next::Line(place, at)));
        let timer = self.timers.first().and_then(|(at, ..)| Some((due(*at)?, 0, Next::Timer)));
        let first = [arrival, line, timer].into_iter().flatten().min_by_key(|(at, rank, _)| (*at, *rank));
        first.map_or(Next::Flush, |(_, _, next)| next)
    }

    /// Takes the pieces at the end of a line. A line reports each piece once, also after an offer or a change at a later instant.
    fn collect(&mut self, place: usize) {
        let line = &mut self.lines[place];
        while let Some(event) = line.link.poll_event() {
            let Fate::Delivered(at) = event.fate else {
                debug_assert!(false, "the line of a stream loses nothing");
                continue;
            };
            line.recent.record(at.saturating_duration_since(event.offered));
            self.arrivals.insert((at, self.arrived), (place, event.payload));
            self.arrived += 1;
        }
    }

    /// Takes a piece at the end of its line.
    fn arrive(&mut self, at: Instant, place: usize, Piece { connection, what }: Piece) {
        // Pieces of an ended connection are dropped. The end of the connection has counted their bytes as lost.
        let Some(found) = self.connections.get_mut(connection).filter(|found| found.state == State::Open) else { return };
        let from = if place.is_multiple_of(2) { Side::Client } else { Side::Server };
        let direction = &mut found.directions[from.index()];
        match what {
            What::Bytes(count) => direction.arrive(at, count),
            What::End(end) => {
                direction.end = Some(end);
                let slow = found.slow_close[from.index()];
                if end == End::Finish && !slow.is_zero() {
                    found.is_slow[from.index()] = true;
                    self.timers.insert((at.saturating_add(slow), connection, Timer::SlowClose(from)));
                }
            }
        }
        self.offer_writing(connection, from);
        self.settle(connection, from);
    }

    /// Makes an event if bytes from this side can be written.
    fn offer_writing(&mut self, connection: ConnectionId, from: Side) {
        let now = self.now;
        let Some(found) = self.connections.get_mut(connection).filter(|found| found.state == State::Open) else { return };
        let direction = &mut found.directions[from.index()];
        // During the gap between two pieces no event is due; the deadline at the end of the gap comes here again.
        if let Some(at) = direction.waits_for_gap(now) {
            self.timers.insert((at, connection, Timer::Gap(from)));
        } else if direction.writable(now).is_some() {
            self.ready.insert((connection, from.other()));
        }
    }

    /// Ends the stream from this side, or the connection, if all bytes before the end have been written.
    fn settle(&mut self, connection: ConnectionId, from: Side) {
        let Some(found) = self.connections.get_mut(connection).filter(|found| found.state == State::Open) else { return };
        let proxy = found.proxy;
        let direction = &found.directions[from.index()];
        // The cut comes first: an end that arrives together with the cut must count as the fault.
        if direction.is_cut() {
            self.counts[proxy].cut_after += 1;
            self.finish_both(connection);
            return;
        }
        // A reset overtakes the bytes in wait for the receiver, as in TCP.
        if direction.end == Some(End::Reset) && !direction.is_stalled {
            self.counts[proxy].reset += 1;
            self.close(connection, Close::Reset);
            return;
        }
        let is_over = direction.end == Some(End::Finish) && direction.is_drained() && !direction.is_stalled;
        if is_over && !found.is_slow[from.index()] && !std::mem::replace(&mut found.is_finished[from.index()], true) {
            self.events.push_back(Event::Finish(connection, from.other()));
            if found.is_finished == [true; 2] {
                self.counts[proxy].ended += 1;
                self.close(connection, Close::Ordinary);
            }
        }
    }

    fn fire(&mut self, at: Instant, connection: ConnectionId, timer: Timer) {
        let Some(found) = self.connections.get_mut(connection) else { return };
        let proxy = found.proxy;
        match timer {
            Timer::Linger => self.close(connection, Close::Ordinary),
            // The faults of a closed connection have nothing left to do.
            _ if found.state != State::Open => {}
            Timer::CloseAfter => {
                self.counts[proxy].closed_after += 1;
                self.finish_both(connection);
            }
            Timer::ResetAfter => {
                self.counts[proxy].reset_after += 1;
                self.close(connection, Close::Reset);
            }
            Timer::Stall(from) => found.directions[from.index()].is_stalled = true,
            Timer::Resume(from) => {
                found.directions[from.index()].resume(at);
                self.offer_writing(connection, from);
                self.settle(connection, from);
            }
            Timer::Gap(from) => self.offer_writing(connection, from),
            Timer::SlowClose(from) => {
                found.is_slow[from.index()] = false;
                self.settle(connection, from);
            }
        }
    }

    /// Ends both streams of a connection after the bytes written so far. Held bytes are lost.
    fn finish_both(&mut self, connection: ConnectionId) {
        self.drop_held(connection);
        if let Some(found) = self.connections.get_mut(connection) {
            found.state = State::Closing;
            self.events.push_back(Event::FinishBoth(connection));
            if found.directions.iter().all(|direction| direction.has_ended) {
                self.close(connection, Close::Ordinary);
            } else {
                self.timers.insert((self.now.saturating_add(LINGER), connection, Timer::Linger));
            }
        }
    }

    fn close(&mut self, connection: ConnectionId, close: Close) {
        self.drop_held(connection);
        self.connections.remove(connection);
        self.events.push_back(Event::Close(connection, close));
    }

    /// Counts the held bytes of a connection as lost.
    fn drop_held(&mut self, connection: ConnectionId) {
        let Some(found) = self.connections.get_mut(connection).filter(|found| found.state == State::Open) else { return };
        for from in [Side::Client, Side::Server] {
            let held = found.directions[from.index()].held();
            self.lines[found.line(from)].counts.lost += held as u64;
            self.held -= held;
        }
        // No event may promise bytes that are lost now.
        self.ready.retain(|(ready, _)| *ready != connection);
    }

    /// Changes a line, the bound on held bytes, and the faults of connections to come. Open connections keep their faults. Bytes on the line keep their delay.
    ///
    /// # Errors
    ///
    /// [`NoLine`] if there is no such line.
    pub fn set_stream(&mut self, now: Instant, line: usize, stream: StreamConfig) -> Result<(), NoLine> {
        let found = self.lines.get_mut(line).ok_or(NoLine)?;
        self.now = self.now.max(now);
        let changed = found.link.set_model(self.now, LinkConfig::clone(stream.line()));
        debug_assert_eq!(changed, Ok(()), "time has not gone back");
        self.collect(line);
        for connection in self.connections.iter_mut().filter(|connection| connection.proxy == line / 2) {
            connection.directions[line % 2].set_window(stream.window());
        }
        let proxy = &mut self.config.proxies[line / 2];
        *(if line.is_multiple_of(2) { &mut proxy.forth } else { &mut proxy.back }) = stream;
        Ok(())
    }

    /// Returns the configuration, with all changes so far.
    #[must_use]
    pub const fn config(&self) -> &StreamsConfig {
        &self.config
    }

    /// Returns the counters of a proxy.
    #[must_use]
    pub fn counts(&self, proxy: usize) -> Option<&Counts> {
        self.counts.get(proxy)
    }

    /// Returns the counters of a line in bytes and in pieces. The end of a stream counts as a piece.
    #[must_use]
    pub fn line(&self, line: usize) -> Option<(LineCounts, LinkStats)> {
        self.lines.get(line).map(|line| (line.counts, line.link.stats()))
    }

    /// Returns the delays of the latest pieces of a line, at most 128, in no particular order.
    #[must_use]
    pub fn recent_delays(&self, line: usize) -> &[Duration] {
        self.lines.get(line).map_or(&[], |line| line.recent.delays())
    }

    /// Returns the number of open connections of all proxies.
    #[must_use]
    pub fn open_connections(&self) -> usize {
        self.connections.len()
    }

    /// Returns the bytes held by all connections.
    #[must_use]
    pub const fn held(&self) -> Bytes {
        Bytes::new(self.held as u64)
    }
}

impl Line {
    fn offer(&mut self, now: Instant, piece: Piece) {
        let size = match piece.what {
            What::Bytes(count) => count as u64,
            What::End(_) => 0,
        };
        let offered = self.link.handle_packet(now, Bytes::new(size), piece);
        debug_assert_eq!(offered, Ok(()), "time has not gone back");
    }
}
