//! Calls for the state of a connection. The calls change nothing.

use super::Connection;
use super::acknowledge::DUPLICATES;
use crate::info::Info;
use crate::sequence::on_wire;

/// Most segments by which a reordering is reported, as in Linux (`tcp_max_reordering`).
const MOST_REORDERING: u32 = 300;

impl Connection {
    /// Returns whether only the peer's program can let this connection continue: data waits, the peer's window is closed, no segment is on the way, and the
    /// peer has answered a probe of the window.
    ///
    /// If this holds for every connection and no program waits for an instant, nothing will happen any more.
    #[must_use]
    pub fn is_held_by_window(&self) -> bool {
        let is_answered = self.counters.window_probes > 0 && self.counters.probes == 0;
        is_answered && self.send.board.is_empty() && self.send.has_new() && !self.is_window_open()
    }

    /// Returns whether keep-alive probes are the only thing that this connection waits for, and no probe is unanswered.
    #[must_use]
    pub const fn is_only_kept_alive(&self) -> bool {
        let is_idle = self.timer.is_none() && self.receive.ack_at.is_none() && self.linger_until.is_none();
        is_idle && self.keepalive_at.is_some() && self.counters.probes == 0
    }

    /// Returns the number of octets in the buffers: octets written and not acknowledged, and octets that have arrived, in order or not, and were not read.
    #[must_use]
    pub fn held(&self) -> usize {
        self.send.buffer.len() + self.receive.assembler.held()
    }

    /// Returns the sequence number of this end's SYN, and of the peer's SYN once that SYN has arrived. Tools need both to show relative sequence numbers.
    #[must_use]
    pub const fn initial_sequences(&self) -> (u32, Option<u32>) {
        (on_wire(self.send.first), self.receive.first)
    }

    /// Returns the number of bits by which the windows of this end's segments are shifted, apart from SYNs (RFC 7323, section 2).
    #[must_use]
    pub const fn window_shift(&self) -> u8 {
        self.receive.scale
    }

    /// Returns the figures of the connection, after the example of Linux's `TCP_INFO`.
    #[must_use]
    pub fn info(&self) -> Info {
        let board = &self.send.board;
        Info {
            state: self.state,
            srtt: self.round_trips.srtt(),
            rttvar: self.round_trips.variation(),
            least_rtt: self.round_trips.least(),
            timeout: self.round_trips.timeout(),
            congestion_window: self.congestion.window,
            slow_start_threshold: self.congestion.threshold,
            ca_state: self.recovery.phase,
            unacked: board.packets_out(),
            sacked: board.sacked_out,
            lost: board.lost_out,
            retrans: board.again_out,
            reordering: self.rack.degree.clamp(DUPLICATES, MOST_REORDERING),
            in_flight: board.in_flight(),
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

#[cfg(test)]
mod tests {
    use cohaptic_units::Instant;

    use crate::{Connection, TcpConfig};

    fn connection(config: TcpConfig) -> Connection {
        let address = "10.0.0.1:1".parse().unwrap();
        Connection::connect(Instant::ZERO, config, address, address, 0).unwrap()
    }

    /// Linux reports 3 until a reordering was seen (`tcp_reordering`), and 300 at most (`tcp_max_reordering`).
    #[test]
    fn the_reported_reordering_is_bounded() {
        let mut connection = connection(TcpConfig::default());
        let reported = [0, 3, 5, 300, 301].map(|degree| {
            connection.rack.degree = degree;
            connection.info().reordering
        });
        assert_eq!(reported, [3, 3, 5, 300, 300]);
    }

    /// `tcp_sndbuf_expand`: memory for twice the window, at least for ten segments, each of 2304 octets. The buffer never shrinks.
    #[test]
    fn the_send_buffer_follows_the_window_upwards() {
        let mut connection = connection(TcpConfig { least_send_buffer: 1, ..TcpConfig::default() });
        connection.send.mss = 1448;
        let sizes = [1, 10, 11, 100, 50, 10_000].map(|window| {
            connection.congestion.window = window;
            connection.expand_send_buffer();
            connection.send.capacity
        });
        assert_eq!(sizes, [46_080, 46_080, 50_688, 460_800, 460_800, 4 << 20]);
    }
}
