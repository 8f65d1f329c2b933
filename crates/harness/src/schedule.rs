//! Schedule of the ticks of peers.

use std::time::Duration;

use cohaptic_peer::Clock;
use cohaptic_units::Instant;
use cohaptic_wan::{Event, EventQueue};

use crate::plan::Ticking;

/// Instants of the scene at which peers tick.
#[derive(Clone, Debug)]
pub(crate) enum Schedule {
    /// All peers tick together, every `nanos` nanoseconds, which is the span `span`, next at `next`.
    Lockstep { nanos: u64, span: Duration, next: Instant },
    /// An event for the next tick of each peer.
    EventDriven(Box<EventQueue<Tick>>),
}

/// Next tick of a peer. Simultaneous ticks are ordered by peer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tick {
    at: Instant,
    peer: usize,
}

impl Event for Tick {
    type Key = (Instant, usize);

    fn at(&self) -> Instant {
        self.at
    }

    fn key(&self) -> Self::Key {
        (self.at, self.peer)
    }
}

impl Schedule {
    /// Returns the schedule of peers with the given indices and clocks. In lockstep there must be at least one.
    pub(crate) fn new<'a>(ticking: Ticking, clocks: impl IntoIterator<Item = (usize, &'a Clock)>) -> Self {
        let mut clocks = clocks.into_iter();
        match ticking {
            Ticking::Lockstep => {
                // In lockstep all clocks are equal, so the clock of the first peer is enough. No run is as long as the longest tick of 64 bits.
                let nanos = clocks.next().and_then(|(_, clock)| u64::try_from(clock.tick.as_nanos()).ok()).unwrap_or(u64::MAX);
                Self::Lockstep { nanos, span: Duration::from_nanos(nanos), next: Instant::ZERO }
            }
            Ticking::EventDriven => {
                let mut queue = EventQueue::new();
                for (peer, clock) in clocks {
                    if let Some(at) = clock.instant(0) {
                        // A clock whose first tick is beyond the range of instants never ticks.
                        queue.push(Tick { at, peer });
                    }
                }
                Self::EventDriven(Box::new(queue))
            }
        }
    }

    /// Returns the next instant at which any peer ticks; `None` beyond the range of instants.
    #[inline(always)]
    pub(crate) fn next_instant(&self) -> Option<Instant> {
        match self {
            Self::Lockstep { next, .. } => Some(*next),
            Self::EventDriven(queue) => queue.next_at(),
        }
    }

    /// Replaces `peers` by the peers that tick at `at`, in order. In lockstep `peers` stays unchanged. [`Schedule::tick_again`] must follow for each of them.
    #[inline(always)]
    pub(crate) fn take(&mut self, at: Instant, peers: &mut Vec<usize>) {
        if let Self::EventDriven(queue) = self {
            peers.clear();
            // Simultaneous ticks leave the queue in the order of the peers.
            while let Some(tick) = queue.pop_due(at) {
                peers.push(tick.peer);
            }
        }
    }

    /// Lets all peers tick a period after `now`, and returns the period \[ns\] and as a span, if the peers tick in lockstep.
    #[inline(always)]
    pub(crate) fn tick_together(&mut self, now: Instant) -> Option<(u64, Duration)> {
        let Self::Lockstep { nanos, span, next } = self else { return None };
        *next = now.saturating_add_nanos(*nanos);
        Some((*nanos, *span))
    }

    pub(crate) fn tick_again(&mut self, peer: usize, at: Option<Instant>) {
        // In lockstep all peers share one next instant, so a single peer changes nothing.
        if let (Self::EventDriven(queue), Some(at)) = (self, at) {
            queue.push(Tick { at, peer });
        }
    }
}
