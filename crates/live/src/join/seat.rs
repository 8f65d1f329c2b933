//! Seat of a joined peer: tells from the answers of the session whether another program has the seat.

use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::Span;

/// Time after a notice in which the seat counts as taken. Longer than the time between two samples, so that one lost notice changes nothing.
const NOTICE_COUNTS: Duration = Duration::from_secs(1);
/// Time beyond the silence of a vanished holder until the peer gives up.
const MARGIN: Duration = Duration::from_secs(1);

/// Error: another program has the seat of this peer, and keeps the seat.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("the seat of {name} is taken: for {} the session has refused the samples from here, because another program has the seat", Span(*patience))]
pub struct SeatTaken {
    /// Index of the peer in the scene.
    pub place: usize,
    /// Name of the peer in the scene.
    pub name: String,
    /// Time for which the session has refused the samples of this peer.
    pub patience: Duration,
}

/// Notices of the session that another program has the seat.
///
/// A holder that was killed keeps its seat until the session counts the holder as silent. So the peer waits for this silence and a second more: after a loss of
/// power a program that is started again takes its own seat back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Notices {
    /// Time of notices after which the peer gives up.
    patience: Duration,
    /// Instants of the first and of the latest notice in a row; `None` without a notice since the session took a sample of this peer.
    heard: Option<(Instant, Instant)>,
}

impl Notices {
    /// Returns the state before the first notice. `stale_after`: silence after which the session gives the seat of a program to another.
    pub(super) const fn new(stale_after: Duration) -> Self {
        Self { patience: stale_after.saturating_add(MARGIN), heard: None }
    }

    pub(super) const fn patience(&self) -> Duration {
        self.patience
    }

    /// Notes a notice.
    pub(super) fn hear(&mut self, at: Instant) {
        let first = if self.is_taken(at) { self.heard.map_or(at, |(first, _)| first) } else { at };
        self.heard = Some((first, at));
    }

    /// Notes a sample of another peer. A session sends samples to the holder of a seat alone, so that this peer is the holder.
    pub(super) const fn end(&mut self) {
        self.heard = None;
    }

    /// Returns whether the seat counts as taken at `now`.
    pub(super) fn is_taken(&self, now: Instant) -> bool {
        self.heard.is_some_and(|(_, latest)| now < latest.saturating_add(NOTICE_COUNTS))
    }

    /// Returns whether the notices have gone on for so long that no vanished program is the holder.
    pub(super) fn is_for_good(&self) -> bool {
        self.heard.is_some_and(|(first, latest)| latest >= first.saturating_add(self.patience))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    #[test]
    fn notices_in_a_row_last_longer_than_the_silence_of_a_vanished_program() {
        let mut notices = Notices::new(Duration::from_secs(2));
        for millis in (100..3100).step_by(100) {
            notices.hear(at(millis));
            assert!(notices.is_taken(at(millis + 999)) && !notices.is_for_good(), "{millis}");
        }
        notices.hear(at(3100));
        assert!(notices.is_for_good());
        assert!(!notices.is_taken(at(4100)));
    }

    #[test]
    fn a_pause_or_a_sample_of_another_peer_begins_a_new_row() {
        let mut notices = Notices::new(Duration::ZERO);
        notices.hear(at(0));
        notices.hear(at(1000));
        assert!(!notices.is_for_good(), "the session was away in between");
        notices.hear(at(1999));
        assert!(!notices.is_for_good());
        notices.end();
        assert!(!notices.is_taken(at(1999)));
        notices.hear(at(2000));
        assert!(notices.is_taken(at(2000)) && !notices.is_for_good());
    }
}
