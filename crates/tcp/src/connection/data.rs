//! Arrival of data and of the FIN, and the decision when to acknowledge them.

use cohaptic_units::Instant;

use super::Connection;
use crate::info::State;
use crate::segment::{Ecn, Flags, Payload, Segment};
use crate::sequence::Position;
use crate::tuning::Tuning;

impl Connection {
    /// Takes in the data and the FIN of a valid segment that begins at `start`.
    pub(super) fn accept_data(&mut self, now: Instant, segment: &mut Segment<'_>, start: Position) {
        let has_fin = segment.flags.has(Flags::FIN);
        let data_end = start + segment.payload.len() as u64;
        if segment.payload.is_empty() && !has_fin {
            return;
        }
        if self.is_orphan && data_end > self.receive.next {
            // Nobody will read the new data (RFC 9293, section 3.6.1). As in Linux, the reset has the number that the peer expects, as if there were no
            // connection: this end may have sent more than the peer has received.
            self.die(None);
            self.replies.extend(segment.refusal(self.config.ttl));
            return;
        }
        self.note_marks(now, segment);
        self.hear_echo(now, segment);
        // The whole segment has arrived before: the acknowledgement was lost, or the segment was sent again too early.
        let segment_end = data_end + u64::from(has_fin);
        if segment_end <= self.receive.next {
            self.hurry_acknowledgements();
            self.tell_duplicate(start, segment_end);
            self.receive.ack_now = true;
            return;
        }
        // Data beyond the FIN or beyond the offered window is cut off.
        let limit = self.receive.fin.unwrap_or(u64::MAX).min(self.receive.edge.max(self.receive.next));
        let end = data_end.min(limit);
        // A FIN counts only if no data before it was cut off.
        if has_fin && end == data_end {
            self.receive.fin = Some(data_end);
            if data_end > self.receive.next {
                self.receive.assembler.insert_fin(data_end);
            }
        }
        self.accept_octets(now, start, end, &mut segment.payload);
        if self.receive.fin == Some(self.receive.next) && !self.receive.is_ended {
            self.end_of_data(now);
        }
        self.decide_acknowledgement(now);
    }

    /// Takes in the octets of `payload` from `start` to `end`, and notes which of them are duplicates. `payload` may be longer: the rest was cut off.
    fn accept_octets(&mut self, now: Instant, start: Position, end: Position, payload: &mut Payload<'_>) {
        if start < self.receive.next {
            self.tell_duplicate(start, self.receive.next.min(end));
        } else if self.receive.assembler.has_gaps()
            && let Some((low, high)) = self.receive.assembler.first_within(start, end)
        {
            // As in Linux, what the segment has in common with the first range is reported. There is one report for each acknowledgement.
            self.tell_duplicate(start.max(low), end.min(high));
        }
        // Whether there were gaps is read before the data goes in, because this data may fill the last gap.
        let had_gaps = self.receive.assembler.has_gaps();
        let count = usize::try_from(end.saturating_sub(start)).unwrap_or(0);
        let known = count < payload.len();
        if count > 0 {
            self.receive.assembler.insert(&mut self.receive.next, start, payload.take_first(count));
            self.learn_rhythm(now, count);
        }
        // If data was cut off, is out of order or fills a gap, the acknowledgement leaves at once (RFC 5681, section 4.2).
        self.receive.ack_now |= known || had_gaps || self.receive.assembler.has_gaps() || start > self.receive.next;
    }

    /// Learns the peer's segment size from `count` octets of data, and whether the peer sends after a pause.
    pub(super) fn learn_rhythm(&mut self, now: Instant, count: usize) {
        let mss = self.advertised_mss();
        if count >= self.receive.segment {
            let (offered, is_new) = (self.receive.offered(), count != self.receive.segment);
            if let Some(tuning) = self.receive.tuning.as_mut().filter(|_| is_new) {
                tuning.learn_segment(count, offered);
            }
            self.receive.segment = count.min(mss);
        } else {
            self.receive.pushed = (self.receive.pushed + 1).min(2);
        }
        let is_pause = |at: Instant| now.as_nanos().saturating_sub(at.as_nanos()) > self.round_trips.base_timeout();
        let was_idle = self.receive.last_data_at.is_none_or(is_pause);
        // After a pause of more than a timeout, the peer has a small window again and needs quick acknowledgements to let the window grow.
        if was_idle {
            self.receive.quick = self.config.quick_acks;
        }
        self.receive.last_data_at = Some(now);
        let (held, full, next, edge) = (self.receive.assembler.memory(), self.receive.segment, self.receive.next, self.receive.edge);
        if let Some(tuning) = &mut self.receive.tuning {
            if !self.receive.has_timestamps {
                tuning.hear_data(now, next, edge);
            }
            // As in Linux, the acknowledgement that offers a larger window leaves without delay.
            self.receive.quick |= u32::from(tuning.grow(count, held, full, mss));
        }
    }

    /// Takes the round trip that the timestamps of arriving data tell, for the receive buffer.
    pub(super) fn hear_echo(&mut self, now: Instant, segment: &Segment<'_>) {
        if let (Some((_, echo)), Some(tuning)) = (segment.options.timestamps, &mut self.receive.tuning)
            && self.receive.has_timestamps
        {
            let is_full = segment.payload.len() >= self.receive.segment;
            tuning.hear_echo(echo, is_full.then(|| Self::ticks(now).wrapping_sub(echo)));
        }
    }

    /// Notes marks of congestion on arriving data, and the peer's answer to reported marks (RFC 3168, section 6.1.3).
    fn note_marks(&mut self, now: Instant, segment: &Segment<'_>) {
        if !self.send.has_ecn {
            return;
        }
        if self.is_scalable() {
            return self.mirror_mark(now, segment.ecn == Ecn::Congestion);
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

    /// Lets acknowledgements report the mark of the arriving segment (RFC 8257, section 3.2). A change is reported at once, so that each acknowledgement covers
    /// segments that are all marked or all unmarked.
    fn mirror_mark(&mut self, now: Instant, is_marked: bool) {
        if is_marked == self.send.tells_mark {
            return;
        }
        // A delayed acknowledgement is due for segments of the state before. It leaves first, without the arriving segment.
        if self.receive.ack_at.is_some() {
            let acknowledgement = self.build_acknowledgement(now);
            self.replies.push_back(acknowledgement);
        }
        self.send.tells_mark = is_marked;
        self.receive.ack_now = true;
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
                // As in Linux, the acknowledgement waits, because it can travel with this end's own FIN. Before any data, the delay has no length yet.
                self.state = State::CloseWait;
                self.receive.is_interactive = true;
                self.receive.ack_now |= self.receive.last_data_at.is_none();
            }
        }
    }

    /// Decides when arrived data is acknowledged: at once if more than a full segment is unacknowledged or if quick acknowledgements are left, otherwise after
    /// a delay (RFC 9293, section 3.8.6.3).
    pub(super) fn decide_acknowledgement(&mut self, now: Instant) {
        let unacked = usize::try_from(self.receive.next - self.receive.acked).unwrap_or(usize::MAX);
        // As in Linux, an acknowledgement that would offer less than before waits for the program to read.
        let keeps_window = || self.receive.tuning.is_none() || self.receive.assembler.unread() == 0 || self.free_window().0 >= self.receive.offered();
        let is_due = (self.receive.quick > 0 && !self.receive.is_interactive) || (unacked > self.receive.segment && keeps_window());
        let receive = &mut self.receive;
        receive.ack_now |= is_due;
        if !receive.ack_now && unacked > 0 {
            // A deadline that is already set stays, so that the first unacknowledged octet waits no longer than the configuration allows.
            receive.ack_at.get_or_insert_with(|| now.saturating_add(self.config.delayed_ack));
        }
    }

    /// Decides, after the program has read, whether an acknowledgement leaves now: for arrived data, or for a larger window.
    pub(super) fn after_reading(&mut self, now: Instant) {
        let (unread, next) = (self.receive.assembler.unread() as u64, self.receive.next - u64::from(self.receive.is_ended));
        let waiting = self.receive.assembler.end().map_or(0, |end| end.saturating_sub(next));
        if let Some(tuning) = &mut self.receive.tuning {
            tuning.adapt(now, next - unread, next, waiting);
        }
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
        let most = receive.tuning.as_ref().map_or_else(|| self.config.receive_buffer.unwrap_or(0) as u64, Tuning::most);
        if receive.has_offered && !receive.is_ended && self.state.is_synchronised() && 2 * offered <= most {
            let free = self.free_window().0.min(65_535 << self.receive.scale);
            self.receive.ack_now |= free > 0 && free >= 2 * offered;
        }
    }
}
