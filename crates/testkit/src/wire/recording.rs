//! The record of a run.

use bytes::Bytes;
use cohaptic_units::Instant;
use cohaptic_wan::{Network, PacketEvent, PacketRecord, Path};

use super::{Parcel, Settings};
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

/// What was recorded of a run, and when it ended.
pub(crate) type Recorded = (Trace, Vec<Seen>, Instant);

/// No link holds a packet for longer than this many of its events.
const MOST_EVENTS: u32 = 10_000_000;

impl Recording {
    pub(super) const fn new(hosts: Vec<String>, settings: &Settings) -> Self {
        let Settings { traces, digests, keeps_packets, .. } = *settings;
        Self { trace: Trace::new(hosts), packets: Vec::new(), traces, digests, keeps_packets }
    }

    #[inline]
    pub(super) fn note(&mut self, at: Instant, what: Happening) {
        if self.traces {
            self.trace.push(at, what);
        }
    }

    #[inline]
    pub(super) fn keep<A>(&mut self, event: &PacketEvent<Parcel<A>, Path>) {
        if self.keeps_packets {
            self.packets.push(seen(event));
        }
    }

    /// What happened so far.
    pub(crate) const fn trace(&self) -> &Trace {
        &self.trace
    }

    /// What has been recorded until `now`, and the ends of the packets that are in this network.
    pub(super) fn followed_through<A: Clone>(&self, network: &Network<Parcel<A>>, now: Instant) -> Recorded {
        let mut packets = self.packets.clone();
        let mut network = self.keeps_packets.then(|| network.clone());
        for _ in 0..MOST_EVENTS {
            let Some(network) = &mut network else { break };
            packets.extend(std::iter::from_fn(|| network.poll_event()).map(|event| seen(&event)));
            let Some(next) = network.poll_timeout() else { break };
            if network.handle_timeout(next).is_err() {
                break;
            }
        }
        (self.trace.clone(), packets, now)
    }
}

/// What a link says of a packet, as the row of its log. Without access lines the only copy is that of the link, whose number in a network is 2.
fn seen<A>(event: &PacketEvent<Parcel<A>, Path>) -> Seen {
    let record = PacketRecord { copy: event.copy >> 1, ..event.record };
    PacketEvent { record, payload: event.payload.bytes.clone(), damage: event.damage.clone() }
}
