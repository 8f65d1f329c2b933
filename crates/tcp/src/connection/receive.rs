//! Arrival of a segment: the checks that decide whether the segment is valid (RFC 9293, section 3.10.7.4, and RFC 5961).

use core::time::Duration;

use cohaptic_units::Instant;

use super::Connection;
use crate::error::Error;
use crate::flight::Flight;
use crate::info::State;
use crate::segment::{Flags, Segment};
use crate::sequence::{Position, extend, on_wire};

/// Least time between two answers to segments out of window without data. Without this limit, two ends could answer each other for ever.
const BETWEEN_ANSWERS: Duration = Duration::from_millis(500);

/// Age above which the timestamp to echo no longer proves the age of a segment (RFC 7323, section 5.5).
const TIMESTAMPS_COUNT: Duration = Duration::from_secs(24 * 86_400);

impl Connection {
    /// Handles a segment that arrives at `now`. The owner has checked the addresses and ports of the segment.
    pub fn handle_segment(&mut self, now: Instant, segment: &Segment<'_>) {
        self.take_segment(now, &mut segment.clone());
    }

    /// Takes the next segment out of `flight`, and handles the segment. Returns `false` if no segment is left.
    pub fn handle_next(&mut self, now: Instant, flight: &mut Flight) -> bool {
        let Some(segment) = flight.take_next() else { return false };
        self.take_segment(now, segment);
        true
    }

    /// Handles a segment like [`handle_segment`](Self::handle_segment), and may take the data out of `segment`. For an owner that does not need the segment
    /// afterwards: the connection then makes no second reference to the memory of the data.
    pub fn take_segment(&mut self, now: Instant, segment: &mut Segment<'_>) {
        match self.state {
            State::Closed => self.replies.extend(segment.refusal(self.config.ttl)),
            State::SynSent => self.handle_in_syn_sent(now, segment),
            State::TimeWait => self.handle_in_time_wait(now, segment),
            State::SynReceived | State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck => {
                self.handle_synchronised(now, segment)
            }
        }
    }

    /// Handles a segment after the peer's SYN has arrived.
    fn handle_synchronised(&mut self, now: Instant, segment: &mut Segment<'_>) {
        if self.is_expected(now, segment) {
            return self.handle_expected(now, segment);
        }
        let start = extend(segment.sequence, self.receive.next);
        if self.answers_own_syn(segment, start) {
            self.receive.ack_now = true;
        } else if !self.is_valid(now, segment, start) {
            return;
        }
        // After the SYN, every valid segment has an ACK (RFC 9293, section 3.10.7.4).
        if !segment.flags.has(Flags::ACK) {
            return;
        }
        self.counters.probes = 0;
        self.receive.last_heard = now;
        self.restart_keepalive(now);
        if self.state == State::SynReceived {
            if extend(segment.acknowledgement, self.send.una) != self.send.first + 1 {
                self.replies.extend(segment.refusal(self.config.ttl));
                return;
            }
            self.establish(now, segment);
        }
        if !self.handle_acknowledgement(now, segment, start) {
            return;
        }
        self.advance_close(now);
        if matches!(self.state, State::Established | State::FinWait1 | State::FinWait2) {
            self.accept_data(now, segment, start);
        } else if segment.sequence_length() > 0 && start < self.receive.next && self.state != State::Closed {
            // The peer has sent its FIN again, because the acknowledgement was lost.
            self.hurry_acknowledgements();
            self.tell_duplicate(start, self.receive.next.min(start + segment.sequence_length() as u64));
            self.receive.ack_now = true;
        }
    }

    /// Returns whether `segment` carries the next octets and no other news, which holds for nearly all segments of a transfer in one direction (header
    /// prediction, as in `tcp_rcv_established`).
    fn is_expected(&self, now: Instant, segment: &Segment<'_>) -> bool {
        if segment.payload.is_empty() {
            return false;
        }
        let (receive, send) = (&self.receive, &self.send);
        let is_next = segment.sequence == on_wire(receive.next) && receive.next + segment.payload.len() as u64 <= receive.edge;
        // Nothing of this end is on the way or waits, so that the acknowledgement number tells nothing new.
        let is_idle = segment.acknowledgement == on_wire(send.una) && send.board.is_empty() && !send.has_new();
        let is_plain = segment.flags | Flags::PSH == Flags::ACK | Flags::PSH && segment.options.sack.as_slice().is_empty() && !send.has_ecn;
        is_next
            && is_idle
            && is_plain
            && self.state == State::Established
            && !self.is_orphan
            && receive.fin.is_none()
            && !receive.assembler.has_gaps()
            && !self.is_old(now, segment)
    }

    /// Handles a segment that [is expected](Self::is_expected), like the rest of `handle_synchronised`: all steps are left out that change nothing then.
    fn handle_expected(&mut self, now: Instant, segment: &mut Segment<'_>) {
        self.counters.probes = 0;
        self.receive.last_heard = now;
        self.restart_keepalive(now);
        let start = self.receive.next;
        self.learn_timestamp(now, segment, start, self.send.una);
        self.learn_window(segment, start, false);
        self.hear_echo(now, segment);
        let count = segment.payload.len();
        self.receive.assembler.append(&mut segment.payload);
        self.receive.next += count as u64;
        self.learn_rhythm(now, count);
        self.decide_acknowledgement(now);
    }

    /// Returns whether both ends opened at once and `segment` is the peer's answer to this end's SYN: the peer's SYN again, with an ACK of this end's SYN.
    fn answers_own_syn(&self, segment: &Segment<'_>, start: Position) -> bool {
        self.state == State::SynReceived
            && segment.flags.has(Flags::SYN | Flags::ACK)
            && start + 1 == self.receive.next
            && extend(segment.acknowledgement, self.send.una) == self.send.next
    }

    /// Checks timestamps, window, RST and SYN. Returns whether the rest of the segment is to be handled. Prepares the answer to an invalid segment.
    fn is_valid(&mut self, now: Instant, segment: &Segment<'_>, start: Position) -> bool {
        let end = start + segment.sequence_length() as u64;
        let is_reset = segment.flags.has(Flags::RST);
        if !is_reset && self.is_old(now, segment) {
            self.answer_out_of_window(now, segment, start, end);
            return false;
        }
        // As in Linux, the lower limit is the last acknowledged position instead of `next`: the peer does not know `next` yet.
        if end < self.receive.acked || start > self.receive.edge.max(self.receive.next) {
            if self.state == State::SynReceived && segment.flags.has(Flags::SYN) {
                self.repeat_syn(now);
            } else if !is_reset {
                self.answer_out_of_window(now, segment, start, end);
            }
            return false;
        }
        if is_reset {
            // RFC 5961, section 3: only a reset at exactly the expected number counts. A reset elsewhere in the window may be forged.
            if start == self.receive.next {
                self.be_reset();
            } else {
                self.challenge(now);
            }
            return false;
        }
        // A SYN in the window may be forged, or come from a peer that has restarted. The challenge makes a restarted peer answer with a reset.
        if segment.flags.has(Flags::SYN) {
            if self.state == State::SynReceived && start + 1 == self.receive.next {
                self.repeat_syn(now);
            } else {
                self.challenge(now);
            }
            return false;
        }
        true
    }

    /// Sends this end's SYN again, because the peer has not received the first SYN.
    pub(super) fn repeat_syn(&mut self, now: Instant) {
        let answer = self.build_syn(now);
        self.replies.push_back(answer);
    }

    /// Returns whether the timestamp of `segment` shows that the segment is old (protection against wrapped sequence numbers, RFC 7323, section 5).
    fn is_old(&self, now: Instant, segment: &Segment<'_>) -> bool {
        let (Some((value, _)), Some((recent, at))) = (segment.options.timestamps, self.receive.recent) else { return false };
        let behind = recent.wrapping_sub(value);
        // The difference wraps: a value from 1 to half of the range means that the segment is older than the timestamp to echo.
        if !self.receive.has_timestamps || !(1..1 << 31).contains(&behind) {
            return false;
        }
        // A pure acknowledgement at the expected number that was overtaken by less than a second is harmless, and refusing the segment would lose its news.
        let is_harmless = segment.sequence_length() == 0 && extend(segment.sequence, self.receive.next) == self.receive.next && behind < 1000;
        !is_harmless && now.saturating_duration_since(at) < TIMESTAMPS_COUNT
    }

    /// Answers a segment out of window with an acknowledgement of the expected number. The acknowledgement reports the octets that had arrived before.
    fn answer_out_of_window(&mut self, now: Instant, segment: &Segment<'_>, start: Position, end: Position) {
        if segment.flags.has(Flags::SYN) {
            self.challenge(now);
        } else if segment.sequence_length() == 0 {
            self.answer_at_times(now);
        } else {
            if start < self.receive.next {
                self.hurry_acknowledgements();
                self.tell_duplicate(start, end.min(self.receive.next));
            }
            self.receive.ack_now = true;
        }
    }

    /// Sends a challenge ACK, within the limit of the rate: a genuine peer answers with the exact sequence number (RFC 5961).
    pub(super) fn challenge(&mut self, now: Instant) {
        self.answer_at_times(now);
    }

    /// Sends an acknowledgement, unless such an answer left less than `BETWEEN_ANSWERS` ago.
    fn answer_at_times(&mut self, now: Instant) {
        if self.receive.challenged_at.is_none_or(|at| now.saturating_duration_since(at) >= BETWEEN_ANSWERS) {
            self.receive.challenged_at = Some(now);
            self.receive.ack_now = true;
        }
    }

    /// Lets the next acknowledgements leave without delay, because the peer is recovering from a loss.
    pub(super) const fn hurry_acknowledgements(&mut self) {
        self.receive.quick = self.config.quick_acks;
        self.receive.is_interactive = false;
    }

    /// Notes that the positions from `start` to `end` (exclusive) have arrived twice. The next acknowledgement reports them.
    pub(super) fn tell_duplicate(&mut self, start: Position, end: Position) {
        if self.receive.has_sack && start < end {
            self.receive.duplicate = Some((start, end));
        }
    }

    /// Ends the connection after a reset by the peer. Data that has arrived in order stays readable.
    fn be_reset(&mut self) {
        let error = match self.state {
            // As in Linux: after the peer's FIN, the program hears of the reset only when it writes.
            State::CloseWait => Error::BrokenPipe,
            State::SynReceived
            | State::SynSent
            | State::Established
            | State::FinWait1
            | State::FinWait2
            | State::Closing
            | State::LastAck
            | State::TimeWait
            | State::Closed => Error::ConnectionReset,
        };
        self.die(Some(error));
    }
}
