//! The record of a run.

use std::sync::Arc;

use bytes::Bytes;
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Network, PacketEvent, Path};

use super::exits::{Exits, Out};
use super::{HitCount, Parcel, Settings};
use crate::again::Drawn;
use crate::names::Names;
use crate::trace::{Happening, Trace};

/// The record of a run, as far as it is asked for.
#[derive(Debug)]
pub(crate) struct Recording {
    trace: Trace,
    packets: Vec<Seen>,
    pub(crate) traces: bool,
    pub(super) digests: bool,
    keeps_packets: bool,
}

/// What became of a packet on its link, with its bytes.
pub(crate) type Seen = PacketEvent<Bytes, Path>;

/// What was recorded of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorded {
    pub(crate) trace: Trace,
    pub(crate) packets: Vec<Seen>,
    /// When the run ended.
    pub(crate) ended: Instant,
    /// What each law did.
    pub(crate) hits: Vec<HitCount>,
    pub(crate) drawn: Drawn,
}

/// No link holds a packet for longer than this many of its events.
const MOST_EVENTS: u32 = 10_000_000;

impl Recording {
    pub(super) const fn new(hosts: Arc<Names>, settings: &Settings) -> Self {
        let Settings { traces, digests, keeps_packets, .. } = *settings;
        Self { trace: Trace::new(hosts), packets: Vec::new(), traces, digests, keeps_packets }
    }

    /// Whether anything is recorded.
    #[inline]
    pub(super) const fn is_on(&self) -> bool {
        self.traces || self.keeps_packets
    }

    #[inline]
    pub(super) fn note(&mut self, at: Instant, what: Happening) {
        if self.traces {
            self.trace.push(at, what);
        }
    }

    #[inline]
    pub(super) fn keep<A>(&mut self, event: &Out<A>) {
        if self.keeps_packets {
            self.packets.push(seen(event));
        }
    }

    /// What happened so far.
    pub(crate) const fn trace(&self) -> &Trace {
        &self.trace
    }

    /// The packets that have been recorded, and the ends of those that are in this network and behind it, from `now` on.
    pub(super) fn followed_through<A: Clone>(&self, network: &Network<Box<Parcel<A>>>, mut exits: Exits<A>, mut now: Instant) -> Vec<Seen> {
        let mut packets = self.packets.clone();
        if !self.keeps_packets {
            return packets;
        }
        let mut network = network.clone();
        for _ in 0..MOST_EVENTS {
            while let Some(out) = exits.poll_with(&mut network, now) {
                if let Fate::Delivered(at) = out.fate {
                    exits.arrived(out.path, at);
                }
                packets.push(seen(&out));
            }
            let Some(next) = [network.poll_timeout(), exits.next()].into_iter().flatten().min() else { break };
            now = next;
            if network.handle_timeout(next).is_err() {
                break;
            }
        }
        packets.extend(exits.abandon(now).map(|out| seen(&out)));
        packets
    }
}

/// What a link says of a packet, as the row of its log.
fn seen<A>(out: &Out<A>) -> Seen {
    PacketEvent { record: out.record, payload: out.payload.bytes.clone().into(), damage: out.damage.clone() }
}
