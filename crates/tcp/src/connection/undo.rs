//! Undo of a reaction to supposed losses. Two signs show that nothing was lost: the peer reports each repeated segment as a duplicate, or
//! the peer's answer echoes a timestamp from before the first segment was sent again (RFC 3522, 3708, 4015).

use super::Connection;
use super::acknowledge::Ack;
use crate::info::CaState;
use crate::sequence::Position;

impl Connection {
    /// Begins to count repeated segments, so that the coming reduction can be taken back.
    pub(super) fn begin_undo(&mut self) {
        if !self.send.board.has_sent_again() {
            self.recovery.again_at = None;
        }
        self.recovery.undo_from = Some(self.send.una);
        // Repeated segments already on the way count from the beginning, and so does a tail probe with the last segment.
        let again = self.send.board.again_out + u32::from(self.tail.end.is_some() && self.tail.is_again);
        self.recovery.undo_left = (again > 0).then_some(again);
    }

    /// Notes that the peer has received the positions from `start` to `end` (exclusive) twice. Returns whether the duplicate may be a tail probe, or `None` if
    /// the report does not count: the range is impossible, or more duplicates were reported than segments were sent again, so that the network has copied.
    pub(super) fn note_duplicate(&mut self, start: Position, end: Position) -> Option<bool> {
        let length = end.checked_sub(start).filter(|length| (1..=self.send.max_window).contains(length))?;
        // One report may cover several segments.
        let segments = length.div_ceil(self.send.mss as u64);
        let is_probe = segments == 1 && self.tail.end == Some(end);
        self.counters.duplicates += segments;
        if self.counters.duplicates > self.counters.retransmissions {
            return None;
        }
        // A needless probe was sent by its timer, and tells nothing about the patience with late segments. Nor does any duplicate on a path that has never
        // reordered.
        self.rack.saw_duplicate |= self.rack.has_reordering && !is_probe;
        // A duplicate from before the phase says nothing about the phase.
        if self.recovery.undo_from.is_some_and(|from| end > from) {
            let left = &mut self.recovery.undo_left;
            *left = left.map(|left| left.saturating_sub(u32::try_from(segments).unwrap_or(u32::MAX)));
        }
        Some(is_probe)
    }

    /// Returns whether the timestamp echoed by `ack` is older than the first repetition of a segment, so that the original transmission was answered.
    fn is_older(&self, ack: &Ack) -> bool {
        let (Some(at), Some(echo)) = (self.recovery.again_at, ack.echo) else { return false };
        // The difference wraps. An echo of the same tick does not tell the two transmissions apart.
        (1..1 << 31).contains(&Self::ticks(at).wrapping_sub(echo))
    }

    /// Returns whether either sign shows that nothing was lost.
    fn may_undo(&self, ack: &Ack) -> bool {
        self.recovery.undo_from.is_some() && (self.recovery.undo_left == Some(0) || self.is_older(ack))
    }

    /// Takes the reduction back: restores the window and the threshold. With `nothing_is_lost`, also removes the marks of lost segments.
    fn undo(&mut self, nothing_is_lost: bool) {
        if nothing_is_lost {
            self.send.board.unmark_lost();
        }
        if let Some(threshold) = self.recovery.prior_threshold {
            // Window and threshold may have grown since. The undo never shrinks either value.
            self.congestion.window = self.congestion.window.max(self.recovery.prior_window);
            if threshold > self.congestion.threshold {
                self.congestion.threshold = threshold;
                self.send.tells_reduction = false;
            }
        }
        self.recovery.undo_from = None;
        self.counters.undone += 1;
    }

    /// Takes recovery back after a partial acknowledgement that answers the original transmission. Returns whether the phase continues and this acknowledgement
    /// needs no further reaction.
    pub(super) fn undo_in_recovery(&mut self, ack: &Ack) -> bool {
        if self.recovery.undo_from.is_none() || !self.is_older(ack) {
            return false;
        }
        if self.send.board.again_out > 0 {
            // Repeated segments are still on the way and may fill a gap, so the decision waits for their acknowledgement.
            return true;
        }
        if !self.send.board.has_sent_again() {
            self.recovery.again_at = None;
        }
        self.undo(true);
        self.recovery.phase = CaState::Disorder;
        self.stay_open(ack);
        false
    }

    /// Takes the reduction back if the peer has reported every repeated segment as a duplicate. Returns whether the reduction was taken back.
    pub(super) fn undo_by_duplicates(&mut self) -> bool {
        let may = self.recovery.undo_from.is_some() && self.recovery.undo_left == Some(0);
        if may {
            self.undo(false);
            if self.recovery.phase == CaState::Recovery {
                self.recovery.phase = CaState::Disorder;
            }
        }
        may
    }

    /// Takes the reduction back, if a sign allows it, when all data sent before the phase is acknowledged. Returns whether the phase is held until a later
    /// position is acknowledged.
    pub(super) fn undo_at_end(&mut self, ack: &Ack) -> bool {
        if self.may_undo(ack) {
            self.undo(false);
        } else {
            self.rack.persists = self.rack.persists.saturating_sub(1);
        }
        if self.send.una == self.recovery.high && !self.receive.has_sack {
            // Needlessly repeated segments cause duplicates, and these duplicates must not begin another recovery (RFC 6582, section 4).
            if !self.send.board.has_sent_again() {
                self.recovery.again_at = None;
            }
            return true;
        }
        if self.recovery.phase == CaState::Loss {
            self.recovery.phase = CaState::Open;
        }
        false
    }

    /// Handles an acknowledgement in the phase Loss: takes a false timeout back, or ends the phase when all data sent before the timeout is acknowledged.
    pub(super) fn go_on_after_timeout(&mut self, ack: &Ack) {
        if ack.has_advanced && self.may_undo(ack) {
            self.undo(true);
            self.counters.retries = 0;
            if self.receive.has_sack {
                self.recovery.phase = CaState::Open;
            }
            return;
        }
        if self.send.una >= self.recovery.high {
            self.undo_at_end(ack);
            return;
        }
        // The counted duplicates stood for segments below the acknowledged position.
        if !self.receive.has_sack && ack.has_advanced {
            self.send.board.sacked_out = 0;
        }
    }
}
