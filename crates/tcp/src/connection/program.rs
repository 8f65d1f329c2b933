//! What the program calls.

use cohaptic_units::Instant;

use super::Connection;
use crate::config::Keepalive;
use crate::error::Error;
use crate::info::State;

impl Connection {
    /// Reads what has arrived in order; zero octets when the peer has shut its half.
    ///
    /// # Errors
    ///
    /// [`Error::WouldBlock`] if nothing is there. Why the connection ended, after all that has arrived was read, and once; then zero octets.
    pub fn read(&mut self, to: &mut [u8]) -> Result<usize, Error> {
        if self.may_read(to)? {
            let count = self.receive.assembler.read(to);
            self.after_reading();
            return Ok(count);
        }
        Ok(0)
    }

    /// Reads without taking.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn peek(&mut self, to: &mut [u8]) -> Result<usize, Error> {
        if self.may_read(to)? { Ok(self.receive.assembler.peek(to)) } else { Ok(0) }
    }

    /// Whether there is something to read. `false`: zero octets are the answer.
    fn may_read(&mut self, to: &[u8]) -> Result<bool, Error> {
        if to.is_empty() {
            return Ok(false);
        }
        if self.receive.assembler.unread() > 0 {
            return Ok(true);
        }
        if self.receive.is_ended {
            return Ok(false);
        }
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        if self.state == State::Closed { Ok(false) } else { Err(Error::WouldBlock) }
    }

    /// Writes as much as the send buffer takes.
    ///
    /// # Errors
    ///
    /// [`Error::WouldBlock`] if it takes nothing, or the handshake is not over. Why the connection ended, once; then, and after
    /// [`shutdown`](Self::shutdown), [`Error::BrokenPipe`].
    pub fn write(&mut self, data: &[u8]) -> Result<usize, Error> {
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        match self.state {
            State::SynSent | State::SynReceived if !self.send.is_shut => return Err(Error::WouldBlock),
            State::Established | State::CloseWait => {}
            State::SynSent
            | State::SynReceived
            | State::FinWait1
            | State::FinWait2
            | State::Closing
            | State::LastAck
            | State::TimeWait
            | State::Closed => return Err(Error::BrokenPipe),
        }
        let count = data.len().min(self.room());
        if count == 0 && !data.is_empty() {
            return Err(Error::WouldBlock);
        }
        self.send.buffer.write(&data[..count]);
        Ok(count)
    }

    /// How much can be written. As in Linux, memory is asked for a segment at a time, and one that is begun is filled: else one in the middle of a stream would be small,
    /// and Nagle's algorithm would hold the last one back until that is answered.
    fn room(&self) -> usize {
        let room = self.send_capacity().saturating_sub(self.send.buffer.len());
        let unsent = usize::try_from(self.send.buffer.end().saturating_sub(self.send.next)).unwrap_or(usize::MAX);
        unsent.saturating_add(room).next_multiple_of(self.segment_size().max(1)) - unsent
    }

    /// What the send buffer holds \[byte\]: twice the congestion window, as Linux tunes it.
    fn send_capacity(&self) -> usize {
        let window = usize::try_from(self.congestion.window).unwrap_or(usize::MAX);
        window.saturating_mul(2 * self.send.mss).max(self.config.least_send_buffer).min(self.config.send_buffer)
    }

    /// Whether [`read`](Self::read) would not block.
    #[must_use]
    pub fn is_readable(&self) -> bool {
        self.receive.assembler.unread() > 0 || self.receive.is_ended || self.error.is_some() || self.state == State::Closed
    }

    /// Whether a program that waits to write is to be woken: [`write`](Self::write) would not block, and a third of the buffer is free, as in Linux.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        let used = self.send.buffer.len();
        match self.state {
            State::SynSent | State::SynReceived => self.error.is_some() || self.send.is_shut,
            State::Established | State::CloseWait => self.error.is_some() || self.send_capacity().saturating_sub(used) >= (used / 2).max(1),
            State::FinWait1 | State::FinWait2 | State::Closing | State::LastAck | State::TimeWait | State::Closed => true,
        }
    }

    /// Whether the peer has shut its half and all before was read, or the connection is gone.
    #[must_use]
    pub fn is_read_closed(&self) -> bool {
        self.receive.is_ended || self.state == State::Closed
    }

    /// Whether nothing can be written any more.
    #[must_use]
    pub fn is_write_closed(&self) -> bool {
        !matches!(self.state, State::SynSent | State::SynReceived | State::Established | State::CloseWait)
    }

    /// Takes the pending error, as `SO_ERROR` does.
    pub const fn take_error(&mut self) -> Option<Error> {
        self.error.take()
    }

    /// The pending error, which stays.
    #[must_use]
    pub const fn error(&self) -> Option<Error> {
        self.error
    }

    /// Whether small segments leave while others are unanswered (`TCP_NODELAY`).
    pub const fn set_nodelay(&mut self, nodelay: bool) {
        self.config.nodelay = nodelay;
    }

    /// Whether small segments leave while others are unanswered.
    #[must_use]
    pub const fn nodelay(&self) -> bool {
        self.config.nodelay
    }

    /// Acknowledges at once from now on, or lets acknowledgements wait (`TCP_QUICKACK`). As in Linux, it does not stay so.
    pub fn set_quickack(&mut self, quickack: bool) {
        self.receive.is_interactive = !quickack;
        if quickack {
            self.receive.quick = self.receive.quick.max(self.config.quick_acks);
            self.receive.ack_now |= self.receive.ack_at.is_some();
        }
    }

    /// Whether acknowledgements leave at once now.
    #[must_use]
    pub const fn quickack(&self) -> bool {
        !self.receive.is_interactive
    }

    /// Probes the peer while the connection is idle (`SO_KEEPALIVE`, `TCP_KEEPIDLE`, `TCP_KEEPINTVL`, `TCP_KEEPCNT`), or does not.
    pub fn set_keepalive(&mut self, now: Instant, keepalive: Option<Keepalive>) {
        self.config.keepalive = keepalive;
        self.counters.probes = 0;
        self.restart_keepalive(now);
    }

    /// How long data may stay unanswered (`TCP_USER_TIMEOUT`); `None`: as the configuration counts retries.
    pub const fn set_user_timeout(&mut self, timeout: Option<core::time::Duration>) {
        self.config.user_timeout = timeout;
    }

    /// Sets the time to live of segments from now on.
    pub const fn set_ttl(&mut self, ttl: u8) {
        self.config.ttl = ttl;
    }

    /// The configuration, with what was set since.
    #[must_use]
    pub const fn config(&self) -> &crate::TcpConfig {
        &self.config
    }
}
