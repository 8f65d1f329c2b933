//! An acknowledgement arrives.

use cohaptic_units::Instant;

use super::{Connection, Timer};
use crate::connection::parts::Phase;
use crate::connection::recovery::DUPLICATES;
use crate::scoreboard::News;
use crate::segment::{Flags, Segment};
use crate::sequence::{Position, extend};

/// What an acknowledgement says, beside its segments.
#[derive(Clone, Default, Debug)]
pub(super) struct Ack {
    pub(super) position: Position,
    pub(super) has_advanced: bool,
    /// It repeats the last one, and carries nothing else.
    pub(super) is_duplicate: bool,
    pub(super) tells_mark: bool,
    pub(super) tells_duplicate: bool,
    /// When the timestamp that came back was sent \[ticks\].
    pub(super) echo: Option<u32>,
    pub(super) news: News,
}

impl Connection {
    /// Whether the rest of the segment counts.
    pub(super) fn handle_acknowledgement(&mut self, now: Instant, segment: &Segment<'_>, start: Position) -> bool {
        let position = extend(segment.acknowledgement, self.send.una);
        if position > self.send.next || position + self.send.max_window.max(65_535) < self.send.una {
            self.challenge(now);
            return false;
        }
        let has_advanced = position > self.send.una;
        let has_widened = position >= self.send.una && self.learn_window(segment, start, has_advanced);
        let was_empty = self.send.board.is_empty();
        let mut ack = Ack {
            position: position.max(self.send.una),
            has_advanced,
            tells_mark: self.send.has_ecn && segment.flags.has(Flags::ECE),
            echo: segment.options.timestamps.map(|(_, echo)| echo).filter(|echo| self.receive.has_timestamps && *echo != 0),
            ..Ack::default()
        };
        if was_empty {
            self.hear_of_window(now);
            return true;
        }
        let delivered = self.send.delivered;
        let losses = self.send.board.losses;
        self.take_news(segment, &mut ack);
        ack.is_duplicate = position == self.send.una && !has_advanced && !has_widened && segment.sequence_length() == 0 && !ack.news.has_sacked;
        let round_trip = ack.news.round_trip(now).or_else(|| if has_advanced { self.echoed(now, segment) } else { None });
        if let Some(round_trip) = round_trip {
            self.round_trips.sample(now, round_trip);
        }
        if has_advanced {
            (self.counters.retries, self.counters.stalled_since) = (0, None);
        }
        self.recover(now, &ack, has_widened, segment.sequence_length() > 0);
        let delivered = u32::try_from(self.send.delivered - delivered).unwrap_or(u32::MAX);
        self.adapt_window(now, &ack, delivered, self.send.board.losses > losses);
        true
    }

    /// The window that the segment offers (RFC 9293, section 3.10.7.4). Whether it changed.
    fn learn_window(&mut self, segment: &Segment<'_>, start: Position, has_advanced: bool) -> bool {
        let window = u64::from(segment.window) << self.send.scale;
        let is_newer = has_advanced || start > self.send.window_from || (start == self.send.window_from && window > self.send.window);
        if !is_newer {
            return false;
        }
        let has_changed = window != self.send.window;
        (self.send.window, self.send.window_from) = (window, start);
        self.send.max_window = self.send.max_window.max(window);
        has_changed
    }

    /// Which segments have arrived.
    fn take_news(&mut self, segment: &Segment<'_>, ack: &mut Ack) {
        let una = self.send.una;
        let highest = self.send.board.highest_sacked().unwrap_or(una);
        if ack.has_advanced {
            self.send.board.acknowledge(ack.position, highest, &mut ack.news);
            self.send.buffer.acknowledge(ack.position);
            self.send.una = ack.position;
        }
        if self.receive.has_sack {
            self.take_blocks(segment, una, highest, ack);
            self.send.delivered += u64::from(ack.news.delivered);
            if let Some(start) = ack.news.reordered {
                self.note_reordering(start, self.send.board.highest_sacked().unwrap_or(highest).max(highest));
            }
        } else if ack.has_advanced {
            self.end_duplicates(ack.news.acked);
        }
    }

    fn take_blocks(&mut self, segment: &Segment<'_>, una: Position, highest: Position, ack: &mut Ack) {
        let block = |&(start, end): &(u32, u32)| (extend(start, una), extend(end, una));
        let blocks = segment.options.sack.as_slice();
        let mut rest = blocks;
        if let Some((start, end)) = blocks.first().map(block) {
            let is_within_next = blocks.get(1).map(block).is_some_and(|next| next.0 <= start && end <= next.1);
            // Below what this segment acknowledges, which an earlier one may have overtaken.
            if start < extend(segment.acknowledgement, una) || is_within_next {
                rest = &blocks[1..];
                ack.tells_duplicate = true;
                self.note_duplicate(start, end);
            }
        }
        for (start, end) in rest.iter().map(block) {
            if start < end && end <= self.send.next {
                self.send.board.sack(start.max(ack.position), end, highest, &mut ack.news);
            }
        }
    }

    /// Nothing was on the way: it may be the answer to a probe of the window.
    fn hear_of_window(&mut self, now: Instant) {
        self.counters.probes = 0;
        if !self.send.has_new() {
            return;
        }
        if self.is_window_open() {
            self.counters.probe_backoff = 0;
            self.counters.window_probes = 0;
            if matches!(self.timer, Some((_, Timer::WindowProbe))) {
                self.timer = None;
            }
        } else {
            self.timer = Some((now.saturating_add(self.probe_distance()), Timer::WindowProbe));
        }
    }

    /// The congestion window after an acknowledgement.
    fn adapt_window(&mut self, now: Instant, ack: &Ack, delivered: u32, has_lost: bool) {
        if matches!(self.recovery.phase, Phase::Reduced | Phase::Recovery) {
            self.reduce_window(delivered, ack.has_advanced, has_lost);
        } else if ack.has_advanced || (ack.news.has_sacked && self.rack.degree > DUPLICATES) {
            let least = self.round_trips.least().unwrap_or_default();
            self.congestion.grow(now, delivered, least);
        }
    }

    pub(super) fn reduce_window(&mut self, delivered: u32, has_advanced: bool, has_lost: bool) {
        let in_flight = self.send.board.in_flight();
        if let Some(window) = self.recovery.reduction.window(self.congestion.threshold, in_flight, delivered, has_advanced, has_lost) {
            self.congestion.window = window.max(1);
        }
    }
}
