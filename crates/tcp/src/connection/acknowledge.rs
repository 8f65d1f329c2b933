//! Arrival of an acknowledgement: the peer's window, the segments that have arrived, the round trip, and then losses and the congestion window.

use cohaptic_units::Instant;

use super::{Connection, Timer};
use crate::congestion::RoundTrip;
use crate::info::CaState;
use crate::scoreboard::News;
use crate::segment::{Flags, Segment};
use crate::sequence::{Position, extend};

/// Number of duplicates, or of segments out of order, at which a loss is assumed (RFC 5681, section 3.2).
pub(super) const DUPLICATES: u32 = 3;

/// Content of an acknowledgement.
#[derive(Clone, Default, Debug)]
pub(super) struct Ack {
    /// Position that is acknowledged, at least `una` before this acknowledgement.
    pub(super) position: Position,
    /// The acknowledgement number is above all earlier acknowledgement numbers.
    pub(super) has_advanced: bool,
    /// The segment repeats the last acknowledgement and carries no data, no new window and no new block.
    pub(super) is_duplicate: bool,
    /// The peer reports a mark of congestion.
    pub(super) tells_mark: bool,
    /// The peer reports a duplicate.
    pub(super) tells_duplicate: bool,
    /// The duplicate may be a tail probe.
    pub(super) answers_probe: bool,
    /// Timestamp of this end that the peer echoes \[ticks\].
    pub(super) echo: Option<u32>,
    /// Segments that have arrived at the peer.
    pub(super) news: News,
}

impl Connection {
    /// Handles the acknowledgement of `segment`, which begins at the peer's position `start`. Returns whether the rest of the segment is to be handled.
    pub(super) fn handle_acknowledgement(&mut self, now: Instant, segment: &Segment<'_>, start: Position) -> bool {
        let position = extend(segment.acknowledgement, self.send.una);
        // An acknowledgement of octets that were never sent, or older than the peer's largest window, may be forged (RFC 5961, section 5).
        if position > self.send.next || position + self.send.max_window.max(65_535) < self.send.una {
            self.challenge(now);
            return false;
        }
        self.learn_timestamp(now, segment, start, position);
        let has_advanced = position > self.send.una;
        let has_widened = position >= self.send.una && self.learn_window(segment, start, has_advanced);
        let was_empty = self.send.board.is_empty();
        if has_widened && was_empty && self.send.has_new() {
            self.end_pause(now);
        }
        let mut ack = Ack {
            position: position.max(self.send.una),
            has_advanced,
            tells_mark: self.send.has_ecn && segment.flags.has(Flags::ECE),
            echo: segment.options.timestamps.map(|(_, echo)| echo).filter(|echo| self.receive.has_timestamps && *echo != 0),
            ..Ack::default()
        };
        // Nothing was on the way, so the acknowledgement can only tell of the window, or of a duplicate that undoes an earlier reduction.
        if was_empty {
            self.take_late_duplicate(now, segment, &mut ack);
            self.hear_of_window(now);
            return true;
        }
        // Both counters are kept to see the effect of this acknowledgement alone.
        let delivered = self.send.delivered;
        let losses = self.send.board.losses;
        self.take_news(segment, &mut ack);
        ack.is_duplicate = position == self.send.una && !has_advanced && !has_widened && segment.sequence_length() == 0 && !ack.news.has_sacked;
        // If segments were sent again, only the echo of a timestamp tells which transmission was answered.
        let round_trip = ack.news.round_trip(now).or_else(|| if has_advanced { self.echoed(now, segment) } else { None });
        if let Some(round_trip) = round_trip {
            self.round_trips.sample(now, round_trip);
        }
        if let Some(latest) = ack.news.latest_round_trip(now) {
            let (una, next, pace) = (self.send.una, self.send.next, self.pace());
            self.congestion.sample(now, RoundTrip { latest, una, next, pace });
        }
        if has_advanced {
            (self.counters.retries, self.counters.stalled_since) = (0, None);
        }
        let arrived = |end: &Self| u32::try_from(end.send.delivered - delivered).unwrap_or(u32::MAX);
        // The estimate comes first, because a reduction uses the share of marks with this acknowledgement.
        let (una, next, heard) = (self.send.una, self.send.next, arrived(self));
        self.congestion.hear(una, next, heard, ack.tells_mark);
        self.recover(now, &ack, has_widened, segment.sequence_length() > 0);
        let delivered = arrived(self);
        self.adapt_window(now, &ack, delivered, self.send.board.losses > losses);
        self.expand_send_buffer();
        true
    }

    /// Takes over the timestamp to echo from a segment that contains the last acknowledged position, so that a delayed acknowledgement counts into the round
    /// trip (RFC 7323, section 4.3). The acknowledgement of the segment must be valid and not overtaken: a forged timestamp would make all later segments old.
    pub(super) fn learn_timestamp(&mut self, now: Instant, segment: &Segment<'_>, start: Position, position: Position) {
        if let (Some((value, _)), true) = (segment.options.timestamps, self.receive.has_timestamps)
            && start <= self.receive.acked
            && position >= self.send.una
        {
            self.receive.recent = Some((value, now));
        }
    }

    /// Handles a report of a duplicate that comes after everything was acknowledged. The report may show that the last reduction was needless.
    fn take_late_duplicate(&mut self, now: Instant, segment: &Segment<'_>, ack: &mut Ack) {
        if self.receive.has_sack && !segment.options.sack.as_slice().is_empty() {
            self.take_blocks(segment, self.send.una, self.send.una, ack);
        }
        if ack.tells_duplicate {
            self.change_phase(now, ack);
        }
    }

    /// Takes over the window that the segment offers (RFC 9293, section 3.10.7.4). Returns whether the window has changed.
    pub(super) fn learn_window(&mut self, segment: &Segment<'_>, start: Position, has_advanced: bool) -> bool {
        let window = u64::from(segment.window) << self.send.scale;
        // An overtaken segment has an old window. Among segments from the same position with the same acknowledgement, only a larger window is sure to be
        // newer.
        let is_newer = has_advanced || start > self.send.window_from || (start == self.send.window_from && window > self.send.window);
        if !is_newer {
            return false;
        }
        let has_changed = window != self.send.window;
        (self.send.window, self.send.window_from) = (window, start);
        self.send.max_window = self.send.max_window.max(window);
        has_changed
    }

    /// Notes which segments have arrived, in the scoreboard, in the send buffer and in `ack`.
    fn take_news(&mut self, segment: &Segment<'_>, ack: &mut Ack) {
        let una = self.send.una;
        // The highest sacked position before this acknowledgement: a segment below this position that arrives now was reordered.
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

    /// Takes over the selective acknowledgements of `segment`. `una` and `highest` are the values before this acknowledgement.
    fn take_blocks(&mut self, segment: &Segment<'_>, una: Position, highest: Position, ack: &mut Ack) {
        let block = |&(start, end): &(u32, u32)| (extend(start, una), extend(end, una));
        let blocks = segment.options.sack.as_slice();
        let mut rest = blocks;
        if let Some((start, end)) = blocks.first().map(block) {
            let is_within_next = blocks.get(1).map(block).is_some_and(|next| next.0 <= start && end <= next.1);
            // The first block reports a duplicate if it lies below the acknowledgement number of its segment, or within the second block (RFC 2883, section 4).
            // The segment's own number counts here, because a later acknowledgement may have overtaken the segment.
            if (start < extend(segment.acknowledgement, una) || is_within_next)
                && let Some(is_probe) = self.note_duplicate(start, end)
            {
                rest = &blocks[1..];
                (ack.tells_duplicate, ack.answers_probe) = (true, is_probe);
            }
        }
        for (start, end) in rest.iter().map(block) {
            // An invalid block, or a block of octets that were never sent, is ignored.
            if start < end && end <= self.send.next {
                self.send.board.sack(start.max(ack.position), end, highest, &mut ack.news);
            }
        }
    }

    /// Handles an acknowledgement while no segment is on the way. The acknowledgement may answer a probe of the window.
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
            // The window is still closed, but the peer is there: the next probe follows at the present distance.
            self.timer = Some((now.saturating_add(self.probe_distance()), Timer::WindowProbe));
        }
    }

    /// Changes the congestion window after an acknowledgement with which `delivered` segments arrived. `has_lost` says that a segment was found lost.
    fn adapt_window(&mut self, now: Instant, ack: &Ack, delivered: u32, has_lost: bool) {
        // Marked segments do not let the window grow. With other algorithms than DCTCP a mark begins a reduction, in which nothing grows.
        let is_held = ack.tells_mark && self.is_scalable();
        if matches!(self.recovery.phase, CaState::Cwr | CaState::Recovery) {
            self.reduce_window(delivered, ack.has_advanced, has_lost);
        } else if !is_held && (ack.has_advanced || (ack.news.has_sacked && self.rack.degree > DUPLICATES)) {
            // On a path with strong reordering, segments that arrive out of order are no sign of loss, so the window grows with them as well.
            self.congestion.grow(now, delivered);
        }
    }

    /// Moves the congestion window during a reduction, after `delivered` segments have arrived.
    pub(super) fn reduce_window(&mut self, delivered: u32, has_advanced: bool, has_lost: bool) {
        let in_flight = self.send.board.in_flight();
        if let Some(window) = self.recovery.reduction.window(self.congestion.threshold, in_flight, delivered, has_advanced, has_lost) {
            self.congestion.window = window.max(1);
        }
    }
}
