//! Taking back a reaction to losses that were none: duplicates were reported, or the answer is older than what was sent again (RFC 3522, 3708, 4015).

use super::Connection;
use super::acknowledge::Ack;
use super::parts::Phase;
use crate::sequence::Position;

impl Connection {
    /// From here on, segments that are sent again are counted.
    pub(super) fn begin_undo(&mut self) {
        if !self.send.board.has_sent_again() {
            self.recovery.again_at = None;
        }
        self.recovery.undo_from = Some(self.send.una);
        let again = self.send.board.again_out + u32::from(self.tail.end.is_some() && self.tail.is_again);
        self.recovery.undo_left = (again > 0).then_some(again);
    }

    /// The peer had received this already.
    pub(super) fn note_duplicate(&mut self, start: Position, end: Position) {
        self.rack.saw_duplicate = true;
        let Some(from) = self.recovery.undo_from else { return };
        if end > from && start < end {
            let segments = (end - start).div_ceil(self.send.mss as u64);
            let left = &mut self.recovery.undo_left;
            *left = left.map(|left| left.saturating_sub(u32::try_from(segments).unwrap_or(u32::MAX)));
        }
    }

    /// Whether the answer was sent before anything was sent again.
    fn is_older(&self, ack: &Ack) -> bool {
        let (Some(at), Some(echo)) = (self.recovery.again_at, ack.echo) else { return false };
        (1..1 << 31).contains(&Self::ticks(at).wrapping_sub(echo))
    }

    fn may_undo(&self, ack: &Ack) -> bool {
        self.recovery.undo_from.is_some() && (self.recovery.undo_left == Some(0) || self.is_older(ack))
    }

    fn undo(&mut self, nothing_is_lost: bool) {
        if nothing_is_lost {
            self.send.board.unmark_lost();
        }
        if let Some(threshold) = self.recovery.prior_threshold {
            self.congestion.window = self.congestion.window.max(self.recovery.prior_window);
            if threshold > self.congestion.threshold {
                self.congestion.threshold = threshold;
                self.send.tells_reduction = false;
            }
        }
        self.recovery.undo_from = None;
        self.counters.undone += 1;
    }

    /// Part of what was sent when recovery began is acknowledged. Whether the phase goes on without anything else to be done.
    pub(super) fn undo_in_recovery(&mut self, ack: &Ack) -> bool {
        if self.recovery.undo_from.is_none() || !self.is_older(ack) {
            return false;
        }
        if self.send.board.again_out > 0 {
            // What was sent again may fill a gap: wait.
            return true;
        }
        if !self.send.board.has_sent_again() {
            self.recovery.again_at = None;
        }
        self.undo(true);
        self.recovery.phase = Phase::Disorder;
        self.stay_open(ack);
        false
    }

    /// All that was sent again was a duplicate.
    pub(super) fn undo_by_duplicates(&mut self) -> bool {
        let may = self.recovery.undo_from.is_some() && self.recovery.undo_left == Some(0);
        if may {
            self.undo(false);
            if self.recovery.phase == Phase::Recovery {
                self.recovery.phase = Phase::Disorder;
            }
        }
        may
    }

    /// All that was sent when the phase began is acknowledged. Whether it is held until something above is.
    pub(super) fn undo_at_end(&mut self, ack: &Ack) -> bool {
        if self.may_undo(ack) {
            self.undo(false);
        } else {
            self.rack.persists = self.rack.persists.saturating_sub(1);
        }
        if self.send.una == self.recovery.high && !self.receive.has_sack {
            // Duplicates of what was sent again must not begin recovery anew (RFC 6582, section 4).
            if !self.send.board.has_sent_again() {
                self.recovery.again_at = None;
            }
            return true;
        }
        if self.recovery.phase == Phase::Loss {
            self.recovery.phase = Phase::Open;
        }
        false
    }

    /// After a timeout: whether it was a false one, and whether all is acknowledged.
    pub(super) fn go_on_after_timeout(&mut self, ack: &Ack) {
        if ack.has_advanced && self.may_undo(ack) {
            self.undo(true);
            self.counters.retries = 0;
            if self.receive.has_sack {
                self.recovery.phase = Phase::Open;
            }
            return;
        }
        if self.send.una >= self.recovery.high {
            self.undo_at_end(ack);
            return;
        }
        if !self.receive.has_sack && ack.has_advanced {
            self.send.board.sacked_out = 0;
        }
    }
}
