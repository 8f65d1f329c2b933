//! Samples to peers that tick at instants of their own, in windows in which each ticks at most once.
//!
//! A packet is looked at in the first window in which its receiver may tick at or after its arrival. If the receiver does not, or ticks before it, the packet is
//! looked at again in the next window.

use std::ops::Range;

use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId};
use pulp::NullaryFnOnce;

use super::super::Sample;
use super::super::in_flight::{Bucket, InFlight};
use super::super::rows::Rows;
use super::{Links, PerPacket};
use crate::arrays::processor::on_widest;

/// When a receiver ticks next.
#[derive(Clone, Copy, Debug)]
pub(in crate::arrays) struct NextTick {
    pub(in crate::arrays) at: Instant,
    /// A window, or one before it, and an instant of a tick in it, from which the windows until any later instant are counted at the longest span of any clock.
    pub(in crate::arrays) since: (u64, Instant),
}

impl NextTick {
    /// The first window in which the receiver may tick at or after an arrival.
    #[inline(always)]
    fn due<const P: usize>(self, in_flight: &InFlight<P>, arrival: Instant) -> u64 {
        let Self { at, since: (from, since) } = self;
        from + in_flight.count(since, arrival.max(at))
    }
}

impl<const P: usize> PerPacket<P, 1> {
    /// In a window those peers send what `sent` has in their places, in the order of their ticks, each at the instant of its own.
    ///
    /// Where no packets of two senders meet on a line they go in the order in which links lie: with 200 peers in another order each misses the cache.
    pub(in crate::arrays) fn send_in_turn(
        &mut self,
        (processor, window): (pulp::Arch, u64),
        senders: &[usize],
        instant: impl Fn(usize) -> Instant,
        sent: &[Sample<P, 1>],
        next_tick: impl Fn(usize) -> NextTick,
    ) {
        let Self { rows, links, in_flight, receivers, sends, .. } = self;
        let Links::Direct(links) = links else {
            unreachable!("the shape of a scene says that all links are direct where peers tick at instants of their own")
        };
        if senders.is_empty() {
            return;
        }
        sends.fill(false);
        senders.iter().for_each(|sender| sends[*sender] = true);
        on_widest(processor, SendingInTurn { rows, receivers: receivers.clone(), links, sends, sent, in_flight, window, instant, next_tick });
    }

    /// In a window, or a part of it, each receiver takes in what arrives before an instant of its own, which lies a nanosecond after its tick; at 0 if it does not
    /// tick. The rest is looked at again in a window, which may be the same one.
    pub(in crate::arrays) fn deliver_in_turn(&mut self, (window, next): (u64, u64), until: impl Fn(usize) -> u64) {
        let Some(mut bucket) = self.in_flight.due(window) else { return };
        let Self { in_flight, .. } = self;
        for packets in [&mut bucket.in_order, &mut bucket.overtaking] {
            packets.retain(|packet| {
                let arrives = packet.arrival.as_nanos() < until(usize::from(packet.receiver));
                if !arrives {
                    // Another of its link may lie there that arrives later.
                    in_flight.push_due((window, next), *packet, true);
                }
                arrives
            });
        }
        self.take_in(bucket);
    }

    /// The run ends: all take in what has arrived by that instant, and nothing arrives later. `sent` says when a packet of a sender was sent.
    pub(in crate::arrays) fn end_in_turn(&mut self, until: Instant, sent: impl Fn(usize, u64) -> Instant) {
        let arrived = self.in_flight.take_arrived(until);
        self.take_in(Bucket { in_order: Vec::new(), overtaking: arrived });
        if until < self.end {
            self.end_early(0, sent);
        }
    }
}

/// The packets of a window over links that know at once when each arrives.
struct SendingInTurn<'a, const P: usize, I, N> {
    rows: &'a Rows,
    receivers: Range<usize>,
    links: &'a mut DirectLinks,
    /// Whether each peer of the scene sends.
    sends: &'a [bool],
    sent: &'a [Sample<P, 1>],
    in_flight: &'a mut InFlight<P>,
    window: u64,
    instant: I,
    next_tick: N,
}

impl<const P: usize, I: Fn(usize) -> Instant, N: Fn(usize) -> NextTick> NullaryFnOnce for SendingInTurn<'_, P, I, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        if self.links.are_chains() { self.by_link::<true>() } else { self.by_link::<false>() }
    }
}

impl<const P: usize, I: Fn(usize) -> Instant, N: Fn(usize) -> NextTick> SendingInTurn<'_, P, I, N> {
    /// Eight links to a receiver at a time.
    #[inline(always)]
    fn by_link<const CHAINS: bool>(self) {
        let Self { rows, receivers, links, sends, sent, in_flight, window, instant, next_tick } = self;
        let mut arrivals = Arrivals::NONE;
        for receiver in receivers {
            let next_tick = next_tick(receiver);
            let row = rows.columns(receiver);
            for first in (0..row).step_by(DirectLinks::AT_ONCE) {
                let count = DirectLinks::AT_ONCE.min(row - first);
                let (mut idle, mut instants) = (u8::MAX, [Instant::ZERO; DirectLinks::AT_ONCE]);
                for (place, at) in instants[..count].iter_mut().enumerate() {
                    let sender = rows.sender(receiver, first + place);
                    *at = instant(sender);
                    idle ^= u8::from(sends[sender] && sender != receiver) << place;
                }
                if idle == u8::MAX {
                    continue;
                }
                let link = LinkId::new(rows.link(receiver, first));
                links.offer_as::<CHAINS>(&instants, link, count, idle, &mut arrivals);
                for place in arrivals.places() {
                    let (column, at) = (first + place, arrivals.at[place]);
                    let state = sent[rows.sender(receiver, column)].state(0);
                    let packet = rows.packet::<P, 1>((receiver, column, 0), &state, at, arrivals.sequences[place]);
                    in_flight.push_due((window, next_tick.due(in_flight, at)), packet, arrivals.overtakes(place));
                }
            }
        }
    }
}
