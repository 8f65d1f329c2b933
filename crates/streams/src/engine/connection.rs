//! Connections, and the table of connections.

use std::time::Duration;

use super::Side;
use super::direction::Direction;

/// Name of a connection. Names are not used again.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct ConnectionId {
    /// Place in the table. Used again after the connection is over, so that a table of the driver can have the same places.
    slot: u32,
    /// Number of former connections at the place.
    generation: u32,
}

impl ConnectionId {
    /// Returns the place of the connection among the open connections. Places are small, and are used again.
    #[must_use]
    pub const fn slot(self) -> usize {
        self.slot as usize
    }
}

/// State of a connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum State {
    Open,
    /// A fault has ended both streams. All later bytes are lost.
    Closing,
}

#[derive(Debug)]
pub(super) struct Connection {
    pub(super) proxy: usize,
    pub(super) state: State,
    /// Bytes from the client, and bytes from the server.
    pub(super) directions: [Direction; 2],
    /// Time by which the end of each stream is late; zero without the fault.
    pub(super) slow_close: [Duration; 2],
    /// `true` where the end of the stream has left the line and waits for `slow_close`.
    pub(super) is_slow: [bool; 2],
    /// `true` where the end of the stream has reached the receiver.
    pub(super) is_finished: [bool; 2],
}

impl Connection {
    pub(super) fn new(proxy: usize, directions: [(Direction, Duration); 2]) -> Self {
        let [(forth, forth_slow), (back, back_slow)] = directions;
        Self {
            proxy,
            state: State::Open,
            directions: [forth, back],
            slow_close: [forth_slow, back_slow],
            is_slow: [false; 2],
            is_finished: [false; 2],
        }
    }

    /// Returns the index of the line for bytes from this side.
    pub(super) const fn line(&self, from: Side) -> usize {
        2 * self.proxy + from.index()
    }
}

/// Open connections, by their names.
#[derive(Debug, Default)]
pub(super) struct Table {
    /// Generation of each place, with its connection.
    slots: Vec<(u32, Option<Connection>)>,
    free: Vec<u32>,
}

impl Table {
    #[expect(clippy::cast_possible_truncation, reason = "a connection takes two descriptors, of which a system has fewer than 2³²")]
    pub(super) fn insert(&mut self, connection: Connection) -> ConnectionId {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push((0, None));
            (self.slots.len() - 1) as u32
        });
        let (generation, place) = &mut self.slots[slot as usize];
        *place = Some(connection);
        ConnectionId { slot, generation: *generation }
    }

    pub(super) fn get(&self, id: ConnectionId) -> Option<&Connection> {
        let (generation, connection) = self.slots.get(id.slot())?;
        connection.as_ref().filter(|_| *generation == id.generation)
    }

    pub(super) fn get_mut(&mut self, id: ConnectionId) -> Option<&mut Connection> {
        let (generation, connection) = self.slots.get_mut(id.slot())?;
        connection.as_mut().filter(|_| *generation == id.generation)
    }

    /// Returns all connections in the order of their places.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Connection> {
        self.slots.iter_mut().filter_map(|(_, connection)| connection.as_mut())
    }

    pub(super) fn remove(&mut self, id: ConnectionId) {
        if self.get(id).is_some() {
            let (generation, connection) = &mut self.slots[id.slot()];
            *generation = generation.wrapping_add(1);
            *connection = None;
            self.free.push(id.slot);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.slots.len() - self.free.len()
    }
}
