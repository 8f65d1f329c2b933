//! Counters of one link.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;

/// What one link did so far. At every instant `offered + duplicated = delivered + dropped + in flight`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LinkStats {
    pub(crate) flow: Flow,
    pub(crate) seldom: Seldom,
}

/// The counts of every packet. Apart, so that the links of a large mesh touch little memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Flow {
    pub(crate) offered: u64,
    pub(crate) delivered: u64,
    pub(crate) delay_nanos: u128,
}

impl Flow {
    /// Counts a packet that comes out of the far end after it has entered at `entered`.
    #[inline(always)]
    pub(crate) fn deliver(&mut self, entered: Instant, at: Instant) {
        self.delivered += 1;
        self.delay_nanos += u128::from(at.as_nanos() - entered.as_nanos());
    }

    /// [`Flow::deliver`], if it comes out by `until`.
    #[inline(always)]
    pub(crate) fn deliver_by(&mut self, until: Instant, entered: Instant, at: Instant) {
        if at <= until {
            self.deliver(entered, at);
        }
    }

    /// Takes back that such a packet came out.
    pub(crate) fn forget(&mut self, entered: Instant, at: Instant) {
        self.delivered -= 1;
        self.delay_nanos -= u128::from(at.as_nanos() - entered.as_nanos());
    }
}

/// The counts of some packets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Seldom {
    pub(crate) duplicated: u64,
    pub(crate) marked: u64,
    pub(crate) damaged: u64,
    pub(crate) dropped: [u64; DropCause::ALL.len()],
}

impl Seldom {
    /// Takes back that a packet was dropped for that cause, or that it was marked.
    pub(crate) const fn take_back(&mut self, dropped: Option<DropCause>) {
        match dropped {
            Some(cause) => self.dropped[cause.index()] -= 1,
            None => self.marked -= 1,
        }
    }
}

impl LinkStats {
    /// What was counted elsewhere: packets offered, delivered, and dropped for a cause; the delays of those delivered in all \[ns\].
    #[must_use]
    pub fn counted(offered: u64, delivered: u64, delay_nanos: u128, dropped: impl IntoIterator<Item = (DropCause, u64)>) -> Self {
        let mut stats = Self { flow: Flow { offered, delivered, delay_nanos }, seldom: Seldom::default() };
        for (cause, count) in dropped {
            stats.seldom.dropped[cause.index()] += count;
        }
        stats
    }

    /// Adds what a number of links did that each have these counters.
    pub fn add(&mut self, each: &Self, links: u64) {
        let Self { flow, seldom } = self;
        flow.offered += each.flow.offered * links;
        flow.delivered += each.flow.delivered * links;
        flow.delay_nanos += each.flow.delay_nanos * u128::from(links);
        seldom.duplicated += each.seldom.duplicated * links;
        seldom.marked += each.seldom.marked * links;
        seldom.damaged += each.seldom.damaged * links;
        for (total, count) in seldom.dropped.iter_mut().zip(each.seldom.dropped) {
            *total += count * links;
        }
    }

    /// Packets handed to the link.
    #[must_use]
    pub const fn offered(&self) -> u64 {
        self.flow.offered
    }

    /// Extra copies that the link made.
    #[must_use]
    pub const fn duplicated(&self) -> u64 {
        self.seldom.duplicated
    }

    /// Packets that came out of the far end, copies included.
    #[must_use]
    pub const fn delivered(&self) -> u64 {
        self.flow.delivered
    }

    /// Packets, copies included, that left the stages of this link with a mark (congestion experienced); in a network without those that a line before had marked.
    #[must_use]
    pub const fn marked(&self) -> u64 {
        self.seldom.marked
    }

    /// Packets, copies included, that left the stages of this link with flipped bits, whether or not the receiver's checksum discards them; in a network without
    /// those that a line before had damaged. Damaged packets that a later stage dropped are not counted.
    #[must_use]
    pub const fn damaged(&self) -> u64 {
        self.seldom.damaged
    }

    /// Packets dropped for this reason.
    #[must_use]
    pub const fn dropped(&self, cause: DropCause) -> u64 {
        self.seldom.dropped[cause.index()]
    }

    /// Packets dropped for any reason.
    #[must_use]
    pub fn dropped_in_all(&self) -> u64 {
        self.seldom.dropped.iter().sum()
    }

    /// Packets inside the link: waiting, being serialised or propagating.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.offered() + self.duplicated() - self.delivered() - self.dropped_in_all()
    }

    /// The mean time a delivered packet spent in the link, rounded down to a nanosecond; `None` before the first delivery.
    #[must_use]
    pub fn mean_delay(&self) -> Option<Duration> {
        let mean = self.flow.delay_nanos.checked_div(u128::from(self.flow.delivered))?;
        Some(Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX)))
    }
}
