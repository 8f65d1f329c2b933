//! What a link has counted ahead of its driver.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;

/// Packets dropped, each for a cause, or marked, at instants that the driver of their link had not come to when the link decided about them.
#[derive(Clone, Debug, Default)]
pub(super) struct Ahead(Vec<(Instant, Option<DropCause>)>);

impl Ahead {
    /// A packet is dropped for that cause, or marked, at `at`, as a link knows at `now`.
    pub(super) fn note(&mut self, (now, at): (Instant, Instant), dropped: Option<DropCause>) {
        if at > now {
            // What the driver has come to counts for ever, so that there is never more here than between two packets.
            self.0.retain(|(earlier, _)| *earlier > now);
            self.0.push((at, dropped));
        }
    }

    /// What happened after an instant: the cause of each drop, or `None` for a mark.
    pub(super) fn after(&mut self, stop: Instant) -> impl Iterator<Item = Option<DropCause>> {
        self.0.drain(..).filter(move |(at, _)| *at > stop).map(|(_, dropped)| dropped)
    }
}
