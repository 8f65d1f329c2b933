//! Traffic offered to the network by the peers.

use std::time::Duration;

use cohaptic_scene::Measure;

use super::{Accumulator, Asked, Rows};
use crate::SendRow;

/// Packets and bytes so far, with one packet for each receiver of a sample.
#[derive(Clone, Debug)]
pub(super) struct Traffic {
    packets: u64,
    bytes: u64,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Packets,
    Bits,
}

impl Accumulator for Traffic {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] = &[(Measure::PacketRate, Figure::Packets), (Measure::BitRate, Figure::Bits)];
    const ROWS: Rows = Rows { sends: true, ..Rows::NONE };

    fn new(_asked: &Asked<'_>) -> Self {
        Self { packets: 0, bytes: 0 }
    }

    fn on_send(&mut self, row: &SendRow) {
        self.packets += row.packets;
        self.bytes += row.packets * row.size.get();
    }

    fn value(&self, figure: Figure, _peer: Option<usize>, elapsed: Duration) -> Option<f64> {
        let sent = match figure {
            Figure::Packets => self.packets,
            Figure::Bits => 8 * self.bytes,
        };
        #[expect(clippy::cast_precision_loss, reason = "rounded once")]
        let sent = sent as f64;
        (!elapsed.is_zero()).then(|| sent / elapsed.as_secs_f64())
    }
}
