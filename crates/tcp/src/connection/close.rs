//! End of a connection: the program's calls, the passage through the closing states, and TIME-WAIT.

use cohaptic_units::Instant;

use super::Connection;
use crate::info::State;
use crate::segment::{Flags, Segment};
use crate::sequence::extend;

impl Connection {
    /// Shuts the sending half, so that a FIN follows the data. The peer may continue to send. A second call, or a call after the end, does nothing.
    pub fn shutdown(&mut self) {
        if self.send.is_shut || matches!(self.state, State::Closed | State::TimeWait) {
            return;
        }
        self.send.is_shut = true;
        self.state = match self.state {
            State::Established => State::FinWait1,
            State::CloseWait => State::LastAck,
            // During the handshake the state stays: `establish` sees `is_shut` and goes to FIN-WAIT-1.
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

    /// Closes the connection, because the program drops its end. A FIN follows the data, and later data of the peer is answered by a RST. If there is unread
    /// data, the connection is reset at once, as in Linux. A second call does nothing.
    pub fn close(&mut self, now: Instant) {
        if self.is_orphan {
            return;
        }
        self.is_orphan = true;
        match self.state {
            State::SynSent => self.die(None),
            // The reset tells the peer that its data was lost, although this end has acknowledged the data.
            _ if self.receive.assembler.unread() > 0 => self.abort(),
            State::SynReceived => self.abort(),
            // The peer may never shut its half, and no program is left to wait for the peer.
            State::FinWait2 => self.linger_until = Some(now.saturating_add(self.config.time_wait)),
            State::Established | State::FinWait1 | State::CloseWait | State::Closing | State::LastAck | State::TimeWait | State::Closed => {
                self.shutdown()
            }
        }
    }

    /// Resets the connection. Unsent data is lost, and a RST tells the peer. Corresponds to closing with `SO_LINGER` of zero seconds.
    pub fn abort(&mut self) {
        if matches!(
            self.state,
            State::SynReceived | State::Established | State::FinWait1 | State::FinWait2 | State::CloseWait | State::Closing | State::LastAck
        ) {
            self.is_reset_due = true;
        }
        // TIME-WAIT stays, because its purpose is to keep late segments away from the next connection with these addresses.
        if self.state != State::TimeWait {
            self.die(None);
        }
    }

    /// Goes to the next closing state if the FIN is acknowledged.
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

    /// Enters TIME-WAIT. All deadlines but its end are removed.
    pub(super) fn enter_time_wait(&mut self, now: Instant) {
        self.state = State::TimeWait;
        (self.timer, self.keepalive_at, self.receive.ack_at) = (None, None, None);
        self.linger_until = Some(now.saturating_add(self.config.time_wait));
    }

    /// Handles a segment that arrives in TIME-WAIT (RFC 9293, section 3.10.7.4).
    pub(super) fn handle_in_time_wait(&mut self, now: Instant, segment: &Segment<'_>) {
        // The owner may leave the end of TIME-WAIT out of its timers, so the end is checked here as well.
        if self.time_wait_ends().is_some_and(|end| now >= end) {
            self.die(None);
            self.replies.extend(segment.refusal(self.config.ttl));
        } else if segment.flags.has(Flags::RST) {
            // Only a reset at exactly the expected number ends TIME-WAIT. A stray reset cannot.
            if extend(segment.sequence, self.receive.next) == self.receive.next {
                self.die(None);
            }
        } else if segment.sequence_length() > 0 {
            self.receive.ack_now = true;
            // A repeated FIN means a lost acknowledgement, so TIME-WAIT begins anew.
            if segment.flags.has(Flags::FIN) {
                self.linger_until = Some(now.saturating_add(self.config.time_wait));
            }
        }
    }

    /// Returns the end of TIME-WAIT, or `None` in other states. Neither the peer nor the program notices this end, so an owner may leave the end out of the
    /// timers, and check the end when a new connection needs the addresses.
    #[must_use]
    pub fn time_wait_ends(&self) -> Option<Instant> {
        self.linger_until.filter(|_| self.state == State::TimeWait)
    }

    /// Returns whether the connection is in TIME-WAIT and `syn` may open a new connection at once, because the sequence number or the timestamp of `syn` is
    /// beyond the last number or timestamp of the peer (RFC 6191).
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
