//! One direction of a link.

use std::sync::Arc;

use cohaptic_linkfile::router::{NamedLink, Side};
use cohaptic_realtime::Lateness;
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Link, LinkModel, LinkName, PacketEvent, PacketInfo, PacketRecord};

use super::LaneSnapshot;
use crate::packet::Packet;

const IN_ORDER: &str = "the engine gives no instant before the last one it gave";

/// One direction of a link, with what it does not count itself.
#[derive(Clone, Debug)]
pub(super) struct Lane {
    pub(super) link: Link<Arc<Packet>>,
    /// Packets that were not handed to it because too much was inside all links.
    pub(super) overload: u64,
    delivered_bytes: u64,
    /// The delays since they were last asked for.
    recent: Lateness,
}

impl Lane {
    pub(super) fn new(seed: u64, link: &NamedLink, from: Side) -> Self {
        let end = |side: Side| format!("{}.{}", link.name, side.name());
        let name = LinkName::between(&end(from), &end(from.opposite()));
        Self { link: Link::new(seed, &name, link.model.clone()), overload: 0, delivered_bytes: 0, recent: Lateness::new() }
    }

    /// When something happens next.
    pub(super) fn next_at(&self) -> Option<Instant> {
        self.link.poll_timeout()
    }

    /// Takes a packet.
    pub(super) fn offer(&mut self, now: Instant, info: PacketInfo, packet: Packet) {
        self.link.handle_packet(now, info, Arc::new(packet)).expect(IN_ORDER);
    }

    /// Lets time pass.
    pub(super) fn pass(&mut self, now: Instant) {
        self.link.handle_timeout(now).expect(IN_ORDER);
    }

    /// Becomes another link.
    pub(super) fn change(&mut self, now: Instant, model: &LinkModel) {
        self.link.set_model(now, model.clone()).expect(IN_ORDER);
    }

    /// The packet of an event, if it has arrived, with what the link did to it.
    pub(super) fn arrived(&mut self, event: PacketEvent<Arc<Packet>>) -> Option<(Instant, Arc<Packet>)> {
        let Fate::Delivered(at) = event.fate else { return None };
        self.delivered_bytes += event.size.get();
        self.recent.record(at.saturating_duration_since(event.offered));
        let PacketEvent { record: PacketRecord { marked, .. }, payload: mut packet, damage } = event;
        if marked || damage.is_some() {
            // A copy goes its own way: what happens to one does not happen to the other.
            let packet = Arc::make_mut(&mut packet);
            if marked {
                packet.mark_congestion();
            }
            if let Some(damage) = &damage {
                packet.damage(damage);
            }
        }
        Some((at, packet))
    }

    pub(super) fn snapshot(&mut self, name: &str, from: Side) -> LaneSnapshot {
        let recent = core::mem::take(&mut self.recent);
        LaneSnapshot {
            link: name.to_owned(),
            from,
            stats: self.link.stats(),
            delivered_bytes: self.delivered_bytes,
            overload: self.overload,
            recent_delay: recent.summary(),
        }
    }
}
