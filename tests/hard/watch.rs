//! Observers that are closures: what an hour of ticks says is looked at as it comes, and not kept.

use std::convert::Infallible;

use cohaptic_harness::{Observer, PacketRow, TickRow};

/// Sees every tick.
pub(crate) struct OnTick<F>(pub(crate) F);

/// Sees every packet.
pub(crate) struct OnPacket<F>(pub(crate) F);

impl<F: FnMut(&TickRow<'_>)> Observer for OnTick<F> {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        (self.0)(row);
        Ok(())
    }
}

impl<F: FnMut(&PacketRow)> Observer for OnPacket<F> {
    type Error = Infallible;

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        (self.0)(row);
        Ok(())
    }
}
