//! What a connection tells about itself.

use super::Connection;
use crate::info::Info;
use crate::sequence::on_wire;

impl Connection {
    /// Whether data is left that only the peer's program can set free: the window is closed, and a probe was answered by that (nothing is on the way).
    ///
    /// An owner that sees this at every connection, while no program waits for time, knows that nothing will happen any more.
    #[must_use]
    pub fn is_held_by_window(&self) -> bool {
        let is_answered = self.counters.window_probes > 0 && self.counters.probes == 0;
        is_answered && self.send.board.is_empty() && self.send.has_new() && !self.is_window_open()
    }

    /// Whether nothing is left to do but to ask an idle peer whether it is there, and no such probe is unanswered.
    #[must_use]
    pub const fn is_only_kept_alive(&self) -> bool {
        let is_idle = self.timer.is_none() && self.receive.ack_at.is_none() && self.linger_until.is_none();
        is_idle && self.keepalive_at.is_some() && self.counters.probes == 0
    }

    /// How many octets the connection holds: those that were written and not acknowledged, and those that have arrived and were not read, in order or not.
    #[must_use]
    pub fn held(&self) -> usize {
        self.send.buffer.len() + self.receive.assembler.held()
    }

    /// The sequence numbers of the SYNs, this end's and the peer's, once that has come: for tools that show numbers counted from them.
    #[must_use]
    pub const fn initial_sequences(&self) -> (u32, Option<u32>) {
        (on_wire(self.send.first), self.receive.first)
    }

    /// By how many bits the windows of this end's segments are shifted, apart from SYNs (RFC 7323, section 2).
    #[must_use]
    pub const fn window_shift(&self) -> u8 {
        self.receive.scale
    }

    /// Figures, as of Linux's `TCP_INFO`.
    #[must_use]
    pub fn info(&self) -> Info {
        Info {
            state: self.state,
            srtt: self.round_trips.srtt(),
            rttvar: self.round_trips.variation(),
            least_rtt: self.round_trips.least(),
            timeout: self.round_trips.timeout(&self.config),
            congestion_window: self.congestion.window,
            slow_start_threshold: self.congestion.threshold,
            in_flight: self.send.board.in_flight(),
            retransmissions: self.counters.retransmissions,
            timeouts: self.counters.timeouts,
            recoveries: self.counters.recoveries,
            undone: self.counters.undone,
            segment_size: self.segment_size(),
            send_window: self.send.window,
            unacknowledged: self.send.buffer.len(),
            unread: self.receive.assembler.unread(),
            window_probes: self.counters.window_probes,
        }
    }
}
