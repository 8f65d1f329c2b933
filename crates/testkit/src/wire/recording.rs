//! Record of a run.

use std::sync::Arc;

use bytes::Bytes;
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Network, PacketEvent, Path};

use super::exits::{Exits, Out};
use super::{Form, HasFlow, HitCount, Parcel, Settings};
use crate::again::{Drawn, Said};
use crate::names::Names;
use crate::trace::{Happening, Trace};

/// Record of a run: the trace and the packets, each only if asked for.
#[derive(Debug)]
pub(crate) struct Recording {
    trace: Trace,
    packets: Vec<Seen>,
    /// `true` if happenings are recorded.
    pub(crate) traces: bool,
    /// `true` if the trace holds digests of the contents of packets.
    pub(super) digests: bool,
    keeps_packets: bool,
}

/// Fate of a packet on its link, with the content of the packet and the form of the content.
pub(crate) type Seen = PacketEvent<(Bytes, Form), Path>;

/// Copy of the record of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorded {
    pub(crate) trace: Trace,
    pub(crate) packets: Vec<Seen>,
    /// Instant of the end of the run.
    pub(crate) ended: Instant,
    /// Reports of the laws.
    pub(crate) hits: Vec<HitCount>,
    pub(crate) drawn: Drawn,
    /// Description of the network as the test gave it.
    pub(crate) said: Arc<Said>,
    /// Number of names that are no hosts.
    pub(crate) devices: usize,
}

/// Bound for following packets to their ends: after this many events of the network a packet is taken to be stuck.
const MOST_EVENTS: u32 = 10_000_000;

impl Recording {
    pub(super) const fn new(hosts: Arc<Names>, settings: &Settings) -> Self {
        let Settings { traces, digests, keeps_packets, .. } = *settings;
        Self { trace: Trace::new(hosts), packets: Vec::new(), traces, digests, keeps_packets }
    }

    /// Returns whether anything is recorded.
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
    pub(super) fn keep<A: HasFlow>(&mut self, event: &Out<A>) {
        if self.keeps_packets {
            self.packets.push(seen(event));
        }
    }

    /// Returns the trace so far.
    pub(crate) const fn trace(&self) -> &Trace {
        &self.trace
    }

    /// Returns the recorded packets. Appends the ends of the packets that are still in `network` or in `exits`, from `now` on.
    pub(super) fn followed_through<A: HasFlow + Clone>(&self, network: &Network<Box<Parcel<A>>>, mut exits: Exits<A>, mut now: Instant) -> Vec<Seen> {
        let mut packets = self.packets.clone();
        if !self.keeps_packets {
            return packets;
        }
        // The clone runs on alone: nothing more is sent, and the network of the run stays at the present instant.
        let mut network = network.clone();
        for _ in 0..MOST_EVENTS {
            while let Some(out) = exits.poll_with(&mut network, now) {
                if let Fate::Delivered(at) = out.fate {
                    exits.arrived(out.path, at);
                }
                packets.push(seen(&out));
            }
            // Packets kept by laws have no event in the network, so both are asked for the next instant.
            let Some(next) = [network.poll_timeout(), exits.next()].into_iter().flatten().min() else { break };
            now = next;
            if network.handle_timeout(next).is_err() {
                break;
            }
        }
        // Without further sends the packets that wait for more arrivals never arrive, so the log reports each of them as dropped.
        packets.extend(exits.abandon(now).map(|out| seen(&out)));
        packets
    }
}

/// Converts an event of a link to a row of the packet log.
fn seen<A: HasFlow>(out: &Out<A>) -> Seen {
    let payload = (out.payload.bytes.clone().into(), out.payload.addresses.form());
    PacketEvent { record: out.record, payload, damage: out.damage.clone(), part: out.part }
}
