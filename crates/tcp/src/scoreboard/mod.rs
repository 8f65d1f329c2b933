//! State of each sent segment: on the way, arrived out of order (sacked), lost, or sent again. Acknowledgements and instants come in as arguments. The
//! scoreboard decides nothing about windows and timers.

mod loss;
mod news;
#[cfg(test)]
mod tests;

use alloc::collections::{BTreeSet, VecDeque};
use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::ranges::Ranges;
use crate::sequence::Position;
pub(crate) use news::News;

/// Sent and unacknowledged segment, from `start` to `end` (exclusive).
#[derive(Clone, Debug)]
pub(crate) struct Sent {
    pub(crate) start: Position,
    pub(crate) end: Position,
    /// Instant of the last transmission.
    pub(crate) at: Instant,
    /// Number of the last transmission, counted over all transmissions of the connection.
    order: u64,
    /// The segment has arrived out of order.
    sacked: bool,
    /// The segment was found lost, and has not arrived since.
    pub(crate) lost: bool,
    /// The last transmission repeated the segment and counts as on the way.
    again: bool,
    /// The segment was repeated at least once.
    ever_again: bool,
    pub(crate) ending: Ending,
}

/// End of a segment when the segment was sent first.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Ending {
    /// The segment has the flag PSH, because the program's data ended with it.
    pub(crate) pushes: bool,
    /// The segment is the last of its burst. Linux repeats only segments of one burst together.
    pub(crate) ends_burst: bool,
}

/// Instant and number of a transmission. The number orders transmissions of the same instant.
pub(crate) type SentAt = (Instant, u64);

/// Capacity of a scoreboard after its first segment \[segments\].
const FIRST: usize = 16;

/// Segments from the first unacknowledged position to the last position sent.
#[derive(Clone, Default, Debug)]
pub(crate) struct Scoreboard {
    /// Segments in the order of positions. Each segment begins where the segment before ends.
    queue: VecDeque<Sent>,
    /// Transmissions in the order of time, with the end of their segment, which never changes: an acknowledgement moves only the start. An entry stays after
    /// its segment was sent again or has arrived; readers skip old entries. Empty unless `keeps_times` is set.
    by_time: VecDeque<(SentAt, Position)>,
    /// `false` as long as `by_time` would have one entry for each segment of `queue`, in the order of `queue`, as in a transfer without losses.
    keeps_times: bool,
    /// Starts of the lost segments that wait to be sent again.
    to_send: BTreeSet<Position>,
    /// Positions that have arrived out of order, as the receiver has told.
    sacked: Ranges,
    /// Number of segments that have arrived out of order. Without selective acknowledgements, each duplicate acknowledgement counts as a segment.
    pub(crate) sacked_out: u32,
    /// Number of segments with `lost`.
    pub(crate) lost_out: u32,
    /// Number of segments with `again`.
    pub(crate) again_out: u32,
    /// Number of transmissions so far.
    transmissions: u64,
    /// Number of detected losses. A segment may be lost several times.
    pub(crate) losses: u64,
}

impl Scoreboard {
    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Returns the number of unacknowledged segments.
    pub(crate) fn packets_out(&self) -> u32 {
        u32::try_from(self.queue.len()).unwrap_or(u32::MAX)
    }

    /// Returns the estimate of the number of segments on the way (`pipe` of RFC 6675).
    pub(crate) fn in_flight(&self) -> u32 {
        (self.packets_out() + self.again_out).saturating_sub(self.sacked_out + self.lost_out)
    }

    pub(crate) fn first(&self) -> Option<&Sent> {
        self.queue.front()
    }

    pub(crate) fn last(&self) -> Option<&Sent> {
        self.queue.back()
    }

    /// Returns the end of the highest sacked range.
    pub(crate) fn highest_sacked(&self) -> Option<Position> {
        self.sacked.end()
    }

    /// Appends a new segment, sent at `at`. The segment must begin where the last segment ends.
    pub(crate) fn push(&mut self, start: Position, end: Position, at: Instant, ending: Ending) {
        self.transmissions += 1;
        let order = self.transmissions;
        if self.queue.capacity() == 0 {
            // Most flights have ten segments or more.
            self.queue.reserve(FIRST);
        }
        if self.keeps_times {
            self.by_time.push_back(((at, order), end));
        }
        self.queue.push_back(Sent { start, end, at, order, sacked: false, lost: false, again: false, ever_again: false, ending });
    }

    /// Fills `by_time`, unless `by_time` is filled already. Called before a search by time, and before a segment is sent again, which changes the order of
    /// transmissions.
    fn keep_times(&mut self) {
        if !self.keeps_times {
            self.keeps_times = true;
            self.by_time.extend(self.queue.iter().map(|sent| ((sent.at, sent.order), sent.end)));
        }
    }

    /// Returns the index in `queue` of the segment that contains `position`.
    fn index(&self, position: Position) -> Option<usize> {
        // The ends ascend, because the segments follow each other without gaps.
        let index = self.queue.partition_point(|sent| sent.end <= position);
        (index < self.queue.len()).then_some(index)
    }

    /// Removes the segments below `position`, all of which have arrived, and adds them to `news`. `highest_sacked` is the end of the highest range that was
    /// sacked before this acknowledgement.
    pub(crate) fn acknowledge(&mut self, position: Position, highest_sacked: Position, news: &mut News) {
        while self.queue.front().is_some_and(|first| first.end <= position) {
            let Some(sent) = self.queue.pop_front() else { break };
            news.acked += 1;
            self.again_out -= u32::from(sent.again);
            if sent.lost {
                self.lost_out -= 1;
                self.to_send.remove(&sent.start);
            }
            if sent.sacked {
                self.sacked_out -= 1;
            } else {
                // A sacked segment was counted when its block came.
                news.delivered += 1;
                news.hear(&sent);
                if sent.ever_again {
                    news.has_acked_again = true;
                } else {
                    news.first_acked = news.first_acked.or(Some(sent.at));
                    news.last_acked = Some(sent.at);
                    news.note_order(sent.start, highest_sacked);
                }
            }
        }
        self.sacked.remove_below(position);
        let Some(first) = self.queue.front() else {
            // Nothing is on the way. The memory of the queues is released, because an idle connection is to be small.
            *self = Self { transmissions: self.transmissions, losses: self.losses, ..Self::default() };
            return;
        };
        // Entries of removed segments are dropped at the front. Entries further back are skipped when they come to the front.
        while self.by_time.front().is_some_and(|(_, end)| *end <= position) {
            self.by_time.pop_front();
        }
        if first.start < position {
            self.cut_first(position);
        }
    }

    /// Removes the octets below `position` from the first segment, because an acknowledgement ends inside the segment.
    #[cold]
    fn cut_first(&mut self, position: Position) {
        let Some(first) = self.queue.front_mut() else { return };
        // `to_send` is keyed by the start of the segment.
        if self.to_send.remove(&first.start) {
            self.to_send.insert(position);
        }
        first.start = position;
    }

    /// Notes that all positions from `start` to `end` (exclusive) have arrived (RFC 2018), and adds the segments to `news`. A segment counts as arrived only if
    /// all of its positions have. `highest_sacked` is the end of the highest range that was sacked before this acknowledgement.
    pub(crate) fn sack(&mut self, start: Position, end: Position, highest_sacked: Position, news: &mut News) {
        let mut gaps = Vec::new();
        self.sacked.insert(start, end, |from, to| gaps.push((from, to)));
        let Some((low, high)) = self.sacked.around(start) else { return };
        for (from, to) in gaps {
            // The search begins with the segment that contains `from`: a part of that segment may have been sacked before, and this block completes it.
            let begin = self.queue.partition_point(|sent| sent.end <= from);
            for sent in self.queue.range_mut(begin..).take_while(|sent| sent.start < to) {
                // `low` and `high` bound the sacked range around this block, so that a segment must lie in this range as a whole.
                if sent.sacked || sent.start < low || sent.end > high {
                    continue;
                }
                if sent.lost {
                    self.lost_out -= 1;
                    self.to_send.remove(&sent.start);
                }
                self.again_out -= u32::from(sent.again);
                (sent.lost, sent.again, sent.sacked) = (false, false, true);
                self.sacked_out += 1;
                news.delivered += 1;
                news.has_sacked = true;
                news.hear(sent);
                if !sent.ever_again {
                    news.first_sacked = news.first_sacked.or(Some(sent.at));
                    news.last_sacked = Some(sent.at);
                    news.note_order(sent.start, highest_sacked);
                }
            }
        }
    }

    /// Returns how many segments from the lost segment at `start` on are lost and wait to be sent again, belong to one burst, and end before `window_end`; at
    /// most `most`.
    pub(crate) fn lost_in_burst(&self, start: Position, window_end: Position, most: u32) -> u32 {
        let Some(first) = self.index(start) else { return 0 };
        let mut count = 0;
        for sent in self.queue.range(first..) {
            if count == most || !sent.lost || sent.again || sent.end > window_end {
                break;
            }
            count += 1;
            if sent.ending.ends_burst {
                break;
            }
        }
        count
    }

    /// Takes the last segment out of its burst, because the segment is repeated alone.
    pub(crate) fn split_last(&mut self) {
        if let Some(before) = self.queue.len().checked_sub(2).and_then(|index| self.queue.get_mut(index)) {
            before.ending.ends_burst = true;
        }
    }

    /// Returns the first lost segment in the queue for retransmission.
    pub(crate) fn next_lost(&self) -> Option<&Sent> {
        self.queue.get(self.index(*self.to_send.first()?)?)
    }

    /// Notes that the segment that contains `start` is sent again at `at`. If `counts` is set, the segment no longer waits to be sent again, and its new
    /// transmission is on the way beside the lost transmission. A probe does not count.
    pub(crate) fn sent_again(&mut self, start: Position, at: Instant, counts: bool) {
        let Some(index) = self.index(start) else { return };
        self.keep_times();
        self.transmissions += 1;
        let sent = &mut self.queue[index];
        (sent.at, sent.order, sent.ever_again) = (at, self.transmissions, true);
        if counts {
            self.to_send.remove(&sent.start);
            self.again_out += u32::from(!sent.again);
            sent.again = true;
        }
        self.by_time.push_back(((at, self.transmissions), sent.end));
    }

    /// Returns whether a repeated segment is on the way or is the first unacknowledged segment.
    pub(crate) fn has_sent_again(&self) -> bool {
        self.again_out > 0 || self.queue.front().is_some_and(|first| first.ever_again)
    }
}
