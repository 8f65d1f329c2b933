//! The sender of a datagram, through a proxy: clients, each with a port of its own on the far side.

use core::time::Duration;
use std::collections::BTreeMap;
use std::net::SocketAddr;

use cohaptic_units::Instant;

/// A client: its place, and how many had that place before. A datagram on its way to a client that has left does not reach the one that came after it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct ClientId {
    pub(super) slot: u32,
    generation: u32,
}

/// The clients, at most a number of them.
#[derive(Debug)]
pub(super) struct Clients {
    places: BTreeMap<SocketAddr, u32>,
    slots: Vec<Slot>,
    free: Vec<u32>,
    most: u32,
    forget_after: Duration,
    /// When one may have been silent for too long; not later than it is.
    check_at: Option<Instant>,
    /// Those whose ports are to be closed.
    closed: Vec<u32>,
    last: Option<(SocketAddr, u32)>,
}

#[derive(Debug)]
struct Slot {
    address: Option<SocketAddr>,
    generation: u32,
    heard: Instant,
}

impl Clients {
    pub(super) const fn new(most: u32, forget_after: Duration) -> Self {
        Self { places: BTreeMap::new(), slots: Vec::new(), free: Vec::new(), most, forget_after, check_at: None, closed: Vec::new(), last: None }
    }

    /// The client of that address, and whether it is new; `None` if there is no room for a new one.
    #[inline]
    pub(super) fn client(&mut self, from: SocketAddr, now: Instant) -> Option<(ClientId, bool)> {
        let known = match self.last {
            Some((address, slot)) if address == from => Some(slot),
            _ => self.places.get(&from).copied(),
        };
        let slot = match known {
            Some(slot) => slot,
            None => self.open(from, now)?,
        };
        self.last = Some((from, slot));
        let place = &mut self.slots[slot as usize];
        place.heard = now;
        Some((ClientId { slot, generation: place.generation }, known.is_none()))
    }

    /// The client whose port that is, to which something was sent; `None` if it has left.
    #[inline]
    pub(super) fn at_port(&mut self, slot: u32, now: Instant) -> Option<ClientId> {
        let place = self.slots.get_mut(slot as usize).filter(|place| place.address.is_some())?;
        place.heard = now;
        Some(ClientId { slot, generation: place.generation })
    }

    /// Where a client is; `None` if it has left.
    #[inline]
    pub(super) fn address(&self, client: ClientId) -> Option<SocketAddr> {
        self.slots.get(client.slot as usize).filter(|slot| slot.generation == client.generation)?.address
    }

    /// Forgets those that have been silent for too long.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if self.check_at.is_none_or(|at| at > now) {
            return;
        }
        let mut next: Option<Instant> = None;
        for slot in 0..u32::try_from(self.slots.len()).unwrap_or(u32::MAX) {
            let place = &self.slots[slot as usize];
            if place.address.is_none() {
                continue;
            }
            let end = place.heard.saturating_add(self.forget_after);
            if end <= now {
                self.close(slot);
            } else {
                next = Some(next.map_or(end, |next| next.min(end)));
            }
        }
        self.check_at = next;
    }

    /// When [`Clients::handle_timeout`] must be called next.
    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.check_at
    }

    /// The next client whose port is to be closed.
    pub(super) fn poll_closed(&mut self) -> Option<u32> {
        self.closed.pop()
    }

    pub(super) fn count(&self) -> usize {
        self.places.len()
    }

    /// Forgets a client.
    pub(super) fn close(&mut self, slot: u32) {
        let Some(place) = self.slots.get_mut(slot as usize) else { return };
        if let Some(address) = place.address.take() {
            place.generation = place.generation.wrapping_add(1);
            self.places.remove(&address);
            self.free.push(slot);
            self.closed.push(slot);
            self.last = None;
        }
    }

    #[cold]
    fn open(&mut self, from: SocketAddr, now: Instant) -> Option<u32> {
        self.handle_timeout(now);
        let slot = match self.free.pop() {
            Some(slot) => slot,
            None => {
                let slot = u32::try_from(self.slots.len()).ok().filter(|slot| *slot < self.most)?;
                self.slots.push(Slot { address: None, generation: 0, heard: now });
                slot
            }
        };
        self.slots[slot as usize].address = Some(from);
        self.places.insert(from, slot);
        // If its port was to be closed, another one is opened first; the owner closes before it opens.
        let end = now.saturating_add(self.forget_after);
        self.check_at = Some(self.check_at.map_or(end, |at| at.min(end)));
        Some(slot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    fn second(count: u64) -> Instant {
        Instant::from_nanos(count * 1_000_000_000)
    }

    #[test]
    fn a_client_that_falls_silent_makes_room_and_what_was_for_it_reaches_nobody_else() {
        let mut clients = Clients::new(2, Duration::from_secs(30));
        let (first, is_new) = clients.client(address(1), second(0)).unwrap();
        assert!(is_new);
        assert!(clients.client(address(2), second(10)).is_some_and(|(_, is_new)| is_new));
        assert_eq!(clients.client(address(3), second(11)), None, "two are two");
        assert_eq!(clients.poll_timeout(), Some(second(30)));
        // What it is sent keeps it, as what it sends does.
        assert_eq!(clients.at_port(first.slot, second(20)), Some(first));
        clients.handle_timeout(second(30));
        assert_eq!((clients.count(), clients.poll_timeout()), (2, Some(second(40))));
        clients.handle_timeout(second(40));
        assert_eq!((clients.count(), clients.poll_closed(), clients.poll_closed()), (1, Some(1), None));
        clients.handle_timeout(second(50));
        assert_eq!((clients.count(), clients.poll_timeout(), clients.address(first)), (0, None, None));
        let (third, _) = clients.client(address(3), second(60)).unwrap();
        assert_eq!((third.slot, clients.address(third), clients.address(first)), (first.slot, Some(address(3)), None));
        assert_eq!(clients.at_port(1, second(60)), None);
    }

    #[test]
    fn one_that_returns_in_time_is_the_same_one() {
        let mut clients = Clients::new(1, Duration::from_secs(30));
        let (first, _) = clients.client(address(1), second(0)).unwrap();
        assert_eq!(clients.client(address(1), second(29)), Some((first, false)));
        // A newcomer finds room as soon as the other is forgotten, without anybody letting time pass.
        assert_eq!(clients.client(address(2), second(58)), None);
        assert!(clients.client(address(2), second(59)).is_some());
    }
}
