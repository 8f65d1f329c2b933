//! Hand-over of packets that have arrived.

use core::ops::ControlFlow;

use super::id::Path;
use crate::fates::record::PacketEvent;

/// Receiver of the arrivals of [`Network::take_mere_arrivals`](super::Network::take_mere_arrivals). Each closure from an event to a [`ControlFlow`] is a
/// receiver.
///
/// The network hands over a packet at several places. A compiler calls a long closure there, and then computes every part of the event. A type of the driver
/// can mark its method `#[inline(always)]` instead.
pub trait TakeArrival<P> {
    /// Value of a break.
    type Break;

    /// Takes the event of an arrival. After a break no further event is handed over.
    fn take(&mut self, event: PacketEvent<P, Path>) -> ControlFlow<Self::Break>;
}

impl<P, B, F: FnMut(PacketEvent<P, Path>) -> ControlFlow<B>> TakeArrival<P> for F {
    type Break = B;

    #[inline(always)]
    fn take(&mut self, event: PacketEvent<P, Path>) -> ControlFlow<B> {
        self(event)
    }
}
