//! Counters of a link.

use core::fmt;
use core::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::Counted;

use crate::fates::fate::DropCause;

/// Counters of a link. At every instant `offered + duplicated = delivered + dropped + in flight`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LinkStats {
    pub(crate) flow: Flow,
    pub(crate) seldom: Seldom,
    pub(crate) cross: CrossCounts,
}

/// Counters changed by every packet. Separate from the seldom counters, so the links of a large mesh touch little memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Flow {
    pub(crate) offered: u64,
    pub(crate) delivered: u64,
    /// Sum of the delays of delivered packets \[ns\]. Wider than 64 bits, so the sum of long runs does not overflow.
    pub(crate) delay_nanos: u128,
}

impl Flow {
    /// Counts a packet with the offer at `entered` and the departure from the far end at `at`.
    #[inline(always)]
    pub(crate) fn deliver(&mut self, entered: Instant, at: Instant) {
        self.delivered += 1;
        self.delay_nanos += u128::from(at.as_nanos() - entered.as_nanos());
    }

    /// Counts `packets` packets with the instants of [`Flow::deliver`].
    pub(crate) fn deliver_train(&mut self, packets: u64, entered: Instant, at: Instant) {
        self.delivered += packets;
        self.delay_nanos += u128::from(packets) * u128::from(at.as_nanos() - entered.as_nanos());
    }

    /// Counts a packet like [`Flow::deliver`] if the packet leaves the far end at or before `until`.
    #[inline(always)]
    pub(crate) fn deliver_by(&mut self, until: Instant, entered: Instant, at: Instant) {
        if at <= until {
            self.deliver(entered, at);
        }
    }

    /// Takes back the count of a packet from [`Flow::deliver`] with the same instants.
    pub(crate) fn forget(&mut self, entered: Instant, at: Instant) {
        self.delivered -= 1;
        self.delay_nanos -= u128::from(at.as_nanos() - entered.as_nanos());
    }
}

/// Counters changed by few packets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Seldom {
    pub(crate) duplicated: u64,
    pub(crate) marked: u64,
    pub(crate) damaged: u64,
    /// Dropped packets, indexed by [`DropCause::index`].
    pub(crate) dropped: [u64; DropCause::ALL.len()],
}

impl Seldom {
    /// Takes back the count of a packet dropped for the cause `dropped`, or, with `None`, the count of a marked packet.
    pub(crate) const fn take_back(&mut self, dropped: Option<DropCause>) {
        match dropped {
            Some(cause) => self.dropped[cause.index()] -= 1,
            None => self.marked -= 1,
        }
    }
}

/// Counts of cross packets up to the latest packet of the link at the queue.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CrossCounts {
    /// Cross packets offered to the queue.
    pub offered: u64,
    /// Cross packets dropped by the queue, for any cause.
    pub dropped: u64,
    /// Bytes of the offered cross packets, framing not counted.
    pub bytes: u64,
}

impl CrossCounts {
    /// Adds other counts `times` times.
    pub(crate) const fn add(&mut self, other: Self, times: u64) {
        self.offered += other.offered * times;
        self.dropped += other.dropped * times;
        self.bytes += other.bytes * times;
    }
}

impl fmt::Display for CrossCounts {
    /// Writes the counts in words: `1500 cross packets, 3 of them dropped`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} of them dropped", Counted(self.offered, "cross packet"), self.dropped)
    }
}

impl LinkStats {
    /// Returns counters counted elsewhere: offered packets, delivered packets, the sum of the delays of delivered packets \[ns\], and dropped packets per
    /// cause. Equal causes are added.
    #[must_use]
    pub fn counted(offered: u64, delivered: u64, delay_nanos: u128, dropped: impl IntoIterator<Item = (DropCause, u64)>) -> Self {
        let mut stats = Self { flow: Flow { offered, delivered, delay_nanos }, ..Self::default() };
        for (cause, count) in dropped {
            stats.seldom.dropped[cause.index()] += count;
        }
        stats
    }

    /// Adds the counters of `links` links with the counters `each`.
    pub fn add(&mut self, each: &Self, links: u64) {
        let Self { flow, seldom, cross } = self;
        cross.add(each.cross, links);
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

    /// Returns the number of packets offered to the link.
    #[must_use]
    pub const fn offered(&self) -> u64 {
        self.flow.offered
    }

    /// Returns the number of copies made by the link.
    #[must_use]
    pub const fn duplicated(&self) -> u64 {
        self.seldom.duplicated
    }

    /// Returns the number of packets beyond the far end, copies included.
    #[must_use]
    pub const fn delivered(&self) -> u64 {
        self.flow.delivered
    }

    /// Returns the number of packets, copies included, with a mark (congestion experienced) after the stages of this link. In a network, packets marked by an
    /// earlier line are not counted.
    #[must_use]
    pub const fn marked(&self) -> u64 {
        self.seldom.marked
    }

    /// Returns the number of packets, copies included, with flipped bits after the stages of this link, discarded by the receiver's checksum or not. In a
    /// network, packets damaged by an earlier line are not counted, nor damaged packets dropped by a later stage.
    #[must_use]
    pub const fn damaged(&self) -> u64 {
        self.seldom.damaged
    }

    /// Returns the number of packets dropped for the cause `cause`.
    #[must_use]
    pub const fn dropped(&self, cause: DropCause) -> u64 {
        self.seldom.dropped[cause.index()]
    }

    /// Returns the number of packets dropped for any cause.
    #[must_use]
    pub fn dropped_in_all(&self) -> u64 {
        self.seldom.dropped.iter().sum()
    }

    /// Returns the counts of the cross-traffic up to the latest packet of the link at the queue. Cross packets are in no other count.
    #[must_use]
    pub const fn cross_traffic(&self) -> CrossCounts {
        self.cross
    }

    /// Returns the number of packets inside the link: waiting, in transmission, or propagating.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.offered() + self.duplicated() - self.delivered() - self.dropped_in_all()
    }

    /// Returns the mean time of a delivered packet in the link, rounded down to a nanosecond, or `None` before the first delivery.
    #[must_use]
    pub fn mean_delay(&self) -> Option<Duration> {
        let mean = self.flow.delay_nanos.checked_div(u128::from(self.flow.delivered))?;
        Some(Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX)))
    }
}
