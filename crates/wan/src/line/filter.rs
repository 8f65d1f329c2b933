//! Filters: a program's predicates for packets to drop.

use alloc::sync::Arc;
use core::fmt;

use cohaptic_units::Instant;

use crate::packet::PacketInfo;

/// A packet as a filter sees it.
#[derive(Clone, Copy, Debug)]
pub struct Offered<'a, P> {
    /// Number of the packet on this link, from 0.
    pub sequence: u64,
    /// Instant of the packet's offer.
    pub now: Instant,
    /// Size and ECN capability of the packet.
    pub info: PacketInfo,
    /// Payload of the packet.
    pub payload: &'a P,
}

/// A predicate, true for packets to drop. Shared between clones of a line.
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
