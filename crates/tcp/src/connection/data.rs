//! Arrival of data and of the FIN, and the decision when to acknowledge them.

use cohaptic_units::Instant;

use super::Connection;
use crate::info::State;
use crate::segment::{Ecn, Flags, Segment};
use crate::sequence::Position;

impl Connection {
    /// Takes in the data and the FIN of a valid segment that begins at `start`.
    pub(super) fn accept_data(&mut self, now: Instant, segment: &Segment<'_>, start: Position) {
        let payload = &*segment.payload;
        let has_fin = segment.flags.has(Flags::FIN);
        let data_end = start + payload.len() as u64;
        if payload.is_empty() && !has_fin {
            return;
        }
        if self.is_orphan && data_end > self.receive.next {
            // Nobody will read the new data (RFC 9293, section 3.6.1).
            self.abort();
            return;
        }
        self.note_marks(segment);
        // The whole segment has arrived before: the acknowledgement was lost, or the segment was sent again too early.
        if data_end + u64::from(has_fin) <= self.receive.next {
            self.tell_duplicate(start, data_end);
            self.receive.ack_now = true;
            return;
        }
        // Data beyond the FIN or beyond the offered window is cut off.
        let limit = self.receive.fin.unwrap_or(u64::MAX).min(self.receive.edge.max(self.receive.next));
        let end = data_end.min(limit);
        // A FIN counts only if no data before it was cut off.
        if has_fin && end == data_end {
            self.receive.fin = Some(data_end);
        }
        self.accept_octets(now, start, end, payload);
        if self.receive.fin == Some(self.receive.next) && !self.receive.is_ended {
            self.end_of_data(now);
        }
        self.decide_acknowledgement(now);
    }

    /// Takes in the octets of `payload` from `start` to `end`, and notes which of them are duplicates. `payload` may be longer: the rest was cut off.
    fn accept_octets(&mut self, now: Instant, start: Position, end: Position, payload: &[u8]) {
        if start < self.receive.next && end > start {
            self.tell_duplicate(start, self.receive.next.min(end));
        }
        if let Some((low, high)) = self.receive.assembler.holding(start, end)
            && end > start
        {
            self.tell_duplicate(start.max(low), end.min(high));
        }
        // Whether there were gaps is read before the data goes in, because this data may fill the last gap.
        let had_gaps = self.receive.assembler.has_gaps();
        let count = usize::try_from(end.saturating_sub(start)).unwrap_or(0);
        let known = count < payload.len();
        if count > 0 {
            self.receive.assembler.insert(&mut self.receive.next, start, &payload[..count]);
            self.learn_rhythm(now, count);
        }
        // If data was cut off, is out of order or fills a gap, the acknowledgement leaves at once (RFC 5681, section 4.2).
        self.receive.ack_now |= known || had_gaps || self.receive.assembler.has_gaps() || start > self.receive.next;
    }

    /// Learns the peer's segment size from `count` octets of data, and whether the peer sends after a pause.
    fn learn_rhythm(&mut self, now: Instant, count: usize) {
        if count >= self.receive.segment {
            self.receive.segment = count.min(self.send.mss);
        } else {
            self.receive.pushed = (self.receive.pushed + 1).min(2);
        }
        let timeout = self.round_trips.base_timeout(&self.config);
        let was_idle = self.receive.last_data_at.is_none_or(|at| now.saturating_duration_since(at) > timeout);
        // After a pause of more than a timeout, the peer has a small window again and needs quick acknowledgements to let the window grow.
        if was_idle {
            self.receive.quick = self.config.quick_acks;
        }
        self.receive.last_data_at = Some(now);
    }

    /// Notes marks of congestion on arriving data, and the peer's answer to reported marks (RFC 3168, section 6.1.3).
    fn note_marks(&mut self, segment: &Segment<'_>) {
        if !self.send.has_ecn {
            return;
        }
        // CWR comes first: a segment may have CWR and a new mark, which must be reported again.
        if segment.flags.has(Flags::CWR) {
            self.send.tells_mark = false;
        }
        if segment.ecn == Ecn::Congestion {
            self.send.tells_mark = true;
            self.receive.ack_now = true;
        }
    }

    /// Handles the peer's FIN, now that all data before it has arrived.
    fn end_of_data(&mut self, now: Instant) {
        // The FIN takes a position.
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
                // As in Linux, the acknowledgement waits, because it can travel with this end's own FIN.
                self.state = State::CloseWait;
                self.receive.is_interactive = true;
            }
        }
    }

    /// Decides when arrived data is acknowledged: at once if more than a full segment is unacknowledged or if quick acknowledgements are left, otherwise after
    /// a delay (RFC 9293, section 3.8.6.3).
    fn decide_acknowledgement(&mut self, now: Instant) {
        let receive = &mut self.receive;
        let unacked = usize::try_from(receive.next - receive.acked).unwrap_or(usize::MAX);
        if unacked > receive.segment || (receive.quick > 0 && !receive.is_interactive) {
            receive.ack_now = true;
        }
        if !receive.ack_now && unacked > 0 {
            // A deadline that is already set stays, so that the first unacknowledged octet waits no longer than the configuration allows.
            receive.ack_at.get_or_insert_with(|| now.saturating_add(self.config.delayed_ack));
        }
    }

    /// Decides, after the program has read, whether an acknowledgement leaves now: for arrived data, or for a larger window.
    pub(super) fn after_reading(&mut self) {
        let receive = &self.receive;
        let unacked = usize::try_from(receive.next - receive.acked).unwrap_or(usize::MAX);
        // The program has read everything and may have no answer, so that waiting for data to travel with is in vain.
        let is_taken = receive.assembler.unread() == 0 && (receive.pushed > 1 || (receive.pushed > 0 && !receive.is_interactive));
        if receive.ack_at.is_some() && (unacked > receive.segment || is_taken) {
            self.receive.ack_now = true;
            return;
        }
        // A window that has at least doubled is offered at once (RFC 9293, section 3.8.6.2.2). Smaller changes travel with other segments.
        let offered = receive.window();
        if receive.has_offered && !receive.is_ended && self.state.is_synchronised() && 2 * offered <= self.config.receive_buffer as u64 {
            let free = self.free_window().min(65_535 << self.receive.scale);
            self.receive.ack_now |= free > 0 && free >= 2 * offered;
        }
    }
}
