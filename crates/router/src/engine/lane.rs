//! Lane: a link, which is one direction of a name of the file, with the counters of the router.

use std::sync::Arc;

use cohaptic_linkfile::router::{NamedLink, Side};
use cohaptic_realtime::Lateness;
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Link, LinkModel, LinkName, PacketEvent, PacketInfo, PacketRecord};

use super::LaneSnapshot;
use crate::packet::Packet;

const IN_ORDER: &str = "the engine gives no instant before the last one it gave";

/// A link in one direction, with further counters of the router beside the counters of the link.
#[derive(Clone, Debug)]
pub(super) struct Lane {
    pub(super) link: Link<Arc<Packet>>,
    /// Packets not offered to the link, because too many packets or bytes were inside all links.
    pub(super) overload: u64,
    /// Bytes of IP in all delivered packets.
    delivered_bytes: u64,
    /// Delays of packets delivered since the last snapshot.
    recent: Lateness,
}

impl Lane {
    /// Returns an empty lane for packets from the side `from`. Seed and names of both ends select the random stream.
    pub(super) fn new(seed: u64, link: &NamedLink, from: Side) -> Self {
        let end = |side: Side| format!("{}.{}", link.name, side.name());
        let name = LinkName::between(&end(from), &end(from.opposite()));
        Self {
            link: Link::new(seed, &name, link.model.clone()).with_flows(|packet| packet.flow()),
            overload: 0,
            delivered_bytes: 0,
            recent: Lateness::new(),
        }
    }

    /// Returns the instant of the link's next event.
    pub(super) fn next_at(&self) -> Option<Instant> {
        self.link.poll_timeout()
    }

    /// Offers a packet to the link.
    pub(super) fn offer(&mut self, now: Instant, info: PacketInfo, packet: Packet) {
        self.link.handle_packet(now, info, Arc::new(packet)).expect(IN_ORDER);
    }

    /// Lets time pass inside the link until `now`.
    pub(super) fn pass(&mut self, now: Instant) {
        self.link.handle_timeout(now).expect(IN_ORDER);
    }

    /// Lets time pass inside the link until `now`, and computes the cross packets up to `now`.
    pub(super) fn catch_up(&mut self, now: Instant) {
        self.link.catch_up(now).expect(IN_ORDER);
    }

    /// Gives the link another model from `now` on.
    pub(super) fn change(&mut self, now: Instant, model: &LinkModel) {
        self.link.set_model(now, model.clone()).expect(IN_ORDER);
    }

    /// Returns instant and packet of a delivery, with the marks and the bit errors of the link, or `None` for any other event.
    pub(super) fn arrived(&mut self, event: PacketEvent<Arc<Packet>>) -> Option<(Instant, Arc<Packet>)> {
        let Fate::Delivered(at) = event.fate else { return None };
        self.delivered_bytes += event.size.get();
        self.recent.record(at.saturating_duration_since(event.offered));
        let PacketEvent { record: PacketRecord { marked, .. }, payload: mut packet, damage, part: _ } = event;
        if marked || damage.is_some() {
            // A copy may share the packet. `make_mut` then clones the packet, so that the copy keeps its own marks and bits.
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

    /// Returns the counters, and begins a new period of `recent`.
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
