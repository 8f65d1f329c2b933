//! Which segments are lost.

use core::time::Duration;

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::{Scoreboard, SentAt};

impl Scoreboard {
    fn mark_lost(&mut self, index: usize) {
        let sent = &mut self.queue[index];
        if sent.again {
            sent.again = false;
            self.again_out -= 1;
        }
        if !sent.lost {
            sent.lost = true;
            self.lost_out += 1;
        }
        self.losses += 1;
        self.to_send.insert(sent.start);
    }

    /// The first segment is lost, unless that is known. Whether it was not.
    pub(crate) fn mark_first_lost(&mut self) -> bool {
        let is_new = self.queue.front().is_some_and(|first| !first.lost);
        if is_new {
            self.mark_lost(0);
        }
        is_new
    }

    /// Loss by time (RFC 8985, section 6.2): what was sent before `delivered`, and longer ago than `patience`, is lost.
    ///
    /// Returns when the rest of what was sent before will be.
    pub(crate) fn detect_by_time(&mut self, now: Instant, delivered: SentAt, patience: Duration) -> Option<Instant> {
        while let Some(&(sent_at, start)) = self.by_time.front() {
            let index = self.index(start).filter(|index| self.is_undecided(*index, sent_at));
            if let Some(index) = index {
                if sent_at >= delivered {
                    return None;
                }
                if sent_at.0.saturating_add(patience) > now {
                    break;
                }
                self.mark_lost(index);
            }
            self.by_time.pop_front();
        }
        let before = self.by_time.partition_point(|(sent_at, _)| *sent_at < delivered);
        let last = self.by_time.range(..before).next_back()?;
        Some(last.0.0.saturating_add(patience))
    }

    /// Whether that transmission is the last one of its segment, of which nothing is known.
    fn is_undecided(&self, index: usize, sent_at: SentAt) -> bool {
        let sent = &self.queue[index];
        (sent.at, sent.order) == sent_at && !sent.sacked && (!sent.lost || sent.again)
    }

    /// Loss by count (RFC 6675, IsLost): whatever has `duplicates` sacked segments above it is lost, unless it was sent again.
    pub(crate) fn detect_by_count(&mut self, duplicates: u32) {
        if self.sacked_out < duplicates {
            return;
        }
        let mut left = duplicates;
        let highest = self.sacked.end().unwrap_or(0);
        let mut below = self.queue.partition_point(|sent| sent.start < highest);
        while left > 0 && below > 0 {
            below -= 1;
            left -= u32::from(self.queue[below].sacked);
        }
        // From above: what lies below a segment that is decided was decided with it.
        for index in (0..below).rev() {
            let sent = &self.queue[index];
            if sent.sacked {
                continue;
            }
            if sent.lost || sent.ever_again {
                break;
            }
            self.mark_lost(index);
        }
    }

    /// The timer ran out: all that has not arrived is lost, but what was sent less than `patience` ago (RFC 8985, section 6.3), the first apart.
    pub(crate) fn mark_all_lost(&mut self, now: Instant, patience: Option<Duration>, has_sack: bool) {
        let has_reneged = self.queue.front().is_some_and(|first| first.sacked);
        if has_reneged || !has_sack {
            // The receiver has dropped what it had (RFC 2018, section 8), or duplicates stood for it.
            self.sacked.clear();
            self.sacked_out = 0;
            self.queue.iter_mut().for_each(|sent| sent.sacked = false);
        }
        for index in 0..self.queue.len() {
            let sent = &self.queue[index];
            let is_recent = index > 0 && patience.is_some_and(|patience| sent.at.saturating_add(patience) > now);
            if !sent.sacked && !is_recent {
                self.mark_lost(index);
            }
        }
    }

    /// Nothing was lost after all.
    pub(crate) fn unmark_lost(&mut self) {
        self.to_send.clear();
        self.lost_out = 0;
        self.queue.iter_mut().for_each(|sent| sent.lost = false);
        let mut by_time: Vec<_> = self.queue.iter().filter(|sent| !sent.sacked).map(|sent| ((sent.at, sent.order), sent.start)).collect();
        by_time.sort_unstable();
        self.by_time = by_time.into();
    }
}
