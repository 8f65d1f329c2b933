//! Phases of loss recovery (RFC 5681, 6582, 6675, 6937), as in Linux.

use cohaptic_units::Instant;

use super::Connection;
use super::acknowledge::Ack;
use super::parts::Phase;
use crate::congestion::{Reduction, UNBOUNDED};

/// How many duplicates tell of a loss (RFC 5681, section 3.2).
pub(super) const DUPLICATES: u32 = 3;

impl Connection {
    /// Finds losses, changes the phase, and sets the timer.
    pub(super) fn recover(&mut self, now: Instant, ack: &Ack, has_widened: bool, has_data: bool) {
        self.adapt_patience(ack);
        self.end_tail_probe(ack);
        let mut waits_for_reordering = false;
        let is_dubious = !(has_data || has_widened || ack.has_advanced) || ack.news.has_sacked || ack.tells_mark || ack.tells_duplicate;
        if is_dubious || self.recovery.phase != Phase::Open {
            waits_for_reordering = self.change_phase(now, ack);
        }
        if ack.has_advanced && !waits_for_reordering {
            self.set_timer(now);
        }
    }

    /// Returns whether the timer waits for reordering.
    fn change_phase(&mut self, now: Instant, ack: &Ack) -> bool {
        if ack.tells_mark {
            self.recovery.prior_threshold = None;
        }
        if self.recovery.phase == Phase::Open {
            if self.send.board.again_out == 0 {
                self.recovery.again_at = None;
            }
        } else if self.send.una >= self.recovery.high && self.end_phase(ack) {
            return false;
        }
        match self.recovery.phase {
            Phase::Recovery => {
                if !ack.has_advanced {
                    self.count_duplicate(ack);
                } else if self.undo_in_recovery(ack) {
                    return false;
                }
                if self.undo_by_duplicates() {
                    self.stay_open(ack);
                }
                let waits = self.find_losses(now, ack);
                if self.recovery.phase != Phase::Recovery {
                    self.stay_open(ack);
                }
                waits
            }
            Phase::Loss => {
                self.go_on_after_timeout(ack);
                let waits = self.find_losses(now, ack);
                if self.recovery.phase == Phase::Open {
                    return self.enter_if_lost(ack, waits);
                }
                waits
            }
            Phase::Open | Phase::Disorder | Phase::Reduced => {
                self.count_duplicate(ack);
                if self.recovery.phase != Phase::Reduced {
                    self.undo_by_duplicates();
                }
                let waits = self.find_losses(now, ack);
                self.enter_if_lost(ack, waits)
            }
        }
    }

    fn enter_if_lost(&mut self, ack: &Ack, waits: bool) -> bool {
        if self.send.board.lost_out == 0 {
            self.stay_open(ack);
            return waits;
        }
        self.enter_recovery(ack.tells_mark);
        waits
    }

    /// All that was sent when the phase began is acknowledged. Whether nothing else is to be done.
    fn end_phase(&mut self, ack: &Ack) -> bool {
        match self.recovery.phase {
            Phase::Reduced => {
                // Something above is to be acknowledged as well, so that one window has one reduction.
                if self.send.una != self.recovery.high {
                    self.end_reduction();
                    self.recovery.phase = Phase::Open;
                }
            }
            Phase::Recovery => {
                if !self.receive.has_sack {
                    self.send.board.sacked_out = 0;
                }
                if self.undo_at_end(ack) {
                    return true;
                }
                self.end_reduction();
                self.recovery.phase = Phase::Open;
            }
            Phase::Open | Phase::Disorder | Phase::Loss => {}
        }
        false
    }

    /// Without selective acknowledgements, a duplicate stands for a segment that has arrived.
    fn count_duplicate(&mut self, ack: &Ack) {
        let board = &mut self.send.board;
        if self.receive.has_sack || !ack.is_duplicate {
            return;
        }
        let most = board.packets_out().saturating_sub(board.lost_out.max(1));
        if board.sacked_out < most {
            board.sacked_out += 1;
            self.send.delivered += 1;
        }
    }

    /// Without selective acknowledgements, `acked` segments that duplicates may have stood for.
    pub(super) fn end_duplicates(&mut self, acked: u32) {
        let board = &mut self.send.board;
        if acked > 0 {
            self.send.delivered += u64::from(acked.saturating_sub(board.sacked_out).max(1));
            board.sacked_out = board.sacked_out.saturating_sub(acked - 1);
        }
        board.sacked_out = board.sacked_out.min(board.packets_out().saturating_sub(board.lost_out.max(1)));
        if self.recovery.phase < Phase::Recovery {
            board.sacked_out = 0;
        }
    }

    /// Open, or Disorder if something is amiss; a mark reduces the window.
    pub(super) fn stay_open(&mut self, ack: &Ack) {
        if !self.send.board.has_sent_again() {
            self.recovery.again_at = None;
        }
        if ack.tells_mark {
            self.enter_reduced();
        }
        if self.recovery.phase == Phase::Reduced {
            return;
        }
        let board = &self.send.board;
        let is_amiss = board.sacked_out + board.lost_out > 0 || board.has_sent_again() || self.recovery.undo_from.is_some();
        let phase = if is_amiss { Phase::Disorder } else { Phase::Open };
        if self.recovery.phase != phase {
            (self.recovery.phase, self.recovery.high) = (phase, self.send.next);
        }
    }

    pub(super) fn begin_reduction(&mut self) {
        self.recovery.high = self.send.next;
        self.tail.end = None;
        self.recovery.prior_window = self.congestion.window;
        self.recovery.reduction = Reduction::new(self.congestion.window);
        self.congestion.threshold = self.congestion.reduced();
        self.send.tells_reduction = self.send.has_ecn;
    }

    fn end_reduction(&mut self) {
        let is_reduced = self.recovery.phase == Phase::Reduced || self.recovery.undo_from.is_some();
        if is_reduced && self.congestion.threshold < UNBOUNDED {
            self.congestion.window = self.congestion.threshold;
        }
    }

    /// The window shrinks without a loss: a mark, or a loss that the tail probe repaired.
    pub(super) fn enter_reduced(&mut self) {
        self.recovery.prior_threshold = None;
        if self.recovery.phase < Phase::Reduced {
            self.recovery.undo_from = None;
            self.begin_reduction();
            self.recovery.phase = Phase::Reduced;
        }
    }

    pub(super) fn end_reduction_at_once(&mut self, ack: &Ack) {
        self.end_reduction();
        self.recovery.phase = Phase::Open;
        self.stay_open(ack);
    }

    pub(super) fn enter_recovery(&mut self, tells_mark: bool) {
        self.begin_undo();
        if self.recovery.phase < Phase::Reduced {
            self.recovery.prior_threshold = (!tells_mark).then_some(self.current_threshold());
            self.begin_reduction();
        }
        self.recovery.phase = Phase::Recovery;
        self.recovery.high = self.send.next;
        self.counters.recoveries += 1;
    }

    /// The threshold that holds if nothing is lost: three quarters of the window at least.
    pub(super) fn current_threshold(&self) -> u32 {
        match self.recovery.phase {
            Phase::Reduced | Phase::Recovery => self.congestion.threshold,
            Phase::Open | Phase::Disorder | Phase::Loss => self.congestion.threshold.max(self.congestion.window / 4 * 3),
        }
    }
}
