//! A relay between uplinks and links: each packet passes the uplink once, and is then sent on to each receiver.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::Network;
use super::id::{NodeId, Path};
use super::pending::{InNetwork, LineId, SizeAndMarks};
use crate::fates::record::{PacketEvent, PacketRecord};

impl Path {
    /// Returns the path of a packet before the relay, still without a receiver: sender and receiver are equal, unlike in all real paths.
    pub(super) const fn to_relay(from: NodeId) -> Self {
        Self { from, to: from }
    }

    pub(super) fn is_to_relay(self) -> bool {
        self.from == self.to
    }
}

impl<P: Clone> Network<P> {
    /// Offers a packet to the uplink of its sender, and counts the packet on the path to each receiver.
    pub(super) fn send_to_relay(&mut self, now: Instant, from: NodeId, size: SizeAndMarks, payload: P) {
        let mut sequence = 0;
        let mut place = 0;
        while let Some(to) = self.places.receiver(from, place) {
            if to != from {
                let (_, link) = self.link_and_place(Path { from, to });
                // All paths of the sender have the same count, since a node sends all its packets to all. The last count read is the number for all receivers.
                sequence = self.paths[link];
                self.paths[link] += 1;
            }
            place += 1;
        }
        let path = Path::to_relay(from);
        self.offer(now, LineId::Uplink(from), || InNetwork { sequence, offered: now, entered: now, path, size, payload });
    }

    /// Offers a packet after its uplink to the link of each receiver.
    #[inline(never)]
    pub(super) fn relay(&mut self, now: Instant, packet: InNetwork<P>) {
        let damage = self.traffic.take_damage(&packet);
        let from = packet.path.from;
        let mut place = 0;
        while let Some(to) = self.places.receiver(from, place) {
            if to != from {
                let path = Path { from, to };
                let packet = InNetwork { entered: now, path, payload: packet.payload.clone(), ..packet };
                // The flag `DAMAGED` is copied with `size`, so each receiver's packet needs an entry.
                if let Some(damage) = &damage {
                    self.traffic.put_damage(&packet, damage.clone());
                }
                self.offer(now, LineId::Link(self.link(path)), || packet);
            }
            place += 1;
        }
    }

    /// Replaces the next event, if its packet is before the relay, by an event for each receiver.
    pub(super) fn tell_each_receiver(&mut self) {
        if !self.traffic.happened.front().is_some_and(|event| event.path.is_to_relay()) {
            return;
        }
        let Some(event) = self.traffic.happened.pop_front() else { return };
        let from = event.path.from;
        let receivers = (0..).map_while(|place| self.places.receiver(from, place)).filter(|to| *to != from);
        let on = |to| PacketEvent { record: PacketRecord { path: Path { from, to }, ..event.record }, ..event.clone() };
        let events: Vec<PacketEvent<P, Path>> = receivers.map(on).collect();
        // Pushed in reverse order to the front, so the events come out in the order of receivers.
        events.into_iter().rev().for_each(|event| self.traffic.happened.push_front(event));
    }
}
