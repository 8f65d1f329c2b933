//! Clients of a proxy. Each client address gets a slot, standing for a port of the client's own towards the server. A silence frees the slot. Sockets are
//! opened and closed elsewhere.

use core::time::Duration;
use std::collections::BTreeMap;
use std::net::SocketAddr;

use cohaptic_units::Instant;

/// Identity of a client: a slot, and the number of earlier clients in this slot. A datagram in flight for a former client therefore never reaches the next
/// client of the same slot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct ClientId {
    pub(super) slot: u32,
    generation: u32,
}

/// Known clients, at most `most`.
#[derive(Debug)]
pub(super) struct Clients {
    /// Slot of each known client, by address.
    places: BTreeMap<SocketAddr, u32>,
    /// Every slot ever used, indexed by slot number.
    slots: Vec<Slot>,
    /// Slots without a client, ready for reuse.
    free: Vec<u32>,
    /// Bound on the number of slots.
    most: u32,
    /// Silence before a client is forgotten.
    forget_after: Duration,
    /// Instant of the next search for silent clients, never later than the end of any client's silence. `None` if there are no clients.
    check_at: Option<Instant>,
    /// Slots of former clients whose ports the owner has still to close.
    closed: Vec<u32>,
    /// Address and slot of the latest sender: most datagrams of a batch come from the same client.
    last: Option<(SocketAddr, u32)>,
}

/// Slot for one client at a time.
#[derive(Debug)]
struct Slot {
    /// Address of the client; `None` if the slot is free.
    address: Option<SocketAddr>,
    /// Number of earlier clients in this slot, modulo 2³².
    generation: u32,
    /// Instant of the latest datagram from or to the client.
    heard: Instant,
}

impl Clients {
    pub(super) const fn new(most: u32, forget_after: Duration) -> Self {
        Self { places: BTreeMap::new(), slots: Vec::new(), free: Vec::new(), most, forget_after, check_at: None, closed: Vec::new(), last: None }
    }

    /// Returns the client with the address `from`, and whether the client is new. Restarts the client's silence timer. Returns `None` if there is no room for a
    /// new client.
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
        // `places` and `last` name slots in use only, so the index is valid.
        let place = &mut self.slots[slot as usize];
        place.heard = now;
        Some((ClientId { slot, generation: place.generation }, known.is_none()))
    }

    /// Returns the client whose port received an answer, and restarts the client's silence timer. Returns `None` if the client has left.
    pub(super) fn at_port(&mut self, slot: u32, now: Instant) -> Option<ClientId> {
        let place = self.slots.get_mut(slot as usize).filter(|place| place.address.is_some())?;
        place.heard = now;
        Some(ClientId { slot, generation: place.generation })
    }

    /// Returns the address of a client, or `None` if the client has left.
    pub(super) fn address(&self, client: ClientId) -> Option<SocketAddr> {
        self.slots.get(client.slot as usize).filter(|slot| slot.generation == client.generation)?.address
    }

    /// Forgets clients after a silence of `forget_after`.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if self.check_at.is_none_or(|at| at > now) {
            return;
        }
        let mut next: Option<Instant> = None;
        for slot in 0..u32::try_from(self.slots.len()).unwrap_or(u32::MAX) {
            let place = &self.slots[slot as usize];
            // Slots number fewer than 2³²: `open` bounds them by `most`.
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
        // The search reads every slot. `next` becomes the earliest end of a silence, so that the next search is no earlier than necessary.
        self.check_at = next;
    }

    /// Returns the instant of the next necessary call of [`Clients::handle_timeout`].
    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.check_at
    }

    /// Returns the slot of the next client whose port is to be closed.
    pub(super) fn poll_closed(&mut self) -> Option<u32> {
        self.closed.pop()
    }

    /// Returns the number of known clients.
    pub(super) fn count(&self) -> usize {
        self.places.len()
    }

    /// Forgets the client in a slot. Nothing happens if the slot is free or was never used.
    pub(super) fn close(&mut self, slot: u32) {
        let Some(place) = self.slots.get_mut(slot as usize) else { return };
        if let Some(address) = place.address.take() {
            // From here on the identities of datagrams in flight no longer match the slot.
            place.generation = place.generation.wrapping_add(1);
            self.places.remove(&address);
            self.free.push(slot);
            self.closed.push(slot);
            // `last` may name the slot that has just become free.
            self.last = None;
        }
    }

    /// Gives a new client a slot, or returns `None` if every slot is taken.
    fn open(&mut self, from: SocketAddr, now: Instant) -> Option<u32> {
        // Clients whose silence has ended make room first, even if the driver has not let time pass that far.
        self.handle_timeout(now);
        let slot = match self.free.pop() {
            Some(slot) => slot,
            None => {
                // Slots are numbered without gaps, so that the owner can keep the ports in an array.
                let slot = u32::try_from(self.slots.len()).ok().filter(|slot| *slot < self.most)?;
                self.slots.push(Slot { address: None, generation: 0, heard: now });
                slot
            }
        };
        self.slots[slot as usize].address = Some(from);
        self.places.insert(from, slot);
        // A slot can be in `closed` and in use at the same time. The owner closes ports before opening ports, so the new client's port is not closed by
        // mistake.
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
        // A datagram to the client also restarts the client's silence timer.
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
        // A new client finds room as soon as the silence of the first client ends, without a call of `handle_timeout`.
        assert_eq!(clients.client(address(2), second(58)), None);
        assert!(clients.client(address(2), second(59)).is_some());
    }
}
