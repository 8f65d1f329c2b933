//! Packets that a program picks.

use alloc::sync::Arc;
use core::fmt;

use cohaptic_units::Instant;

use crate::packet::PacketInfo;

/// A packet as a filter sees it.
#[derive(Clone, Copy, Debug)]
pub struct Offered<'a, P> {
    /// The number of the packet on this link, from 0.
    pub sequence: u64,
    /// When it is offered.
    pub now: Instant,
    /// What the link knows of it.
    pub info: PacketInfo,
    /// What it carries.
    pub payload: &'a P,
}

/// A predicate on packets.
pub(crate) struct Filter<P>(Arc<Predicate<P>>);

type Predicate<P> = dyn Fn(&Offered<'_, P>) -> bool + Send + Sync;

impl<P> Filter<P> {
    pub(crate) fn new(drops: impl Fn(&Offered<'_, P>) -> bool + Send + Sync + 'static) -> Self {
        Self(Arc::new(drops))
    }

    pub(crate) fn drops(&self, packet: &Offered<'_, P>) -> bool {
        (self.0)(packet)
    }
}

impl<P> Clone for Filter<P> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<P> fmt::Debug for Filter<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Filter")
    }
}
