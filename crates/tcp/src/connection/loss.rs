//! Detection of losses by time (RFC 8985), by count (RFC 6675), by duplicates (RFC 6582) or by the retransmission timer (RFC 6298).

use core::time::Duration;

use cohaptic_units::Instant;

use super::acknowledge::{Ack, DUPLICATES};
use super::{Connection, Timer};
use crate::info::CaState;
use crate::sequence::Position;

/// Number of recoveries during which a larger reordering window is kept (RFC 8985, section 6.2).
const PERSISTS: u32 = 16;

impl Connection {
    /// Notes a reordering: a segment from `start` on, sent once, has arrived after a segment up to `end`.
    pub(super) fn note_reordering(&mut self, start: Position, end: Position) {
        self.rack.has_reordering = true;
        let degree = end.saturating_sub(start).div_ceil(self.send.mss as u64);
        self.rack.degree = self.rack.degree.max(u32::try_from(degree).unwrap_or(u32::MAX));
    }

    /// Notes the latest transmission that has arrived, and its round trip (RFC 8985, section 6.2, step 2).
    fn advance_rack(&mut self, now: Instant, ack: &Ack) {
        let Some((sent_at, was_again)) = ack.news.latest else { return };
        let round_trip = now.saturating_duration_since(sent_at.0);
        // If the answer to a repeated segment comes sooner than any round trip, the answer belongs to an earlier transmission.
        if was_again && self.round_trips.least().is_some_and(|least| round_trip < least) {
            return;
        }
        self.rack.rtt = round_trip;
        self.rack.delivered = self.rack.delivered.max(Some(sent_at));
    }

    /// Returns the time by which a segment may be late before it counts as lost (RFC 8985, section 6.2, step 4).
    fn reordering_window(&self) -> Duration {
        // On a path without reordering so far, waiting during recovery, or after three segments out of order, would only delay the repair.
        if !self.rack.has_reordering && (self.recovery.phase >= CaState::Recovery || self.send.board.sacked_out >= DUPLICATES) {
            return Duration::ZERO;
        }
        let least = self.round_trips.least().unwrap_or_default();
        (least / 4 * self.rack.quarters.max(1)).min(self.round_trips.srtt().unwrap_or_default())
    }

    /// Enlarges the reordering window once per round trip in which a duplicate was reported, because a duplicate means a loss declared too early.
    pub(super) fn adapt_patience(&mut self, ack: &Ack) {
        if self.rack.saw_duplicate && self.send.una >= self.rack.grown_at {
            self.rack.quarters = (self.rack.quarters.max(1) + 1).min(255);
            self.rack.persists = PERSISTS;
            self.rack.grown_at = self.send.next;
        } else if self.rack.persists == 0 && ack.has_advanced {
            self.rack.quarters = 1;
        }
        self.rack.saw_duplicate = false;
    }

    /// Marks lost segments after the acknowledgement `ack`. Returns whether the timer was set for segments that may only be late.
    pub(super) fn find_losses(&mut self, now: Instant, ack: &Ack) -> bool {
        if self.send.board.is_empty() {
            return false;
        }
        if !self.receive.has_sack {
            // NewReno: three duplicates tell of the loss of the first segment. In recovery, a partial acknowledgement tells that the next segment is lost too.
            let is_told = self.recovery.phase < CaState::Recovery && self.send.board.sacked_out >= DUPLICATES;
            if is_told || (self.recovery.phase == CaState::Recovery && ack.has_advanced) {
                self.send.board.mark_first_lost();
            }
            return false;
        }
        if !self.config.rack {
            self.send.board.detect_by_count(DUPLICATES);
            return false;
        }
        self.advance_rack(now, ack);
        self.detect_by_time(now)
    }

    /// Marks segments that are lost by time, and sets the reordering timer for segments that may only be late. Returns whether the timer was set.
    fn detect_by_time(&mut self, now: Instant) -> bool {
        let Some(delivered) = self.rack.delivered else { return false };
        let patience = self.rack.rtt.saturating_add(self.reordering_window());
        let Some(at) = self.send.board.detect_by_time(now, delivered, patience) else { return false };
        self.timer = Some((at.max(now), Timer::Reordering));
        true
    }

    /// Handles the end of the reordering timer: the late segments are lost.
    pub(super) fn reordering_is_over(&mut self, now: Instant) {
        let before = self.send.board.lost_out;
        self.timer = None;
        let waits = self.detect_by_time(now);
        if self.send.board.lost_out > before && self.recovery.phase < CaState::Recovery {
            self.enter_recovery(false);
            // No acknowledgement has arrived. One segment counts as delivered, because otherwise the window would not be computed and nothing could leave.
            self.reduce_window(1, false, true);
        }
        if !waits {
            self.set_retransmission_timer(now, true);
        }
    }

    /// Handles the end of the retransmission timer (RFC 5681, section 3.1, and RFC 6298, section 5).
    pub(super) fn enter_loss(&mut self, now: Instant) {
        // The threshold is reduced once per loss event. Another timeout of the same event must not reduce the threshold again.
        let is_first = self.recovery.phase <= CaState::Disorder
            || self.send.una >= self.recovery.high
            || (self.recovery.phase == CaState::Loss && self.counters.retries == 0);
        let patience = self.rack.rtt.saturating_add(self.reordering_window());
        let has_sack = self.receive.has_sack;
        self.send.board.mark_all_lost(now, (has_sack && self.config.rack && self.rack.delivered.is_some()).then_some(patience), has_sack);
        if is_first {
            self.recovery.prior_threshold = Some(self.current_threshold());
            self.recovery.prior_window = self.congestion.window;
            self.congestion.threshold = self.congestion.reduced();
            self.begin_undo();
        }
        self.congestion.restart(self.send.board.in_flight() + 1);
        self.recovery.phase = CaState::Loss;
        self.recovery.high = self.send.next;
        self.tail.end = None;
        self.send.tells_reduction = self.send.has_ecn;
        self.counters.timeouts += 1;
    }

    /// Decides whether the tail loss probe has repaired a loss, which reduces the window (RFC 8985, section 7.4).
    pub(super) fn end_tail_probe(&mut self, ack: &Ack) {
        let Some(end) = self.tail.end.filter(|end| ack.position >= *end) else { return };
        // A probe with new data repairs nothing. After a reported duplicate, the last segment and the probe have both arrived.
        if !self.tail.is_again || ack.answers_probe {
            self.tail.end = None;
        } else if ack.position > end {
            // Later data is acknowledged and no duplicate was reported: the last segment was lost, and the probe has replaced it.
            self.tail.end = None;
            self.enter_reduced();
            if self.recovery.phase == CaState::Cwr {
                self.end_reduction_at_once(ack);
            }
        } else if ack.is_duplicate {
            // A duplicate acknowledgement at `end` answers the probe: the last segment had arrived before.
            self.tail.end = None;
        }
    }
}
