//! Node of two tests: sends at most one packet, and notes an arrival.

use cohaptic_testkit::Instant;
use cohaptic_testkit::node::{Node, Packet, Transmit};

/// Node that sends at most once, at the beginning.
#[derive(Default)]
pub(crate) struct Once {
    sends: Option<Transmit>,
    /// Instant of the latest arrival.
    pub(crate) came: Option<Instant>,
}

impl Once {
    pub(crate) const fn sending(transmit: Transmit) -> Self {
        Self { sends: Some(transmit), came: None }
    }
}

impl Node for Once {
    fn handle_packet(&mut self, now: Instant, _packet: Packet) {
        self.came = Some(now);
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.sends.take()
    }
}
