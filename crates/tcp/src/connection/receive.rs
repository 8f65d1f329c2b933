//! A segment arrives: whether it counts (RFC 9293, section 3.10.7.4, and RFC 5961).

use core::time::Duration;

use cohaptic_units::Instant;

use super::Connection;
use crate::error::Error;
use crate::info::State;
use crate::segment::{Flags, Segment};
use crate::sequence::{Position, extend};

/// Segments out of window without data are answered once in that time at most, so that two ends never answer each other for ever.
const BETWEEN_ANSWERS: Duration = Duration::from_millis(500);

/// Timestamps older than that say nothing (RFC 7323, section 5.5).
const TIMESTAMPS_COUNT: Duration = Duration::from_secs(24 * 86_400);

impl Connection {
    /// Takes a segment in that is for this connection: the owner has looked at its addresses.
    pub fn handle_segment(&mut self, now: Instant, segment: &Segment<'_>) {
        match self.state {
            State::Closed => self.replies.extend(segment.refusal(self.config.ttl)),
            State::SynSent => self.handle_in_syn_sent(now, segment),
            State::TimeWait => self.handle_in_time_wait(now, segment),
            State::SynReceived | State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck => {
                self.handle_synchronised(now, segment)
            }
        }
    }

    fn handle_synchronised(&mut self, now: Instant, segment: &Segment<'_>) {
        let start = extend(segment.sequence, self.receive.next);
        if !self.answers_own_syn(segment, start) && !self.is_valid(now, segment, start) {
            return;
        }
        if !segment.flags.has(Flags::ACK) {
            return;
        }
        self.counters.probes = 0;
        self.receive.last_heard = now;
        self.restart_keepalive(now);
        if let (Some((value, _)), true) = (segment.options.timestamps, self.receive.has_timestamps)
            && start <= self.receive.acked
        {
            self.receive.recent = Some((value, now));
        }
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
            // The FIN again: its acknowledgement was lost.
            self.receive.ack_now = true;
        }
    }

    /// Both ends opened at once, and this is the answer to this end's SYN: its own SYN again, and an ACK that counts.
    fn answers_own_syn(&self, segment: &Segment<'_>, start: Position) -> bool {
        self.state == State::SynReceived
            && segment.flags.has(Flags::SYN | Flags::ACK)
            && start + 1 == self.receive.next
            && extend(segment.acknowledgement, self.send.una) == self.send.next
    }

    /// Timestamps, window, RST and SYN. What does not count is answered as it must be.
    fn is_valid(&mut self, now: Instant, segment: &Segment<'_>, start: Position) -> bool {
        let end = start + segment.sequence_length() as u64;
        let is_reset = segment.flags.has(Flags::RST);
        if !is_reset && self.is_old(now, segment) {
            self.answer_out_of_window(now, segment, start, end);
            return false;
        }
        if end < self.receive.acked || start > self.receive.edge.max(self.receive.next) {
            if self.state == State::SynReceived && segment.flags.has(Flags::SYN) {
                self.repeat_syn(now);
            } else if !is_reset {
                self.answer_out_of_window(now, segment, start, end);
            }
            return false;
        }
        if is_reset {
            if start == self.receive.next {
                self.be_reset();
            } else {
                self.challenge(now);
            }
            return false;
        }
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

    /// This end's SYN again: the peer has not heard it.
    pub(super) fn repeat_syn(&mut self, now: Instant) {
        let answer = self.build_syn(now);
        self.replies.push_back(answer);
    }

    /// Protection against wrapped sequence numbers (RFC 7323, section 5).
    fn is_old(&self, now: Instant, segment: &Segment<'_>) -> bool {
        let (Some((value, _)), Some((recent, at))) = (segment.options.timestamps, self.receive.recent) else { return false };
        let behind = recent.wrapping_sub(value);
        // A pure acknowledgement that was overtaken by one of the same kind is harmless, and lost if refused.
        let is_harmless = segment.sequence_length() == 0 && extend(segment.sequence, self.receive.next) == self.receive.next && behind < 1000;
        self.receive.has_timestamps && (1..1 << 31).contains(&behind) && !is_harmless && now.saturating_duration_since(at) < TIMESTAMPS_COUNT
    }

    /// A segment out of window is answered by the expected number, and a duplicate told of.
    fn answer_out_of_window(&mut self, now: Instant, segment: &Segment<'_>, start: Position, end: Position) {
        if segment.flags.has(Flags::SYN) {
            self.challenge(now);
        } else if segment.sequence_length() == 0 {
            self.answer_at_times(now);
        } else {
            if start < self.receive.next {
                self.tell_duplicate(start, end.min(self.receive.next));
            }
            self.receive.ack_now = true;
        }
    }

    /// A challenge ACK: the peer must know the sequence number (RFC 5961).
    pub(super) fn challenge(&mut self, now: Instant) {
        self.answer_at_times(now);
    }

    fn answer_at_times(&mut self, now: Instant) {
        if self.receive.challenged_at.is_none_or(|at| now.saturating_duration_since(at) >= BETWEEN_ANSWERS) {
            self.receive.challenged_at = Some(now);
            self.receive.ack_now = true;
        }
    }

    pub(super) fn tell_duplicate(&mut self, start: Position, end: Position) {
        self.receive.quick = self.config.quick_acks;
        self.receive.is_interactive = false;
        if self.receive.has_sack && start < end {
            self.receive.duplicate = Some((start, end));
        }
    }

    /// The peer has reset the connection. What has arrived can still be read.
    fn be_reset(&mut self) {
        let error = match self.state {
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
