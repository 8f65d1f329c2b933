//! Result of one acknowledgement.

use core::time::Duration;

use cohaptic_units::Instant;

use super::{Sent, SentAt};
use crate::sequence::Position;

/// Result of one acknowledgement: which segments have arrived.
#[derive(Clone, Default, Debug)]
pub(crate) struct News {
    /// Number of segments acknowledged, sacked before or not.
    pub(crate) acked: u32,
    /// Number of segments newly known to have arrived, by a block or by the acknowledgement number.
    pub(crate) delivered: u32,
    /// `true` if a segment became sacked.
    pub(crate) has_sacked: bool,
    /// `true` if a segment that was sent again, and not sacked before, was acknowledged, so that a round trip is ambiguous (Karn's rule).
    pub(crate) has_acked_again: bool,
    /// Instant at which the first acknowledged segment that was neither sacked before nor ever sent again was sent.
    pub(crate) first_acked: Option<Instant>,
    /// Instant at which the last acknowledged segment that was neither sacked before nor ever sent again was sent.
    pub(crate) last_acked: Option<Instant>,
    /// Instant at which the first newly sacked segment that was never sent again was sent.
    pub(crate) first_sacked: Option<Instant>,
    /// Instant at which the last newly sacked segment that was never sent again was sent.
    pub(crate) last_sacked: Option<Instant>,
    /// Latest transmission among the segments that arrived, and whether its segment was ever sent again.
    pub(crate) latest: Option<(SentAt, bool)>,
    /// Start of the first segment that arrived after a later segment, although the first was never sent again.
    pub(crate) reordered: Option<Position>,
}

impl News {
    /// Notes a reordering if the segment at `start` lies below an earlier sacked segment.
    pub(super) fn note_order(&mut self, start: Position, highest_sacked: Position) {
        if start < highest_sacked {
            self.reordered = Some(self.reordered.map_or(start, |other| other.min(start)));
        }
    }

    /// Compares the last transmission of `sent`, a segment that has arrived, with `latest`, and keeps the later transmission.
    pub(super) fn hear(&mut self, sent: &Sent) {
        let sent_at = (sent.at, sent.order);
        if self.latest.is_none_or(|(latest, _)| sent_at > latest) {
            self.latest = Some((sent_at, sent.ever_again));
        }
    }

    /// Returns the round trip: the time since `first_acked`, or, if acknowledged segments are missing or ambiguous, the time since `first_sacked`. Returns
    /// `None` without both instants.
    pub(crate) fn round_trip(&self, now: Instant) -> Option<Duration> {
        let acked = self.first_acked.filter(|_| !self.has_acked_again);
        Some(now.saturating_duration_since(acked.or(self.first_sacked)?))
    }

    /// Returns the round trip of the segment sent last among those of [`round_trip`](Self::round_trip).
    pub(crate) fn latest_round_trip(&self, now: Instant) -> Option<Duration> {
        let acked = self.last_acked.filter(|_| !self.has_acked_again);
        Some(now.saturating_duration_since(acked.or(self.last_sacked)?))
    }
}
