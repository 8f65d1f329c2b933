//! Samples to peers that tick at instants of their own, in windows in which each ticks at most once.
//!
//! A packet is looked at in the first window in which its receiver may tick at or after its arrival. If the receiver does not, or ticks before it, the packet is
//! looked at again in the next window.

use cohaptic_units::Instant;
use cohaptic_wan::LinkId;

use super::super::Sample;
use super::super::in_flight::Bucket;
use super::{Links, PerPacket};

/// When a receiver ticks next.
#[derive(Clone, Copy, Debug)]
pub(in crate::arrays) struct NextTick {
    pub(in crate::arrays) at: Instant,
    /// A window, or one before it, and an instant of a tick in it, from which the windows until any later instant are counted at the longest span of any clock.
    pub(in crate::arrays) since: (u64, Instant),
    /// The first window in which it may tick.
    pub(in crate::arrays) least: u64,
}

impl<const P: usize> PerPacket<P, 1> {
    /// In a window those peers send what `sent` has in their places, in the order of their ticks, each at the instant of its own.
    ///
    /// Where no packets of two senders meet on a line they go in the order in which links lie: with 200 peers in another order each misses the cache.
    pub(in crate::arrays) fn send_in_turn(
        &mut self,
        window: u64,
        senders: &mut [usize],
        instant: impl Fn(usize) -> Instant,
        sent: &[Sample<P, 1>],
        next_tick: impl Fn(usize) -> NextTick,
    ) {
        let Self { rows, links, in_flight, receivers, .. } = self;
        let links = match links {
            Links::Direct(links) => links,
            Links::Carried(carrier) => {
                return senders.iter().for_each(|sender| carrier.send(instant(*sender), &[*sender], sent));
            }
            Links::Stepped(..) => unreachable!("the shape of a scene says that no link looks ahead where peers tick at instants of their own"),
        };
        senders.sort_unstable();
        for receiver in receivers.clone() {
            let NextTick { at, since: (from, since), least } = next_tick(receiver);
            for sender in senders.iter().filter(|sender| **sender != receiver) {
                let Some(column) = rows.column(receiver, *sender) else { continue };
                let link = LinkId::new(rows.link(receiver, column));
                let sequence = links.offered(link);
                if let Some((arrival, overtakes)) = links.offer_one(instant(*sender), link) {
                    let packet = rows.packet::<P, 1>((receiver, column, 0), &sent[*sender].state(0), arrival, sequence);
                    let due = (from + in_flight.count(since, arrival.max(at))).max(least);
                    in_flight.push_due((window, due), packet, overtakes);
                }
            }
        }
    }

    /// In a window each receiver takes in what arrives before an instant of its own, which lies a nanosecond after its tick; at 0 if it does not tick.
    pub(in crate::arrays) fn deliver_in_turn(&mut self, window: u64, latest: Instant, until: impl Fn(usize) -> u64) {
        if matches!(self.links, Links::Carried(_)) {
            return self.deliver_carried_until(latest, until);
        }
        let Some(mut bucket) = self.in_flight.due(window) else { return };
        let Self { in_flight, .. } = self;
        for packets in [&mut bucket.in_order, &mut bucket.overtaking] {
            packets.retain(|packet| {
                let arrives = packet.arrival.as_nanos() < until(usize::from(packet.receiver));
                if !arrives {
                    // Another of its link may lie there that arrives later.
                    in_flight.push_due((window, window + 1), *packet, true);
                }
                arrives
            });
        }
        self.take_in(bucket);
    }

    /// The run ends: all take in what has arrived by that instant, and nothing arrives later. `sent` says when a packet of a sender was sent.
    pub(in crate::arrays) fn end_in_turn(&mut self, until: Instant, sent: impl Fn(usize, u64) -> Instant) {
        if matches!(self.links, Links::Carried(_)) {
            return self.deliver_carried_until(until, |_| u64::MAX);
        }
        let arrived = self.in_flight.take_arrived(until);
        self.take_in(Bucket { in_order: Vec::new(), overtaking: arrived });
        if until < self.end {
            self.end_early(0, sent);
        }
    }
}
