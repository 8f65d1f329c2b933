//! What is recorded of a run.

use bytes::Bytes;
use cohaptic_units::Instant;
use cohaptic_wan::{Network, PacketEvent, PacketRecord, Path};

use super::Settings;
use crate::trace::{Happening, Trace};

/// What is recorded of a run, as far as it is asked for.
#[derive(Debug)]
pub(crate) struct Recording {
    trace: Trace,
    packets: Vec<Seen>,
    pub(super) traces: bool,
    pub(super) keeps_packets: bool,
}

/// What became of a packet on its link, with what it carried.
pub(crate) type Seen = PacketEvent<Bytes, Path>;

impl Recording {
    pub(crate) const fn new(hosts: Vec<String>, settings: &Settings) -> Self {
        Self { trace: Trace::new(hosts), packets: Vec::new(), traces: settings.traces, keeps_packets: settings.keeps_packets }
    }

    #[inline]
    pub(crate) fn note(&mut self, at: Instant, what: Happening) {
        if self.traces {
            self.trace.push(at, what);
        }
    }

    #[inline]
    pub(crate) fn keep(&mut self, seen: impl FnOnce() -> Seen) {
        if self.keeps_packets {
            self.packets.push(seen());
        }
    }

    /// What happened so far.
    pub(crate) const fn trace(&self) -> &Trace {
        &self.trace
    }

    /// What has been recorded so far.
    pub(crate) fn so_far(&self) -> (Trace, Vec<Seen>) {
        (self.trace.clone(), self.packets.clone())
    }

    /// What was recorded.
    pub(crate) fn take(&mut self) -> (Trace, Vec<Seen>) {
        let hosts = self.trace.hosts().to_vec();
        (std::mem::replace(&mut self.trace, Trace::new(hosts)), std::mem::take(&mut self.packets))
    }
}

/// What a link says of a packet, as the row of its log. Without access lines the only copy is that of the link, whose number in a network is 2.
pub(crate) fn seen<P>(event: &PacketEvent<P, Path>, payload: Bytes) -> Seen {
    PacketEvent { record: PacketRecord { copy: event.copy >> 1, ..event.record }, payload, damage: event.damage.clone() }
}

/// No link holds a packet for longer than this many of its events.
const MOST_EVENTS: u32 = 10_000_000;

/// Follows the packets that are in a network until they have arrived or are lost, as long as nothing more is sent.
pub(crate) fn follow_to_the_end<P: Clone>(network: &mut Network<P>, mut keep: impl FnMut(&PacketEvent<P, Path>)) {
    for _ in 0..MOST_EVENTS {
        while let Some(event) = network.poll_event() {
            keep(&event);
        }
        let Some(next) = network.poll_timeout() else { return };
        if network.handle_timeout(next).is_err() {
            return;
        }
    }
}
