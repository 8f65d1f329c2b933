//! Counters of one link.

use core::time::Duration;

use crate::DropCause;

/// What one link did so far. At every instant `offered + duplicated = delivered + dropped + in flight`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LinkStats {
    pub(crate) offered: u64,
    pub(crate) delivered: u64,
    pub(crate) delay_nanos: u128,
    pub(crate) dropped: [u64; DropCause::ALL.len()],
}

impl LinkStats {
    /// Packets handed to the link.
    #[must_use]
    pub const fn offered(&self) -> u64 {
        self.offered
    }

    /// Extra copies that the link made. No impairment makes any yet.
    #[must_use]
    pub const fn duplicated(&self) -> u64 {
        0
    }

    /// Packets that came out of the far end.
    #[must_use]
    pub const fn delivered(&self) -> u64 {
        self.delivered
    }

    /// Packets dropped for this reason.
    #[must_use]
    pub const fn dropped(&self, cause: DropCause) -> u64 {
        self.dropped[cause.index()]
    }

    /// Packets dropped for any reason.
    #[must_use]
    pub fn dropped_in_all(&self) -> u64 {
        self.dropped.iter().sum()
    }

    /// Packets inside the link: waiting, being serialised or propagating.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.offered + self.duplicated() - self.delivered - self.dropped_in_all()
    }

    /// The mean time a delivered packet spent in the link, rounded down to a nanosecond; `None` before the first delivery.
    #[must_use]
    pub fn mean_delay(&self) -> Option<Duration> {
        let mean = self.delay_nanos.checked_div(u128::from(self.delivered))?;
        Some(Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX)))
    }
}
