//! What leaves, and when.

use cohaptic_units::Instant;

use super::{Connection, Probe, Timer};
use crate::connection::parts::Phase;
use crate::segment::{Ecn, Segment};
use crate::sequence::{Position, on_wire};

impl Connection {
    /// The next segment to send at that instant; `None` when all has left that may.
    #[must_use]
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Segment<'static>> {
        if let Some(reply) = self.replies.pop_front() {
            return Some(reply);
        }
        if self.state.is_synchronised() {
            if let Some(probe) = self.probe.take()
                && let Some(segment) = self.forced(now, probe)
            {
                return Some(segment);
            }
            if self.state.may_send()
                && let Some(segment) = self.lost_again(now).or_else(|| self.new_data(now, false))
            {
                return Some(segment);
            }
            if self.receive.ack_now {
                return Some(self.build(now, self.send.next, self.send.next));
            }
        }
        None
    }

    /// A lost segment once more, if the window has room.
    fn lost_again(&mut self, now: Instant) -> Option<Segment<'static>> {
        let board = &self.send.board;
        let lost = board.next_lost()?;
        let (start, end) = (lost.start, lost.end);
        let is_first = start == self.send.una;
        if board.in_flight() >= self.congestion.window || (!is_first && end > self.send.window_end()) {
            return None;
        }
        self.send.board.sent_again(start, now, true);
        if matches!(self.recovery.phase, Phase::Reduced | Phase::Recovery) {
            self.recovery.reduction.sent += 1;
        }
        if is_first && !matches!(self.timer, Some((_, Timer::Reordering))) {
            self.set_retransmission_timer(now, true);
        }
        Some(self.again(now, start, end))
    }

    /// A segment that was sent before.
    fn again(&mut self, now: Instant, start: Position, end: Position) -> Segment<'static> {
        self.counters.retransmissions += 1;
        self.recovery.again_at.get_or_insert(now);
        self.recovery.undo_left = Some(self.recovery.undo_left.unwrap_or(0) + 1);
        self.build(now, start, end)
    }

    /// The end of the next new segment, if the peer's window has room for a full one or for all that is left.
    fn next_end(&self) -> Option<Position> {
        let size = self.segment_size().saturating_sub(self.sack_length()).max(1) as u64;
        let data_end = self.send.buffer.end();
        let (next, end) = (self.send.next, self.send.end());
        let wanted = if data_end.saturating_sub(next) > size { next + size } else { end };
        let window_end = self.send.window_end();
        if wanted <= window_end {
            return Some(wanted);
        }
        // The data fits, only the FIN does not.
        (wanted == end && wanted > data_end && data_end > next && data_end <= window_end).then_some(data_end)
    }

    /// Whether the peer's window lets new data leave.
    pub(super) fn is_window_open(&self) -> bool {
        self.next_end().is_some()
    }

    /// A segment that was never sent. `is_probe`: the congestion window does not count.
    fn new_data(&mut self, now: Instant, is_probe: bool) -> Option<Segment<'static>> {
        if !self.send.has_new() {
            return None;
        }
        if self.send.board.is_empty() && self.send.next > self.send.first + 1 {
            let idle = now.saturating_duration_since(self.send.last_data_at);
            if self.config.slow_start_after_idle && !idle.is_zero() && self.recovery.phase == Phase::Open {
                self.congestion.rest(idle, self.round_trips.timeout(&self.config));
            }
        }
        let (una, next) = (self.send.una, self.send.next);
        let in_flight = self.send.board.in_flight();
        if in_flight >= self.congestion.window && !is_probe {
            self.congestion.used(una, next, self.send.board.packets_out(), true);
            return None;
        }
        let Some(end) = self.next_end() else {
            self.wait_for_window(now);
            return None;
        };
        let is_small = end.min(self.send.buffer.end()) - next < self.segment_size() as u64;
        let has_fin = end > self.send.buffer.end();
        // Nagle's algorithm (RFC 9293, section 3.7.4), in Minshall's form: only a small segment holds another one back.
        if is_small && !has_fin && !is_probe && !self.config.nodelay && self.send.small_end > una {
            return None;
        }
        if is_small && !has_fin {
            self.send.small_end = end;
        }
        Some(self.send_new(now, end))
    }

    fn send_new(&mut self, now: Instant, end: Position) -> Segment<'static> {
        let start = self.send.next;
        let was_empty = self.send.board.is_empty();
        let has_answered = self.receive.last_data_at.is_some_and(|at| now.saturating_duration_since(at) < self.config.delayed_ack);
        let segment = self.build(now, start, end);
        self.send.next = end;
        self.send.board.push(start, end, now);
        self.send.last_data_at = now;
        // Data in answer to data: later acknowledgements wait for it.
        self.receive.is_interactive |= has_answered;
        if matches!(self.recovery.phase, Phase::Reduced | Phase::Recovery) {
            self.recovery.reduction.sent += 1;
        }
        let is_limiting = self.send.board.in_flight() >= self.congestion.window;
        self.congestion.used(self.send.una, end, self.send.board.packets_out(), is_limiting);
        if was_empty || matches!(self.timer, None | Some((_, Timer::TailProbe | Timer::WindowProbe))) {
            self.set_retransmission_timer(now, was_empty);
        }
        self.set_tail_timer(now, false);
        let ecn = if self.send.has_ecn && !segment.payload.is_empty() { Ecn::Capable0 } else { Ecn::NotCapable };
        Segment { ecn, ..segment }
    }

    /// New data waits for the peer's window: if nothing is on the way that would be answered, a probe is to come.
    fn wait_for_window(&mut self, now: Instant) {
        if self.send.board.is_empty() && self.timer.is_none() {
            self.timer = Some((now.saturating_add(self.probe_distance()), Timer::WindowProbe));
        }
    }

    fn forced(&mut self, now: Instant, probe: Probe) -> Option<Segment<'static>> {
        match probe {
            Probe::Tail => {
                let segment = self.new_data(now, true);
                self.tail.is_again = segment.is_none();
                let segment = segment.or_else(|| self.last_again(now));
                self.tail.end = segment.is_some().then_some(self.send.next);
                self.set_retransmission_timer(now, true);
                segment
            }
            Probe::Window => {
                let end = self.send.window_end().min(self.send.end()).min(self.send.next + self.segment_size() as u64);
                if self.send.has_new() && self.send.next < end && self.state.may_send() {
                    (self.counters.probes, self.counters.probe_backoff) = (0, 0);
                    return Some(self.send_new(now, end));
                }
                // Out of window, so that it is answered.
                let segment = self.build(now, self.send.next, self.send.next);
                Some(Segment { sequence: on_wire(self.send.una - 1), ..segment })
            }
        }
    }

    /// The last segment once more; the estimate of segments on the way stays.
    fn last_again(&mut self, now: Instant) -> Option<Segment<'static>> {
        let last = self.send.board.last()?;
        let (start, end) = (last.start, last.end);
        self.send.board.sent_again(start, now, false);
        Some(self.again(now, start, end))
    }
}
