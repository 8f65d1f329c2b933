//! Detection of lost segments: by time, by count, or by the retransmission timer.

use core::time::Duration;

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::{Scoreboard, SentAt};
use crate::sequence::Position;

impl Scoreboard {
    /// Marks the segment at `index` as lost and queues it to be sent again. A segment that was sent again is lost a second time.
    pub(super) fn mark_lost(&mut self, index: usize) {
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

    /// Marks the first segment as lost. Returns whether the mark is new.
    pub(crate) fn mark_first_lost(&mut self) -> bool {
        let is_new = self.queue.front().is_some_and(|first| !first.lost);
        if is_new {
            self.mark_lost(0);
        }
        is_new
    }

    /// Marks as lost each segment sent before the transmission `delivered` and at least `patience` before `now` (RFC 8985, section 6.2).
    ///
    /// Returns the instant at which all other segments sent before `delivered` are lost, or `None` if no other segment is left.
    pub(crate) fn detect_by_time(&mut self, now: Instant, delivered: SentAt, patience: Duration) -> Option<Instant> {
        self.keep_times();
        while let Some(&(sent_at, end)) = self.by_time.front() {
            if let Some(index) = self.undecided(sent_at, end) {
                // Entries ascend in time: from here on, every transmission is later than `delivered`.
                if sent_at >= delivered {
                    return None;
                }
                if sent_at.0.saturating_add(patience) > now {
                    break;
                }
                self.mark_lost(index);
            }
            // The entry is decided: the segment was just marked, has arrived, or was sent again and has a later entry.
            self.by_time.pop_front();
        }
        // The last undecided transmission before `delivered` has the last deadline, so that one timer covers all waiting segments. Linux leaves out arrived
        // segments too: its list of transmissions loses each of them on arrival.
        let before = self.by_time.partition_point(|(sent_at, _)| *sent_at < delivered);
        let last = self.by_time.range(..before).rposition(|&(sent_at, end)| self.undecided(sent_at, end).is_some())?;
        // The decided entries behind it are removed, so that the next search does not pass over them again.
        self.by_time.drain(last + 1..before);
        Some(self.by_time[last].0.0.saturating_add(patience))
    }

    /// Returns the index of the segment that ends at `end` if `sent_at` is its last transmission, and the fate of this transmission is unknown.
    fn undecided(&self, sent_at: SentAt, end: Position) -> Option<usize> {
        let index = self.index(end - 1)?;
        let sent = &self.queue[index];
        ((sent.at, sent.order) == sent_at && !sent.sacked && (!sent.lost || sent.again)).then_some(index)
    }

    /// Marks as lost each segment that was never sent again and has at least `duplicates` later segments sacked (`IsLost` of RFC 6675).
    pub(crate) fn detect_by_count(&mut self, duplicates: u32) {
        if self.sacked_out < duplicates {
            return;
        }
        // Walk down from the highest sacked segment over `duplicates` sacked segments. Every segment below `below` has enough sacked segments above it.
        let mut left = duplicates;
        let highest = self.sacked.end().unwrap_or(0);
        let mut below = self.queue.partition_point(|sent| sent.start < highest);
        while left > 0 && below > 0 {
            below -= 1;
            left -= u32::from(self.queue[below].sacked);
        }
        // Downwards: if a segment was marked lost before, every segment below it was decided at the same time.
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

    /// Marks all segments that have not arrived as lost, after the retransmission timer has run out. With `patience`, segments that were sent less than
    /// `patience` before `now` are spared (RFC 8985, section 6.3), except for the first segment, and unless the receiver has dropped sacked data.
    pub(crate) fn mark_all_lost(&mut self, now: Instant, patience: Option<Duration>, has_sack: bool) {
        // The receiver acknowledges in order, so the first unacknowledged segment cannot have arrived unless the receiver has dropped the segment again.
        let has_reneged = self.queue.front().is_some_and(|first| first.sacked);
        if has_reneged || !has_sack {
            // Either the receiver has dropped sacked data (RFC 2018, section 8), or the count of sacked segments came from duplicates, which do not
            // tell which segments have arrived. In both cases no segment is known to have arrived.
            self.sacked.clear();
            self.sacked_out = 0;
            self.queue.iter_mut().for_each(|sent| sent.sacked = false);
        }
        // After dropped data, Linux spares no segment: the search by time has forgotten the transmissions of the segments that counted as sacked.
        let patience = patience.filter(|_| !has_reneged);
        for index in 0..self.queue.len() {
            let sent = &self.queue[index];
            let is_recent = index > 0 && patience.is_some_and(|patience| sent.at.saturating_add(patience) > now);
            if !sent.sacked && !is_recent {
                self.mark_lost(index);
            }
        }
    }

    /// Takes back all marks of loss, because nothing was lost.
    pub(crate) fn unmark_lost(&mut self) {
        self.to_send.clear();
        self.lost_out = 0;
        self.queue.iter_mut().for_each(|sent| sent.lost = false);
        // Loss detection has dropped the entries of lost segments from `by_time`. All segments on the way need an entry again.
        let mut by_time: Vec<_> = self.queue.iter().filter(|sent| !sent.sacked).map(|sent| ((sent.at, sent.order), sent.end)).collect();
        by_time.sort_unstable();
        (self.by_time, self.keeps_times) = (by_time.into(), true);
    }
}
