//! Bound sockets of a host, looked up by port.

/// Index of a socket in [`Sockets`](super::sockets::Sockets). Valid until the socket is closed; a later socket may then get the same index.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct SocketId(pub(super) usize);

/// Bound sockets of a host, sorted by version of IP, then by port.
///
/// A sorted array, because each arriving datagram looks up its port and most hosts have few sockets. Dynamic ports ascend, so most sockets are added at the
/// end.
#[derive(Debug, Default)]
pub(super) struct Bound(Vec<AtPort>);

/// Sockets of one port, in the order of binding.
#[derive(Debug)]
pub(super) struct AtPort {
    port: Port,
    pub(super) first: SocketId,
    /// Sockets that were bound after `first`. Most ports have one socket.
    pub(super) others: Vec<SocketId>,
}

impl AtPort {
    pub(super) fn all(&self) -> impl Iterator<Item = SocketId> {
        std::iter::once(self.first).chain(self.others.iter().copied())
    }
}

/// Port of one version of IP. The lower 16 bits are the number of the port; the next bit is set for version 6.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Port(u32);

impl Port {
    pub(super) const fn new(is_six: bool, number: u16) -> Self {
        Self((is_six as u32) << u16::BITS | number as u32)
    }

    pub(super) const fn is_six(self) -> bool {
        self.0 >> u16::BITS != 0
    }

    #[inline]
    pub(super) const fn number(self) -> u16 {
        #[expect(clippy::cast_possible_truncation, reason = "the lower bits")]
        let number = self.0 as u16;
        number
    }
}

impl Bound {
    /// Returns the sockets of `port`, or `None` if no socket is bound there.
    #[inline]
    pub(super) fn at(&self, port: Port) -> Option<&AtPort> {
        // Most hosts have one socket.
        if let Some(first) = self.0.first().filter(|first| first.port == port) {
            return Some(first);
        }
        self.0.get(self.0.partition_point(|at| at.port < port)).filter(|at| at.port == port)
    }

    /// Adds a socket after all sockets of the same port.
    pub(super) fn add(&mut self, port: Port, socket: SocketId) {
        match self.0.binary_search_by_key(&port, |at| at.port) {
            Ok(place) => self.0[place].others.push(socket),
            Err(place) => self.0.insert(place, AtPort { port, first: socket, others: Vec::new() }),
        }
    }

    /// Removes a socket. Does nothing if the socket is not there, because its host crashed in between and forgot all its sockets.
    pub(super) fn remove(&mut self, port: Port, socket: SocketId) {
        let Ok(place) = self.0.binary_search_by_key(&port, |at| at.port) else { return };
        let AtPort { first, others, .. } = &mut self.0[place];
        if *first != socket {
            others.retain(|other| *other != socket);
        } else if others.is_empty() {
            self.0.remove(place);
        } else {
            *first = others.remove(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_has_its_sockets_in_the_order_in_which_they_were_bound() {
        let port = Port::new;
        let mut bound = Bound::default();
        let given = [(port(false, 9), 0), (port(true, 7), 1), (port(false, 7), 2), (port(false, 7), 3), (port(false, 8), 4), (port(false, 7), 5)];
        for (port, socket) in given {
            bound.add(port, SocketId(socket));
        }
        let at = |bound: &Bound, port| bound.at(port).into_iter().flat_map(AtPort::all).map(|socket| socket.0).collect::<Vec<_>>();
        assert_eq!(at(&bound, port(false, 7)), [2, 3, 5]);
        bound.remove(port(false, 7), SocketId(3));
        // The second call finds the socket gone and does nothing.
        bound.remove(port(false, 7), SocketId(3));
        assert_eq!(at(&bound, port(false, 7)), [2, 5]);
        // The order stays, also where the first of several sockets goes.
        bound.add(port(false, 7), SocketId(6));
        bound.add(port(false, 7), SocketId(7));
        bound.remove(port(false, 7), SocketId(2));
        assert_eq!(at(&bound, port(false, 7)), [5, 6, 7]);
        bound.remove(port(false, 7), SocketId(5));
        assert_eq!(at(&bound, port(false, 7)), [6, 7]);
        bound.remove(port(false, 7), SocketId(6));
        bound.remove(port(false, 7), SocketId(7));
        assert!(at(&bound, port(false, 7)).is_empty());
        assert_eq!(at(&bound, port(true, 7)), [1]);
        assert_eq!([at(&bound, port(false, 8)), at(&bound, port(false, 9))], [[4], [0]]);
        assert!(at(&bound, port(true, 8)).is_empty());
    }
}
