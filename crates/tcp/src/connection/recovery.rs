//! Phases of loss recovery (RFC 5681, 6582, 6675, 6937), as in Linux: which phase follows an acknowledgement, and when the window shrinks.

use cohaptic_units::Instant;

use super::Connection;
use super::acknowledge::Ack;
use crate::congestion::{Reduction, UNBOUNDED};
use crate::info::CaState;

impl Connection {
    /// Finds losses, changes the phase and sets the timer after the acknowledgement `ack`. `has_widened` says that the acknowledgement changed the peer's
    /// window, `has_data` means data, SYN or FIN in the same segment.
    pub(super) fn recover(&mut self, now: Instant, ack: &Ack, has_widened: bool, has_data: bool) {
        // Both calls come first, because the search for losses uses the reordering window, and a tail probe may change the phase.
        self.adapt_patience(ack);
        self.end_tail_probe(ack);
        let mut waits_for_reordering = false;
        // An acknowledgement with ordinary news in the phase Open needs no search for losses.
        let is_dubious = !(has_data || has_widened || ack.has_advanced) || ack.news.has_sacked || ack.tells_mark || ack.tells_duplicate;
        if is_dubious || self.recovery.phase != CaState::Open {
            waits_for_reordering = self.change_phase(now, ack);
        }
        // The sending half has one timer, and the reordering timer has priority.
        if ack.has_advanced && !waits_for_reordering {
            self.set_timer(now);
        }
    }

    /// Takes back false reactions, finds losses and changes the phase. Returns whether the timer was set for segments that may only be late.
    pub(super) fn change_phase(&mut self, now: Instant, ack: &Ack) -> bool {
        // A mark tells of congestion even if nothing was lost, so this reduction must stay.
        if ack.tells_mark {
            self.recovery.prior_threshold = None;
        }
        if self.recovery.phase == CaState::Open {
            if self.send.board.again_out == 0 {
                self.recovery.again_at = None;
            }
        } else if self.send.una >= self.recovery.high && self.end_phase(ack) {
            return false;
        }
        match self.recovery.phase {
            CaState::Recovery => {
                if !ack.has_advanced {
                    self.count_duplicate(ack);
                } else if self.undo_in_recovery(ack) {
                    return false;
                }
                // Losses are searched after the undo, because an undo may have ended the recovery and a new loss may begin another one.
                if self.undo_by_duplicates() {
                    self.stay_open(ack);
                }
                let waits = self.find_losses(now, ack);
                if self.recovery.phase != CaState::Recovery {
                    self.stay_open(ack);
                }
                waits
            }
            CaState::Loss => {
                self.go_on_after_timeout(ack);
                let waits = self.find_losses(now, ack);
                if self.recovery.phase == CaState::Open {
                    return self.enter_if_lost(ack, waits);
                }
                waits
            }
            CaState::Open | CaState::Disorder | CaState::Cwr => {
                self.count_duplicate(ack);
                // A reduction because of a mark is not taken back by duplicates.
                if self.recovery.phase != CaState::Cwr {
                    self.undo_by_duplicates();
                }
                let waits = self.find_losses(now, ack);
                self.enter_if_lost(ack, waits)
            }
        }
    }

    /// Enters recovery if a segment is lost, and chooses between Open and Disorder otherwise. Returns `waits`, so that callers can end with this
    /// call.
    fn enter_if_lost(&mut self, ack: &Ack, waits: bool) -> bool {
        if self.send.board.lost_out == 0 {
            self.stay_open(ack);
            return waits;
        }
        self.enter_recovery(ack.tells_mark);
        waits
    }

    /// Ends the phase, because all data sent before the phase is acknowledged. Returns whether this acknowledgement needs no further reaction.
    fn end_phase(&mut self, ack: &Ack) -> bool {
        match self.recovery.phase {
            CaState::Cwr => {
                // The phase ends when a later position is acknowledged as well, so each window of data has at most one reduction.
                if self.send.una != self.recovery.high {
                    self.end_reduction();
                    self.recovery.phase = CaState::Open;
                }
            }
            CaState::Recovery => {
                // The duplicates of this phase do not count for the next phase.
                if !self.receive.has_sack {
                    self.send.board.sacked_out = 0;
                }
                if self.undo_at_end(ack) {
                    return true;
                }
                self.end_reduction();
                self.recovery.phase = CaState::Open;
            }
            CaState::Open | CaState::Disorder | CaState::Loss => {}
        }
        false
    }

    /// Counts a duplicate acknowledgement as a segment that has arrived. Does nothing if the peer sends selective acknowledgements.
    fn count_duplicate(&mut self, ack: &Ack) {
        let board = &mut self.send.board;
        if self.receive.has_sack || !ack.is_duplicate {
            return;
        }
        // At least one segment is missing, because a duplicate tells of a gap.
        let most = board.packets_out().saturating_sub(board.lost_out.max(1));
        if board.sacked_out < most {
            board.sacked_out += 1;
            self.send.delivered += 1;
        }
    }

    /// Removes `acked` acknowledged segments from the count of duplicates. Called only if the peer sends no selective acknowledgements.
    pub(super) fn end_duplicates(&mut self, acked: u32) {
        let board = &mut self.send.board;
        // The first of the acknowledged segments filled the gap. Duplicates may have been counted for the remaining segments.
        if acked > 0 {
            self.send.delivered += u64::from(acked.saturating_sub(board.sacked_out).max(1));
            board.sacked_out = board.sacked_out.saturating_sub(acked - 1);
        }
        board.sacked_out = board.sacked_out.min(board.packets_out().saturating_sub(board.lost_out.max(1)));
        // Progress outside of recovery shows that the duplicates were only reordering.
        if self.recovery.phase < CaState::Recovery {
            board.sacked_out = 0;
        }
    }

    /// Reduces the window after a mark. Otherwise chooses Disorder if segments are sacked, lost or sent again, and Open if not.
    pub(super) fn stay_open(&mut self, ack: &Ack) {
        if !self.send.board.has_sent_again() {
            self.recovery.again_at = None;
        }
        if ack.tells_mark {
            self.answer_mark();
        }
        if self.recovery.phase == CaState::Cwr {
            return;
        }
        let board = &self.send.board;
        let is_amiss = board.sacked_out + board.lost_out > 0 || board.has_sent_again();
        let phase = if is_amiss { CaState::Disorder } else { CaState::Open };
        if self.recovery.phase != phase {
            (self.recovery.phase, self.recovery.high) = (phase, self.send.next);
        }
    }

    /// Begins a reduction: notes the present window, reduces the threshold, and starts the rate reduction.
    pub(super) fn begin_reduction(&mut self) {
        self.recovery.high = self.send.next;
        self.tail.end = None;
        self.recovery.prior_window = self.congestion.window;
        self.recovery.reduction = Reduction::new(self.congestion.window);
        self.congestion.threshold = self.congestion.reduced();
        self.send.tells_reduction = self.send.has_ecn;
    }

    /// Ends a reduction: sets the window to the threshold.
    fn end_reduction(&mut self) {
        // After an undo, the window has its old value again and must stay.
        let is_reduced = self.recovery.phase == CaState::Cwr || self.recovery.undo_from.is_some();
        if is_reduced && self.congestion.threshold < UNBOUNDED {
            self.congestion.window = self.congestion.threshold;
        }
    }

    /// Reduces the window although no segment is missing, because of a mark or of a loss repaired by a tail probe. Does nothing during another reduction.
    pub(super) fn enter_reduced(&mut self) {
        self.recovery.prior_threshold = None;
        if self.recovery.phase < CaState::Cwr {
            self.recovery.undo_from = None;
            self.begin_reduction();
            self.recovery.phase = CaState::Cwr;
        }
    }

    /// Reduces the window because of a mark. With a scalable congestion control the window shrinks by the share of marked segments, in no phase of its own, and
    /// goes on to grow with the unmarked ones.
    fn answer_mark(&mut self) {
        if !self.is_scalable() {
            self.enter_reduced();
        } else if self.recovery.phase < CaState::Cwr && self.congestion.shrink_by_share(self.send.una, self.send.next) {
            self.send.tells_reduction = true;
        }
    }

    /// Ends a reduction that needs no flight of its own: the threshold becomes the window at once.
    pub(super) fn end_reduction_at_once(&mut self, ack: &Ack) {
        self.end_reduction();
        self.recovery.phase = CaState::Open;
        self.stay_open(ack);
    }

    /// Enters recovery. `tells_mark` says that a mark was reported, so the reduction must not be taken back.
    pub(super) fn enter_recovery(&mut self, tells_mark: bool) {
        self.begin_undo();
        // A reduction because of a mark continues: the same window of data is not reduced twice.
        if self.recovery.phase < CaState::Cwr {
            self.recovery.prior_threshold = (!tells_mark).then_some(self.current_threshold());
            self.begin_reduction();
        }
        self.recovery.phase = CaState::Recovery;
        self.recovery.high = self.send.next;
        self.counters.recoveries += 1;
    }

    /// Returns the threshold to return to if nothing was lost: at least three quarters of the window, unless a reduction is in progress.
    pub(super) fn current_threshold(&self) -> u32 {
        match self.recovery.phase {
            CaState::Cwr | CaState::Recovery => self.congestion.threshold,
            CaState::Open | CaState::Disorder | CaState::Loss => self.congestion.threshold.max(self.congestion.window / 4 * 3),
        }
    }
}
