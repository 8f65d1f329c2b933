//! Slots of connections: limits the open connections of hosts, guests and strangers separately, so that neither guests nor strangers can keep the host out.

use core::net::{IpAddr, Ipv6Addr};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use crate::Role;

/// Limits of open connections. Connections share the process's limit of open files, often 1024, with the real-time side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Greatest number of connections without a shown token.
    pub(super) strangers: usize,
    /// Greatest number of connections with the token of guests.
    pub(super) guests: usize,
    /// Greatest number of connections with the token of the host.
    pub(super) hosts: usize,
}

impl Limits {
    pub(super) const USUAL: Self = Self { strangers: 256, guests: 64, hosts: 64 };

    const fn of(self, role: Role) -> usize {
        match role {
            Role::Host => self.hosts,
            Role::Guest => self.guests,
        }
    }
}

/// All slots of a server, free and taken.
#[derive(Debug)]
pub(super) struct Slots {
    limits: Limits,
    taken: Mutex<Taken>,
}

/// Taken slots. Each connection counts once: as a stranger, a guest or a host.
#[derive(Debug, Default)]
struct Taken {
    /// Strangers in order of arrival, and so in ascending order of `number`.
    strangers: VecDeque<Stranger>,
    /// Number of strangers by network. Entries are never zero.
    networks: BTreeMap<IpAddr, usize>,
    guests: usize,
    hosts: usize,
    /// Number of connections so far; gives each stranger a unique number.
    arrived: u64,
}

#[derive(Debug)]
struct Stranger {
    number: u64,
    network: IpAddr,
    sent_away: Arc<Notify>,
}

impl Slots {
    pub(super) fn new(limits: Limits) -> Arc<Self> {
        Arc::new(Self { limits, taken: Mutex::default() })
    }

    /// Takes a stranger's slot for a new connection. If all slots are taken, another stranger loses the slot first, chosen as in
    /// [`send_one_away`](Self::send_one_away).
    pub(super) fn take(self: &Arc<Self>, address: IpAddr) -> Arc<Slot> {
        let mut taken = self.lock();
        if taken.strangers.len() >= self.limits.strangers {
            taken.send_one_away();
        }
        taken.arrived += 1;
        let (number, network, sent_away) = (taken.arrived, network_of(address), Arc::new(Notify::new()));
        taken.strangers.push_back(Stranger { number, network, sent_away: Arc::clone(&sent_away) });
        *taken.networks.entry(network).or_default() += 1;
        // The slot knows the number, so that `show` and `drop` can find the stranger among the others.
        Arc::new(Slot { slots: Arc::clone(self), number, sent_away, role: Mutex::new(None) })
    }

    /// Ends the oldest stranger's connection from the network with the most strangers. So a flood from another network does not displace a host whose first
    /// request is still on the way.
    pub(super) fn send_one_away(&self) {
        self.lock().send_one_away();
    }

    fn lock(&self) -> MutexGuard<'_, Taken> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Taken {
    fn send_one_away(&mut self) {
        // The network with the most strangers is the likely source of a flood.
        let Some(most) = self.networks.iter().max_by_key(|(_, count)| **count).map(|(network, _)| *network) else { return };
        let oldest = self.strangers.iter().find(|stranger| stranger.network == most).map(|stranger| stranger.number);
        if let Some(stranger) = oldest.and_then(|number| self.remove(number)) {
            stranger.sent_away.notify_one();
        }
    }

    /// Removes a connection from the strangers; `None` if the connection is no stranger any more.
    fn remove(&mut self, number: u64) -> Option<Stranger> {
        // Numbers grow in order of arrival, so the queue is sorted by number.
        let at = self.strangers.binary_search_by_key(&number, |stranger| stranger.number).ok()?;
        let stranger = self.strangers.remove(at)?;
        // Entries never stay at zero: otherwise old networks would fill the memory.
        if let Some(count) = self.networks.get_mut(&stranger.network) {
            *count -= 1;
            if *count == 0 {
                self.networks.remove(&stranger.network);
            }
        }
        Some(stranger)
    }

    const fn count(&mut self, role: Role) -> &mut usize {
        match role {
            Role::Host => &mut self.hosts,
            Role::Guest => &mut self.guests,
        }
    }
}

/// Returns the network of an address, counted as a single client: the first 64 bits of an IPv6 address, since a machine can choose the other bits freely,
/// and the whole of an IPv4 address.
fn network_of(address: IpAddr) -> IpAddr {
    // An IPv4 address may come mapped into IPv6. Without the canonical form, all IPv4 clients would share a network.
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & !u128::from(u64::MAX)).into(),
    }
}

/// The slot of a connection. Shared by all parts of the connection (requests in progress, a WebSocket), and free again when the last part is dropped.
#[derive(Debug)]
pub(super) struct Slot {
    slots: Arc<Slots>,
    number: u64,
    sent_away: Arc<Notify>,
    /// Highest role shown on the connection; `None` for a stranger.
    role: Mutex<Option<Role>>,
}

impl Slot {
    /// Returns whether no token was shown on the connection.
    pub(super) fn is_strange(&self) -> bool {
        self.role().is_none()
    }

    /// Moves the connection to the slots of `role`. A host's connection stays a host's. Returns `false` if all slots of `role` are taken; the connection
    /// then keeps its old slot.
    pub(super) fn show(&self, role: Role) -> bool {
        let mut shown = self.role();
        if *shown == Some(role) || *shown == Some(Role::Host) {
            return true;
        }
        // The order of locks is the same in all methods: first the slot's role, then the slots.
        let mut taken = self.slots.lock();
        if *taken.count(role) >= self.slots.limits.of(role) {
            return false;
        }
        *taken.count(role) += 1;
        match *shown {
            // A guest that shows the host's token gives the guest's slot back.
            Some(before) => *taken.count(before) -= 1,
            None => drop(taken.remove(self.number)),
        }
        *shown = Some(role);
        true
    }

    /// Returns when the connection must end, because a newer connection took its slot.
    pub(super) async fn sent_away(&self) {
        self.sent_away.notified().await;
    }

    fn role(&self) -> MutexGuard<'_, Option<Role>> {
        self.role.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Slot {
    // The connection still counts for its last role, or as a stranger unless it was sent away.
    fn drop(&mut self) {
        let role = *self.role();
        let mut taken = self.slots.lock();
        match role {
            Some(role) => *taken.count(role) -= 1,
            None => drop(taken.remove(self.number)),
        }
    }
}

#[cfg(test)]
mod tests {
    use core::net::Ipv4Addr;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    const HERE: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

    fn slots(strangers: usize, guests: usize, hosts: usize) -> Arc<Slots> {
        Slots::new(Limits { strangers, guests, hosts })
    }

    /// Returns whether the connection was asked to end.
    fn is_sent_away(slot: &Slot) -> bool {
        use futures_util::FutureExt as _;

        slot.sent_away().now_or_never().is_some()
    }

    #[test]
    fn a_new_stranger_sends_the_oldest_one_away_and_nobody_else() {
        let slots = slots(3, 1, 1);
        let connections: Vec<_> = (0..3).map(|_| slots.take(HERE)).collect();
        assert!(connections[0].show(Role::Host));
        let more: Vec<_> = (0..2).map(|_| slots.take(HERE)).collect();
        assert_eq!(
            [&connections[0], &connections[1], &connections[2], &more[0], &more[1]].map(|slot| is_sent_away(slot)),
            [false, true, false, false, false]
        );
        drop(more);
        let _again = slots.take(HERE);
        assert!(!is_sent_away(&connections[2]), "slots are free again");
    }

    #[test]
    fn a_flood_from_one_network_sends_away_its_own() {
        let slots = slots(8, 1, 1);
        let visitor = slots.take("192.0.2.7".parse().unwrap());
        let flood: Vec<_> = (0..100_u128).map(|low| slots.take(IpAddr::from(Ipv6Addr::from_bits((0x2001_0db8 << 96) | low)))).collect();
        assert!(!is_sent_away(&visitor), "64 bits of addresses are one network");
        assert_eq!(flood.iter().filter(|slot| !is_sent_away(slot)).count(), 7);
    }

    #[test]
    fn every_role_has_slots_of_its_own() {
        let slots = slots(4, 2, 1);
        let guests: Vec<_> = (0..2).map(|_| slots.take(HERE)).collect();
        assert!(guests.iter().all(|slot| slot.show(Role::Guest)));
        let (late, host, second) = (slots.take(HERE), slots.take(HERE), slots.take(HERE));
        assert!(!late.show(Role::Guest) && late.is_strange());
        assert!(host.show(Role::Host) && host.show(Role::Guest), "a host's connection stays one");
        assert!(!second.show(Role::Host));
        drop((guests, host));
        assert!(late.show(Role::Guest) && second.show(Role::Host));
        assert!(late.show(Role::Guest), "it has its slot already");
    }

    properties! {
        /// After any sequence of steps no role has more connections than slots, and all slots are free after the last connection.
        #[test]
        fn slots_are_counted_right(steps in prop::collection::vec((0..3_u8, 0..8_usize, any::<bool>()), 0..200)) {
            let slots = slots(3, 2, 1);
            let mut connections = Vec::new();
            for (step, which, is_host) in steps {
                match step {
                    0 => connections.push(slots.take(HERE)),
                    1 if which < connections.len() => drop(connections.swap_remove(which)),
                    2 if which < connections.len() => { connections[which].show(if is_host { Role::Host } else { Role::Guest }); }
                    _ => {}
                }
                let taken = slots.lock();
                prop_assert!(taken.strangers.len() <= 3 && taken.guests <= 2 && taken.hosts <= 1);
                prop_assert_eq!(taken.networks.values().sum::<usize>(), taken.strangers.len());
            }
            drop(connections);
            let taken = slots.lock();
            prop_assert!(taken.strangers.is_empty() && taken.guests == 0 && taken.hosts == 0);
        }
    }
}
