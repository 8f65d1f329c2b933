//! The end of a connection.

use cohaptic_units::Instant;

use super::Connection;
use crate::info::State;
use crate::segment::{Flags, Segment};
use crate::sequence::extend;

impl Connection {
    /// Shuts the sending half: a FIN follows the data. The peer may send on. Again, or after the end, it does nothing.
    pub fn shutdown(&mut self) {
        if self.send.is_shut || matches!(self.state, State::Closed | State::TimeWait) {
            return;
        }
        self.send.is_shut = true;
        self.state = match self.state {
            State::Established => State::FinWait1,
            State::CloseWait => State::LastAck,
            other @ (State::SynSent
            | State::SynReceived
            | State::FinWait1
            | State::FinWait2
            | State::Closing
            | State::LastAck
            | State::TimeWait
            | State::Closed) => other,
        };
    }

    /// The program drops the connection: a FIN follows the data, and data that arrives later is answered by a RST. If there is data that was not read, the
    /// connection is reset at once, as in Linux.
    pub fn close(&mut self, now: Instant) {
        if self.is_orphan {
            return;
        }
        self.is_orphan = true;
        match self.state {
            State::SynSent => self.die(None),
            _ if self.receive.assembler.unread() > 0 => self.abort(),
            State::SynReceived => self.abort(),
            State::FinWait2 => self.linger_until = Some(now.saturating_add(self.config.time_wait)),
            State::Established | State::FinWait1 | State::CloseWait | State::Closing | State::LastAck | State::TimeWait | State::Closed => {
                self.shutdown()
            }
        }
    }

    /// Resets the connection: what was not sent is lost, and the peer hears of it by a RST. This is `SO_LINGER` with zero seconds.
    pub fn abort(&mut self) {
        if matches!(
            self.state,
            State::SynReceived | State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck
        ) {
            let reset = self.build_reset();
            self.replies.push_back(reset);
        }
        if self.state != State::TimeWait {
            self.die(None);
        }
    }

    /// What follows when the FIN is acknowledged.
    pub(super) fn advance_close(&mut self, now: Instant) {
        if !self.send.is_all_acked() {
            return;
        }
        match self.state {
            State::FinWait1 => {
                self.state = State::FinWait2;
                if self.is_orphan {
                    self.linger_until = Some(now.saturating_add(self.config.time_wait));
                }
            }
            State::Closing => self.enter_time_wait(now),
            State::LastAck => self.die(None),
            State::SynSent | State::SynReceived | State::Established | State::FinWait2 | State::CloseWait | State::TimeWait | State::Closed => {}
        }
    }

    pub(super) fn enter_time_wait(&mut self, now: Instant) {
        self.state = State::TimeWait;
        (self.timer, self.keepalive_at, self.receive.ack_at) = (None, None, None);
        self.linger_until = Some(now.saturating_add(self.config.time_wait));
    }

    /// A late segment (RFC 9293, section 3.10.7.4, TIME-WAIT).
    pub(super) fn handle_in_time_wait(&mut self, now: Instant, segment: &Segment<'_>) {
        if self.time_wait_ends().is_some_and(|end| now >= end) {
            self.die(None);
            self.replies.extend(segment.refusal(self.config.ttl));
        } else if segment.flags.has(Flags::RST) {
            if extend(segment.sequence, self.receive.next) == self.receive.next {
                self.die(None);
            }
        } else if segment.sequence_length() > 0 {
            self.receive.ack_now = true;
            if segment.flags.has(Flags::FIN) {
                self.linger_until = Some(now.saturating_add(self.config.time_wait));
            }
        }
    }

    /// When TIME-WAIT is over; `None` in other states. Nothing is seen of it, so an owner may leave it out of its timers and look when the addresses are
    /// wanted again.
    #[must_use]
    pub fn time_wait_ends(&self) -> Option<Instant> {
        self.linger_until.filter(|_| self.state == State::TimeWait)
    }

    /// Whether a SYN that arrives in TIME-WAIT may open a new connection at once: its sequence number or its timestamp is beyond the last one
    /// (RFC 6191).
    #[must_use]
    pub fn gives_way_to(&self, syn: &Segment<'_>) -> bool {
        let is_syn = syn.flags.has(Flags::SYN) && !syn.flags.has(Flags::RST) && !syn.flags.has(Flags::ACK);
        let is_beyond = extend(syn.sequence, self.receive.next) > self.receive.next;
        let is_later = match (syn.options.timestamps, self.receive.recent) {
            (Some((value, _)), Some((recent, _))) => (1..1 << 31).contains(&value.wrapping_sub(recent)),
            _ => false,
        };
        self.state == State::TimeWait && is_syn && (is_beyond || is_later)
    }
}
