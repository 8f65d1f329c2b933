//! Which segments are on the way, have arrived out of order, are lost, or were sent again.

mod loss;

use alloc::collections::{BTreeSet, VecDeque};
use alloc::vec::Vec;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::ranges::Ranges;
use crate::sequence::Position;

/// A segment that was sent and is not acknowledged.
#[derive(Clone, Debug)]
pub(crate) struct Sent {
    pub(crate) start: Position,
    pub(crate) end: Position,
    /// When it was sent last.
    pub(crate) at: Instant,
    /// Which transmission that was, counted over the connection.
    order: u64,
    sacked: bool,
    pub(crate) lost: bool,
    /// Sent again and on the way.
    again: bool,
    /// Sent again at some time.
    ever_again: bool,
}

/// When a segment was sent, so that two of one instant differ.
pub(crate) type SentAt = (Instant, u64);

/// The segments between the first unacknowledged position and the last one sent, without holes.
#[derive(Clone, Default, Debug)]
pub(crate) struct Scoreboard {
    queue: VecDeque<Sent>,
    /// Each transmission in the order of time, with the start of its segment. Those that no longer matter are skipped.
    by_time: VecDeque<(SentAt, Position)>,
    /// The lost ones that are to be sent again.
    to_send: BTreeSet<Position>,
    sacked: Ranges,
    /// Segments that arrived out of order. Without selective acknowledgements, duplicates stand for them.
    pub(crate) sacked_out: u32,
    pub(crate) lost_out: u32,
    pub(crate) again_out: u32,
    transmissions: u64,
    /// How often a segment was found lost.
    pub(crate) losses: u64,
}

/// What an acknowledgement says about segments.
#[derive(Clone, Default, Debug)]
pub(crate) struct News {
    /// Segments acknowledged, sacked before or not.
    pub(crate) acked: u32,
    /// Segments heard of for the first time, sacked or acknowledged.
    pub(crate) delivered: u32,
    /// Whether a segment was sacked that was not before.
    pub(crate) has_sacked: bool,
    /// Whether one that was sent again was acknowledged, so that round trips are ambiguous (Karn).
    pub(crate) has_acked_again: bool,
    /// When the first was sent that was acknowledged, or sacked, and never sent again.
    pub(crate) first_acked: Option<Instant>,
    pub(crate) first_sacked: Option<Instant>,
    /// The latest transmission that arrived, and whether it was sent again.
    pub(crate) latest: Option<(SentAt, bool)>,
    /// The first segment that arrived after one that was sent later, and was never sent again.
    pub(crate) reordered: Option<Position>,
}

impl Scoreboard {
    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// The segments between the first unacknowledged one and the last.
    pub(crate) fn packets_out(&self) -> u32 {
        u32::try_from(self.queue.len()).unwrap_or(u32::MAX)
    }

    /// The estimate of segments on the way (RFC 6675, pipe).
    pub(crate) fn in_flight(&self) -> u32 {
        (self.packets_out() + self.again_out).saturating_sub(self.sacked_out + self.lost_out)
    }

    pub(crate) fn first(&self) -> Option<&Sent> {
        self.queue.front()
    }

    pub(crate) fn last(&self) -> Option<&Sent> {
        self.queue.back()
    }

    /// The end of what has arrived out of order, as far as it is known.
    pub(crate) fn highest_sacked(&self) -> Option<Position> {
        self.sacked.end()
    }

    /// A new segment leaves.
    pub(crate) fn push(&mut self, start: Position, end: Position, at: Instant) {
        self.transmissions += 1;
        let order = self.transmissions;
        self.by_time.push_back(((at, order), start));
        self.queue.push_back(Sent { start, end, at, order, sacked: false, lost: false, again: false, ever_again: false });
    }

    fn index(&self, start: Position) -> Option<usize> {
        let index = self.queue.partition_point(|sent| sent.end <= start);
        (index < self.queue.len()).then_some(index)
    }

    /// All below `position` has arrived.
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
                news.delivered += 1;
                news.hear(&sent);
                if sent.ever_again {
                    news.has_acked_again = true;
                } else {
                    news.first_acked = news.first_acked.or(Some(sent.at));
                    news.note_order(sent.start, highest_sacked);
                }
            }
        }
        self.sacked.remove_below(position);
        let Some(first) = self.queue.front_mut() else {
            // An idle connection is to be small.
            *self = Self { transmissions: self.transmissions, losses: self.losses, ..Self::default() };
            return;
        };
        while self.by_time.front().is_some_and(|(_, start)| *start < first.start) {
            self.by_time.pop_front();
        }
        if first.start < position {
            if self.to_send.remove(&first.start) {
                self.to_send.insert(position);
            }
            first.start = position;
        }
    }

    /// All between these positions has arrived (RFC 2018). A segment of which only a part has counts as missing.
    pub(crate) fn sack(&mut self, start: Position, end: Position, highest_sacked: Position, news: &mut News) {
        let mut gaps = Vec::new();
        self.sacked.insert(start, end, |from, to| gaps.push((from, to)));
        let Some((low, high)) = self.sacked.around(start) else { return };
        for (from, to) in gaps {
            // A segment may have begun in what was known before.
            let begin = self.queue.partition_point(|sent| sent.end <= from);
            for sent in self.queue.range_mut(begin..).take_while(|sent| sent.start < to) {
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
                    news.note_order(sent.start, highest_sacked);
                }
            }
        }
    }

    /// The first lost segment that is to be sent again.
    pub(crate) fn next_lost(&self) -> Option<&Sent> {
        self.queue.get(self.index(*self.to_send.first()?)?)
    }

    /// A segment leaves again. `counts`: it is on the way from now on, its lost transmission apart.
    pub(crate) fn sent_again(&mut self, start: Position, at: Instant, counts: bool) {
        let Some(index) = self.index(start) else { return };
        self.transmissions += 1;
        let sent = &mut self.queue[index];
        (sent.at, sent.order, sent.ever_again) = (at, self.transmissions, true);
        if counts {
            self.to_send.remove(&sent.start);
            self.again_out += u32::from(!sent.again);
            sent.again = true;
        }
        self.by_time.push_back(((at, self.transmissions), sent.start));
    }

    /// Whether segments that were sent again are still unacknowledged.
    pub(crate) fn has_sent_again(&self) -> bool {
        self.again_out > 0 || self.queue.front().is_some_and(|first| first.ever_again)
    }
}

impl News {
    fn note_order(&mut self, start: Position, highest_sacked: Position) {
        if start < highest_sacked {
            self.reordered = Some(self.reordered.map_or(start, |other| other.min(start)));
        }
    }

    fn hear(&mut self, sent: &Sent) {
        let sent_at = (sent.at, sent.order);
        if self.latest.is_none_or(|(latest, _)| sent_at > latest) {
            self.latest = Some((sent_at, sent.ever_again));
        }
    }

    /// The round trip of what has arrived, if it is not ambiguous.
    pub(crate) fn round_trip(&self, now: Instant) -> Option<Duration> {
        let acked = self.first_acked.filter(|_| !self.has_acked_again);
        Some(now.saturating_duration_since(acked.or(self.first_sacked)?))
    }
}
