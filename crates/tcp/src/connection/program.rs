//! Calls of the program: reading, writing and socket options. No call blocks.

use cohaptic_units::Instant;

use super::{Calls, Connection};
use crate::config::Keepalive;
use crate::error::Error;
use crate::info::State;
use crate::memory;

/// Segments for which the send buffer has room at least (`TCP_INIT_CWND`).
const LEAST_SEGMENTS: usize = 10;

impl Connection {
    /// Reads data that has arrived in order into `to`. Returns the number of octets, which is zero if `to` is empty, or at the end of the peer's data.
    ///
    /// # Errors
    ///
    /// [`Error::WouldBlock`] if no data has arrived yet. After all arrived data was read, the reason for the end of the connection, once. Later calls return
    /// zero octets.
    pub fn read(&mut self, to: &mut [u8]) -> Result<usize, Error> {
        if self.may_read(to)? {
            let count = self.receive.assembler.read(to);
            self.calls.has_read = true;
            return Ok(count);
        }
        Ok(0)
    }

    /// Copies data that has arrived in order into `to`, like [`read`](Self::read), but leaves the data in the buffer.
    ///
    /// # Errors
    ///
    /// The errors of [`read`](Self::read).
    pub fn peek(&mut self, to: &mut [u8]) -> Result<usize, Error> {
        if self.may_read(to)? { Ok(self.receive.assembler.peek(to)) } else { Ok(0) }
    }

    /// Returns whether there is data to read. If not, `read` returns zero octets.
    fn may_read(&mut self, to: &[u8]) -> Result<bool, Error> {
        if to.is_empty() {
            return Ok(false);
        }
        // Arrived data comes before the error, so that a reset does not take data from the program.
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

    /// Writes octets of `data` into the send buffer. Returns the number of octets written, which may be smaller than the length of `data`.
    ///
    /// # Errors
    ///
    /// [`Error::WouldBlock`] if the send buffer is full, or the handshake is not over. The reason for the end of the connection, once. Afterwards, and after
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
        self.note_write(count);
        self.send.buffer.write(&data[..count]);
        self.calls.has_written |= self.send.board.is_empty();
        Ok(count)
    }

    /// Handles the effects of the program's calls that need the time.
    pub(super) fn follow_up_calls(&mut self, now: Instant) {
        let Calls { has_read, has_written } = core::mem::take(&mut self.calls);
        if has_read {
            self.after_reading(now);
        }
        if has_written {
            self.end_pause(now);
        }
    }

    /// Shrinks the congestion window after a long pause, because the window says nothing about the path any more. As in Linux, a pause ends when the program
    /// writes or when the peer's window changes, and not when data leaves.
    pub(super) fn end_pause(&mut self, now: Instant) {
        if self.config.slow_start_after_idle {
            let (idle, threshold) = (now.saturating_duration_since(self.send.last_data_at), self.current_threshold());
            self.congestion.rest(idle, self.round_trips.timeout(), threshold);
        }
    }

    /// Returns the octets that can be written. As in Linux, the room is rounded up so that the unsent data ends with a full segment. Otherwise a small segment
    /// could leave in the middle of a stream, and Nagle's algorithm would hold back the last segment until the small segment is acknowledged.
    fn room(&self) -> usize {
        let room = self.send.capacity.saturating_sub(self.send.buffer.len());
        let unsent = usize::try_from(self.send.buffer.end().saturating_sub(self.send.next)).unwrap_or(usize::MAX);
        unsent.saturating_add(room).next_multiple_of(self.segment_size().max(1)) - unsent
    }

    /// Enlarges the send buffer to the memory of twice the congestion window, within the bounds of the configuration.
    pub(super) fn expand_send_buffer(&mut self) {
        let segments = usize::try_from(self.congestion.window).unwrap_or(usize::MAX).max(LEAST_SEGMENTS);
        let wanted = segments.saturating_mul(2 * memory::of_sent(self.send.mss));
        self.send.capacity = self.send.capacity.max(wanted.clamp(self.config.least_send_buffer, self.config.send_buffer));
    }

    /// Returns whether [`read`](Self::read) would not block.
    #[must_use]
    pub fn is_readable(&self) -> bool {
        self.receive.assembler.unread() > 0 || self.receive.is_ended || self.error.is_some() || self.state == State::Closed
    }

    /// Returns whether a program that waits to write should be woken: [`write`](Self::write) would not block, and a third of the send buffer is free, as in
    /// Linux.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        let used = self.send.buffer.len();
        match self.state {
            State::SynSent | State::SynReceived => self.error.is_some() || self.send.is_shut,
            // Free room of at least half of the used room is a third of the whole buffer.
            State::Established | State::CloseWait => self.error.is_some() || self.send.capacity.saturating_sub(used) >= (used / 2).max(1),
            State::FinWait1 | State::FinWait2 | State::Closing | State::LastAck | State::TimeWait | State::Closed => true,
        }
    }

    /// Returns whether no more data will arrive: the peer's FIN and all data before the FIN have arrived, or the connection has ended. Arrived data may still
    /// be unread.
    #[must_use]
    pub fn is_read_closed(&self) -> bool {
        self.receive.is_ended || self.state == State::Closed
    }

    /// Returns whether nothing can be written any more, because this half is shut or the connection has ended.
    #[must_use]
    pub fn is_write_closed(&self) -> bool {
        !matches!(self.state, State::SynSent | State::SynReceived | State::Established | State::CloseWait)
    }

    /// Returns the pending error and clears it, as `SO_ERROR` does.
    pub const fn take_error(&mut self) -> Option<Error> {
        self.error.take()
    }

    /// Returns the pending error without clearing it.
    #[must_use]
    pub const fn error(&self) -> Option<Error> {
        self.error
    }

    /// Switches Nagle's algorithm off (`true`) or on (`TCP_NODELAY`).
    pub const fn set_nodelay(&mut self, nodelay: bool) {
        self.config.nodelay = nodelay;
    }

    /// Returns whether Nagle's algorithm is off.
    #[must_use]
    pub const fn nodelay(&self) -> bool {
        self.config.nodelay
    }

    /// Lets acknowledgements wait for data to travel with (`false`), or not (`true`), and then sends an acknowledgement that waits (`TCP_QUICKACK`). As in
    /// Linux, the setting is not permanent, because later traffic changes it, and promises nothing about later acknowledgements.
    pub fn set_quickack(&mut self, quickack: bool) {
        self.receive.is_interactive = !quickack;
        if quickack && self.receive.ack_at.is_some() {
            // An acknowledgement that waits already leaves now, as after reading (`tcp_cleanup_rbuf`).
            let unacked = usize::try_from(self.receive.next - self.receive.acked).unwrap_or(usize::MAX);
            self.receive.ack_now |= unacked > self.receive.segment || self.receive.assembler.unread() == 0;
        }
    }

    /// Returns whether acknowledgements may leave at once at present, as `TCP_QUICKACK` reports.
    #[must_use]
    pub const fn quickack(&self) -> bool {
        !self.receive.is_interactive
    }

    /// Sets the times of keep-alive probes (`SO_KEEPALIVE`, `TCP_KEEPIDLE`, `TCP_KEEPINTVL`, `TCP_KEEPCNT`). The idle time begins at `now`. `None` ends the
    /// probes.
    pub fn set_keepalive(&mut self, now: Instant, keepalive: Option<Keepalive>) {
        self.config.keepalive = keepalive;
        self.counters.probes = 0;
        self.restart_keepalive(now);
    }

    /// Sets the time for which data may stay unanswered (`TCP_USER_TIMEOUT`). `None` leaves the limit to the number of retries in the configuration.
    pub const fn set_user_timeout(&mut self, timeout: Option<core::time::Duration>) {
        self.config.user_timeout = timeout;
    }

    /// Sets the time to live, or hop limit, of later segments.
    pub const fn set_ttl(&mut self, ttl: u8) {
        self.config.ttl = ttl;
    }

    /// Returns the configuration, including later changes by the setters.
    #[must_use]
    pub const fn config(&self) -> &crate::TcpConfig {
        &self.config
    }
}
