//! Choice of the next segment to send, within the windows of the peer and of congestion control.

use cohaptic_units::Instant;

use super::build::Content;
use super::{Connection, Probe, Timer};
use crate::flight::Flight;
use crate::info::CaState;
use crate::scoreboard::Ending;
use crate::segment::{Ecn, Flags, Segment};
use crate::sequence::Position;

/// Next segment to send.
#[derive(Clone, Copy, Debug)]
enum Choice {
    /// The first of the replies.
    Reply,
    /// A reset, which tells that this end has given the connection up.
    Reset,
    /// New data up to this position. Nothing is noted as sent.
    New(Position),
    Segment(Content),
}

impl Connection {
    /// Returns the next segment to send at `now`, or `None` if no segment may leave at present.
    #[must_use]
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Segment<'static>> {
        match self.choose(now)? {
            Choice::Reply => self.replies.pop_front(),
            Choice::Reset => Some(self.build_reset(now)),
            Choice::New(end) => {
                let content = self.send_one(now, end);
                Some(self.build(now, content))
            }
            Choice::Segment(content) => Some(self.build(now, content)),
        }
    }

    /// Appends all segments that may leave at `now` to `flight`: the segments that [`poll_transmit`](Self::poll_transmit) would return one by one, in less
    /// time.
    pub fn transmit(&mut self, now: Instant, flight: &mut Flight) {
        while let Some(choice) = self.choose(now) {
            match choice {
                Choice::Reply => self.replies.pop_front().into_iter().for_each(|reply| flight.push(reply)),
                Choice::Reset => flight.push(self.build_reset(now)),
                Choice::New(end) => return self.transmit_new(now, end, flight),
                Choice::Segment(content) => {
                    let window = self.offer_window();
                    self.append(now, content, window, flight);
                }
            }
        }
    }

    /// Appends all segments of new data to `flight`. The first one ends at `end`.
    fn transmit_new(&mut self, now: Instant, end: Position, flight: &mut Flight) {
        let was_empty = self.send.board.is_empty();
        let mut window = self.offer_window();
        // In units above an octet, the window to offer does not depend on the window that was offered before, so that all segments offer the same.
        let is_same = self.receive.scale > 0;
        let mut next = Some(end);
        // New data makes no reply, no probe and no repetition due, so that only new data is looked for.
        while let Some(end) = next {
            let content = self.send_new(now, end);
            self.append(now, content, window, flight);
            next = self.next_new(now, false);
            if next.is_some() && !is_same {
                window = self.offer_window();
            }
        }
        // The last segment decides about the timer, and data is an acknowledgement as well.
        self.set_flight_timer(now, was_empty);
        self.send.pushes.is_writing = false;
    }

    /// Chooses the next segment to send, and notes that the segment leaves, unless the segment has new data.
    fn choose(&mut self, now: Instant) -> Option<Choice> {
        self.follow_up_calls(now);
        // The order of the choices matters. Every segment after the replies acknowledges all data in order, so that a pure acknowledgement comes last. Lost
        // segments come before new data, because the peer's program waits for lost data.
        if !self.replies.is_empty() {
            return Some(Choice::Reply);
        }
        if core::mem::take(&mut self.is_reset_due) {
            return Some(Choice::Reset);
        }
        if self.state.is_synchronised() {
            if let Some(probe) = self.probe.take()
                && let Some(content) = self.forced(now, probe)
            {
                return Some(Choice::Segment(content));
            }
            if self.state.may_send() {
                if let Some(content) = self.lost_again(now) {
                    return Some(Choice::Segment(content));
                }
                if let Some(end) = self.next_new(now, false) {
                    return Some(Choice::New(end));
                }
            }
            if self.receive.ack_now {
                return Some(Choice::Segment(self.acknowledgement()));
            }
        }
        self.send.pushes.is_writing = false;
        None
    }

    /// Sends the first lost segment again, if the congestion window and the peer's window have room.
    fn lost_again(&mut self, now: Instant) -> Option<Content> {
        let board = &self.send.board;
        let lost = board.next_lost()?;
        let (start, end, pushes) = (lost.start, lost.end, lost.ending.pushes);
        let is_first = start == self.send.una;
        // The first segment may leave also beyond a shrunken window of the peer: the answer tells the present window.
        if board.in_flight() >= self.congestion.window || (!is_first && end > self.send.window_end()) {
            return None;
        }
        let ends_burst = self.ends_repetition(now, start, end);
        self.send.board.sent_again(start, now, true);
        if matches!(self.recovery.phase, CaState::Cwr | CaState::Recovery) {
            self.recovery.reduction.sent += 1;
        }
        if is_first && !matches!(self.timer, Some((_, Timer::Reordering))) {
            self.set_retransmission_timer(now, true);
        }
        Some(self.again(now, start, end, pushes || ends_burst))
    }

    /// Returns the content of an earlier segment once more, and counts the repetition for the undo.
    fn again(&mut self, now: Instant, start: Position, end: Position, pushes: bool) -> Content {
        self.send.last_data_at = now;
        self.counters.retransmissions += 1;
        self.recovery.again_at.get_or_insert(now);
        self.recovery.undo_left = Some(self.recovery.undo_left.unwrap_or(0) + 1);
        Content { start, end, flags: Flags::NONE.with_if(Flags::PSH, pushes), ecn: self.codepoint() }
    }

    /// Returns the end of the next new segment, if the peer's window has room for a full segment or for all remaining data. A smaller part is not sent, so that
    /// no silly window arises (RFC 9293, section 3.8.6.2.1).
    #[inline]
    fn next_end(&self) -> Option<Position> {
        let size = self.segment_size().saturating_sub(self.sack_length()).max(1) as u64;
        let data_end = self.send.buffer.end();
        let (next, end) = (self.send.next, self.send.end());
        let wanted = if data_end.saturating_sub(next) > size { next + size } else { end };
        let window_end = self.send.window_end();
        if wanted <= window_end {
            return Some(wanted);
        }
        // If the data fits and only the FIN does not, the data leaves alone.
        (wanted == end && wanted > data_end && data_end > next && data_end <= window_end).then_some(data_end)
    }

    /// Returns whether the peer's window lets new data leave.
    pub(super) fn is_window_open(&self) -> bool {
        self.next_end().is_some()
    }

    /// Returns the end of the next segment of new data, if the windows have room. With `is_probe`, the congestion window and Nagle's algorithm do not count.
    #[inline]
    fn next_new(&mut self, now: Instant, is_probe: bool) -> Option<Position> {
        if !self.send.has_new() {
            return None;
        }
        let (una, next) = (self.send.una, self.send.next);
        let in_flight = self.send.board.in_flight();
        if in_flight >= self.congestion.window && !is_probe {
            // The window has held back data, and may therefore grow.
            self.congestion.used(una, next, self.send.board.packets_out(), true);
            return None;
        }
        let Some(end) = self.next_end() else {
            self.wait_for_window(now);
            return None;
        };
        let is_small = end.min(self.send.buffer.end()) - next < self.segment_size() as u64;
        let has_fin = end > self.send.buffer.end();
        // Nagle's algorithm (RFC 9293, section 3.7.4) in Minshall's form: a small segment waits only while another small segment is unacknowledged.
        if is_small && !has_fin && !is_probe && !self.config.nodelay && self.send.small_end > una {
            return None;
        }
        if is_small && !has_fin {
            self.send.small_end = end;
        }
        Some(end)
    }

    /// Sends the new segment that ends at `end`, and sets the timer.
    fn send_one(&mut self, now: Instant, end: Position) -> Content {
        let was_empty = self.send.board.is_empty();
        let content = self.send_new(now, end);
        self.set_flight_timer(now, was_empty);
        content
    }

    /// Sets the timer after new data has left. `was_empty` says that nothing was on the way before.
    fn set_flight_timer(&mut self, now: Instant, was_empty: bool) {
        // The sending half has one timer, and the timer of a tail probe has priority.
        if !self.set_tail_timer(now, false) && (was_empty || matches!(self.timer, None | Some((_, Timer::TailProbe | Timer::WindowProbe)))) {
            self.set_retransmission_timer(now, was_empty);
        }
    }

    /// Sends the new segment that ends at `end`, and notes it in the scoreboard. The caller sets the timer.
    #[inline]
    fn send_new(&mut self, now: Instant, end: Position) -> Content {
        let start = self.send.next;
        // New data soon after the arrival of data is an answer.
        let has_answered = self.receive.last_data_at.is_some_and(|at| now.saturating_duration_since(at) < self.config.delayed_ack);
        // The FIN has the position after the last octet.
        let data_end = end.min(self.send.buffer.end());
        let has_data = data_end > start;
        let (is_last, has_several) = self.ends_burst(now, start, end);
        let pushes = has_data && self.send.pushes.take(data_end);
        if self.send.board.in_flight() == 0 {
            // The curve of CUBIC must not rise during the pause that ends here.
            self.congestion.shift(now.saturating_duration_since(self.send.last_data_at));
        }
        self.send.next = end;
        self.send.board.push(start, end, now, Ending { pushes, ends_burst: is_last });
        self.send.last_data_at = now;
        // After an answer, later acknowledgements wait for data to travel with.
        self.receive.is_interactive |= has_answered;
        if matches!(self.recovery.phase, CaState::Cwr | CaState::Recovery) {
            self.recovery.reduction.sent += 1;
        }
        let is_limiting = self.send.board.in_flight() >= self.congestion.window;
        self.congestion.used(self.send.una, end, self.send.board.packets_out(), is_limiting);
        let flags = Flags::NONE.with_if(Flags::PSH, pushes || (has_data && is_last && has_several));
        // With a scalable congestion control, every segment has a codepoint already.
        let codepoint = self.codepoint();
        let ecn = if self.send.has_ecn && has_data && !codepoint.is_capable() { Ecn::Capable0 } else { codepoint };
        Content { start, end, flags, ecn }
    }

    /// Sets the timer for a probe of the peer's window, unless a segment is on the way whose answer will tell the window.
    fn wait_for_window(&mut self, now: Instant) {
        if self.send.board.is_empty() && self.timer.is_none() {
            self.timer = Some((now.saturating_add(self.probe_distance()), Timer::WindowProbe));
        }
    }

    /// Returns the content of the segment for `probe`, or `None` if there is neither new data nor an earlier segment to send again.
    fn forced(&mut self, now: Instant, probe: Probe) -> Option<Content> {
        match probe {
            // New data is the better probe, because new data must be sent anyway. Without new data, the last segment is repeated.
            Probe::Tail => {
                let content = self.next_new(now, true).map(|end| self.send_one(now, end));
                self.tail.is_again = content.is_none();
                let content = content.or_else(|| self.last_again(now));
                self.tail.end = content.is_some().then_some(self.send.next);
                self.set_retransmission_timer(now, true);
                content
            }
            Probe::Window => {
                let end = self.send.window_end().min(self.send.end()).min(self.send.next + self.segment_size() as u64);
                if self.send.has_new() && self.send.next < end && self.state.may_send() {
                    (self.counters.probes, self.counters.probe_backoff) = (0, 0);
                    let content = self.send_one(now, end);
                    return Some(Content { flags: content.flags | Flags::PSH, ..content });
                }
                // A segment without data from below the peer's window carries nothing, but forces an answer.
                let below = self.send.una - 1;
                Some(Content { start: below, end: below, ..self.acknowledgement() })
            }
        }
    }

    /// Sends the last segment again as a probe. The estimate of the segments on the way does not change.
    fn last_again(&mut self, now: Instant) -> Option<Content> {
        let last = self.send.board.last()?;
        let (start, end, pushes) = (last.start, last.end, last.ending.pushes);
        self.send.board.split_last();
        self.send.board.sent_again(start, now, false);
        Some(self.again(now, start, end, pushes))
    }
}
