//! What a connection tells about itself.

use super::Connection;
use crate::info::Info;

impl Connection {
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
