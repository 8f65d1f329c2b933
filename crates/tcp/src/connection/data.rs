//! Data arrives, and when it is acknowledged.

use cohaptic_units::Instant;

use super::Connection;
use crate::info::State;
use crate::segment::{Ecn, Flags, Segment};
use crate::sequence::Position;

impl Connection {
    /// The data and the FIN of a segment that counts.
    pub(super) fn accept_data(&mut self, now: Instant, segment: &Segment<'_>, start: Position) {
        let payload = &*segment.payload;
        let has_fin = segment.flags.has(Flags::FIN);
        let data_end = start + payload.len() as u64;
        if payload.is_empty() && !has_fin {
            return;
        }
        if self.is_orphan && data_end > self.receive.next {
            // Nobody will read it (RFC 9293, section 3.6.1).
            self.abort();
            return;
        }
        self.note_marks(segment);
        if data_end + u64::from(has_fin) <= self.receive.next {
            self.tell_duplicate(start, data_end);
            self.receive.ack_now = true;
            return;
        }
        let limit = self.receive.fin.unwrap_or(u64::MAX).min(self.receive.edge.max(self.receive.next));
        let end = data_end.min(limit);
        if has_fin && end == data_end {
            self.receive.fin = Some(data_end);
        }
        self.accept_octets(now, start, end, payload);
        if self.receive.fin == Some(self.receive.next) && !self.receive.is_ended {
            self.end_of_data(now);
        }
        self.decide_acknowledgement(now);
    }

    fn accept_octets(&mut self, now: Instant, start: Position, end: Position, payload: &[u8]) {
        if start < self.receive.next && end > start {
            self.tell_duplicate(start, self.receive.next.min(end));
        }
        if let Some((low, high)) = self.receive.assembler.holding(start, end)
            && end > start
        {
            self.tell_duplicate(start.max(low), end.min(high));
        }
        let had_gaps = self.receive.assembler.has_gaps();
        let count = usize::try_from(end.saturating_sub(start)).unwrap_or(0);
        let known = count < payload.len();
        if count > 0 {
            self.receive.assembler.insert(&mut self.receive.next, start, &payload[..count]);
            self.learn_rhythm(now, count);
        }
        // Data that was cut off, is out of order or fills a gap is acknowledged at once (RFC 5681, section 4.2).
        self.receive.ack_now |= known || had_gaps || self.receive.assembler.has_gaps() || start > self.receive.next;
    }

    /// How large segments are, and how the peer sends.
    fn learn_rhythm(&mut self, now: Instant, count: usize) {
        if count >= self.receive.segment {
            self.receive.segment = count.min(self.send.mss);
        } else {
            self.receive.pushed = (self.receive.pushed + 1).min(2);
        }
        let timeout = self.round_trips.base_timeout(&self.config);
        let was_idle = self.receive.last_data_at.is_none_or(|at| now.saturating_duration_since(at) > timeout);
        if was_idle {
            self.receive.quick = self.config.quick_acks;
        }
        self.receive.last_data_at = Some(now);
    }

    /// Marks of congestion on data that arrives (RFC 3168, section 6.1.3).
    fn note_marks(&mut self, segment: &Segment<'_>) {
        if !self.send.has_ecn {
            return;
        }
        if segment.flags.has(Flags::CWR) {
            self.send.tells_mark = false;
        }
        if segment.ecn == Ecn::Congestion {
            self.send.tells_mark = true;
            self.receive.ack_now = true;
        }
    }

    /// All before the peer's FIN has come.
    fn end_of_data(&mut self, now: Instant) {
        self.receive.next += 1;
        self.receive.is_ended = true;
        self.receive.assembler.forget_gaps();
        match self.state {
            State::FinWait1 => {
                self.state = State::Closing;
                self.receive.ack_now = true;
            }
            State::FinWait2 => {
                self.enter_time_wait(now);
                self.receive.ack_now = true;
            }
            State::SynReceived
            | State::SynSent
            | State::Established
            | State::CloseWait
            | State::Closing
            | State::LastAck
            | State::TimeWait
            | State::Closed => {
                // The acknowledgement waits for this end's own FIN to travel with, as in Linux.
                self.state = State::CloseWait;
                self.receive.is_interactive = true;
            }
        }
    }

    /// At once for every second full segment and at the beginning, after a while otherwise (RFC 9293, section 3.8.6.3).
    fn decide_acknowledgement(&mut self, now: Instant) {
        let receive = &mut self.receive;
        let unacked = usize::try_from(receive.next - receive.acked).unwrap_or(usize::MAX);
        if unacked > receive.segment || (receive.quick > 0 && !receive.is_interactive) {
            receive.ack_now = true;
        }
        if !receive.ack_now && unacked > 0 {
            receive.ack_at.get_or_insert_with(|| now.saturating_add(self.config.delayed_ack));
        }
    }

    /// The program has read: whether the peer should hear of it now.
    pub(super) fn after_reading(&mut self) {
        let receive = &self.receive;
        let unacked = usize::try_from(receive.next - receive.acked).unwrap_or(usize::MAX);
        let is_taken = receive.assembler.unread() == 0 && (receive.pushed > 1 || (receive.pushed > 0 && !receive.is_interactive));
        if receive.ack_at.is_some() && (unacked > receive.segment || is_taken) {
            self.receive.ack_now = true;
            return;
        }
        // A window that has at least doubled (RFC 9293, section 3.8.6.2.2).
        let offered = receive.window();
        if receive.has_offered && !receive.is_ended && self.state.is_synchronised() && 2 * offered <= self.config.receive_buffer as u64 {
            let free = self.free_window().min(65_535 << self.receive.scale);
            self.receive.ack_now |= free > 0 && free >= 2 * offered;
        }
    }
}
