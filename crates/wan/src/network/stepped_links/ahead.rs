//! Drops and marks counted by a link before its driver reached their instants.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;

/// Drops (`Some` cause) and marks (`None`), each with its instant. The instant lies after the latest instant of the link's driver at the decision.
#[derive(Clone, Debug, Default)]
pub(super) struct Ahead(Vec<(Instant, Option<DropCause>)>);

impl Ahead {
    /// Notes a drop for cause `dropped`, or a mark if `dropped` is `None`, at `at`. The driver has reached `now`.
    pub(super) fn note(&mut self, (now, at): (Instant, Instant), dropped: Option<DropCause>) {
        if at > now {
            // Events up to `now` stay counted for ever, so such events are forgotten here. The list then never holds more than the events between two packets.
            self.0.retain(|(earlier, _)| *earlier > now);
            self.0.push((at, dropped));
        }
    }

    /// Removes all entries, and returns the entries after `stop`: the cause of each drop, or `None` for a mark.
    pub(super) fn after(&mut self, stop: Instant) -> impl Iterator<Item = Option<DropCause>> {
        self.0.drain(..).filter(move |(at, _)| *at > stop).map(|(_, dropped)| dropped)
    }
}
