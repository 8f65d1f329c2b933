//! Record of a run, for tests.

use std::collections::BTreeSet;

use cohaptic_units::Instant;
use cohaptic_wan::{FateLog, FateLogError, PacketRecord, Path};

use crate::seed::Seed;
use crate::trace::Trace;
use crate::wire::{HitCount, Recorded, Seen};

/// Record of a run: the trace, and the fate of every packet on its link.
///
/// Packets under way at the end of the run are followed to their end, as if nothing more had been sent. The fates contain these ends; the trace ends with the
/// run.
#[derive(Clone, Debug)]
pub struct Record {
    seed: Seed,
    recorded: Recorded,
}

impl Record {
    pub(crate) const fn new(seed: Seed, recorded: Recorded) -> Self {
        Self { seed, recorded }
    }

    /// Returns the counts of each law.
    pub(crate) fn hits(&self) -> &[HitCount] {
        &self.recorded.hits
    }

    /// Returns the events of the run, in their order.
    #[must_use]
    pub const fn trace(&self) -> &Trace {
        &self.recorded.trace
    }

    /// Returns the instant at which the run ended.
    #[must_use]
    pub const fn ended(&self) -> Instant {
        self.recorded.ended
    }

    pub(crate) const fn seed(&self) -> &Seed {
        &self.seed
    }

    /// Returns the fates of the packets from a host to another host on their link, in the form for [`LinkModel::Replay`](cohaptic_wan::LinkModel::Replay). With
    /// access lines (`Testbed::access`) a fate covers the whole path, from uplink to downlink. A packet delivered by its link to a host that was down, or over
    /// a path that was cut, counts as delivered here; the trace has the end of the packet.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    #[must_use]
    pub fn fates(&self, from: &str, to: &str) -> FateLog {
        self.fates_of(self.recorded.trace.names().path(from, to))
    }

    /// Returns every path with a packet on its link.
    pub(crate) fn paths(&self) -> Vec<Path> {
        let paths: BTreeSet<Path> = self.recorded.packets.iter().map(|seen| seen.path).collect();
        paths.into_iter().collect()
    }

    /// Returns a line of words for each link of the test, and for the access lines of each host.
    pub(crate) fn network(&self) -> Vec<String> {
        self.recorded.said.lines(self.recorded.trace.hosts())
    }

    /// Returns the line of a link file for each NAT and firewall, and for the interfaces of each host.
    pub(crate) fn devices(&self) -> impl Iterator<Item = &str> {
        self.recorded.said.devices().map(|(line, _)| line)
    }

    /// Returns the names of the hosts. NATs, firewalls and interfaces have further names in the trace.
    pub(crate) fn hosts(&self) -> &[String] {
        let names = self.recorded.trace.hosts();
        &names[..names.len() - self.recorded.devices]
    }

    pub(crate) fn packets_of(&self, path: Path) -> impl Iterator<Item = &Seen> {
        self.recorded.packets.iter().filter(move |seen| seen.path == path)
    }

    /// Returns the fates of the packets of a path.
    pub(crate) fn fates_of(&self, path: Path) -> FateLog {
        complete(self.packets_of(path).map(|seen| seen.without_path()).collect())
    }
}

/// Returns the log of all packets before the first packet without a known end. Only a link that never releases a packet causes such a packet.
fn complete(mut records: Vec<PacketRecord>) -> FateLog {
    loop {
        match FateLog::new(records.iter().copied()) {
            Ok(log) => return log,
            // The log is cut before the packet, and tried again: an earlier packet may lack its end too.
            Err(FateLogError::Missing { sequence, .. } | FateLogError::NoEnd { sequence, .. }) => records.retain(|record| record.sequence < sequence),
            // The other errors do not occur in records of a link.
            Err(_) => return FateLog::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_units::Bytes;
    use cohaptic_wan::Fate;

    use super::*;

    #[test]
    fn a_log_ends_before_the_first_packet_without_an_end() {
        let record = |sequence, fate| PacketRecord {
            path: (),
            sequence,
            copy: 0,
            offered: Instant::ZERO,
            at: Instant::ZERO,
            size: Bytes::new(1),
            fate,
            marked: false,
            damaged: false,
        };
        let arrived = Fate::Delivered(Instant::ZERO);
        assert_eq!(complete(vec![record(0, arrived), record(1, arrived), record(3, arrived)]).packets(), 2);
        assert_eq!(complete(vec![record(0, arrived), record(1, Fate::Duplicated), record(1, arrived), record(2, arrived)]).packets(), 1);
        assert_eq!(complete(Vec::new()).packets(), 0);
    }
}
