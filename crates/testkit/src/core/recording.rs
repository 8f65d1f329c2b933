//! What is recorded of a run.

use bytes::Bytes;
use cohaptic_units::Instant;
use cohaptic_wan::PacketRecord;

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

/// What became of a packet on its link.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) record: PacketRecord,
    pub(crate) payload: Bytes,
}

impl Recording {
    pub(super) const fn new(hosts: Vec<String>, settings: &Settings) -> Self {
        Self { trace: Trace::new(hosts), packets: Vec::new(), traces: settings.traces, keeps_packets: settings.keeps_packets }
    }

    #[inline]
    pub(crate) fn note(&mut self, at: Instant, what: Happening) {
        if self.traces {
            self.trace.push(at, what);
        }
    }

    #[inline]
    pub(super) fn keep(&mut self, seen: impl FnOnce() -> Seen) {
        if self.keeps_packets {
            self.packets.push(seen());
        }
    }

    /// What happened so far.
    pub(crate) const fn trace(&self) -> &Trace {
        &self.trace
    }

    /// What was recorded.
    pub(crate) fn take(&mut self) -> (Trace, Vec<Seen>) {
        let hosts = self.trace.hosts().to_vec();
        (std::mem::replace(&mut self.trace, Trace::new(hosts)), std::mem::take(&mut self.packets))
    }
}
