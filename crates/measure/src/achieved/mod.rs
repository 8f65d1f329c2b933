//! The figures that a link achieved, to be compared with those asked for.
//!
//! Every figure is one that the literature defines, and has a standard error or an interval wherever there is a textbook one. Those of means, *proportions*
//! (Wilson) and *quantiles* (order statistics) take from batch means how much packets hang together.
//!
//! | what | definition |
//! | --- | --- |
//! | delay | arrival of the first copy − sending (RFC 7679); a damaged packet counts as arrived, unlike there, for it takes up the link |
//! | loss | the share of packets of which no copy arrived (RFC 7680) |
//! | loss run, gap | packets lost, or received, one after another in the order of sending (RFC 3357: loss period) |
//! | reordered | the share of received packets that arrive after one that was sent later (RFC 4737, Type-P-Reordered by `NextExp`) |
//! | extent | how many arrivals after the first such packet a reordered one comes (RFC 4737, section 4.2) |
//! | duplicated | extra copies that arrived, over packets received (RFC 5560) |
//! | jitter | the smoothed difference of successive transit times (RFC 3550, section 6.4.1) |
//! | throughput | the bits that arrived after the first arrival, over the time from the first to the last |
//!
//! Packets that are still on the way count as offered and are left out of every other figure.

mod accumulator;
mod delay;
mod loss;
mod order;

use std::collections::BTreeMap;

use cohaptic_wan::PacketRecord;
use serde::Serialize;

pub use accumulator::{Accumulator, RecordOutOfOrder};
pub use delay::DelayFigures;
pub use loss::LossFigures;
pub use order::OrderFigures;

/// The figures of one link.
///
/// Serialised, it is one flat object in SI units: `mean_s`, `sd_s`, `loss`, `reordered` and so on; [`FateCounts`] is serialised on its own. A figure
/// that is not defined (a mean of nothing) is left out.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Achieved {
    /// How often each fate befell.
    #[serde(skip)]
    pub fates: FateCounts,
    /// Delays; `None` if no packet arrived.
    #[serde(flatten)]
    pub delay: Option<DelayFigures>,
    /// Losses.
    #[serde(flatten)]
    pub loss: LossFigures,
    /// The order of arrivals.
    #[serde(flatten)]
    pub order: OrderFigures,
    /// Extra copies that arrived, over packets received.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duplicated: Option<f64>,
    /// Throughput \[bit/s\]: the bits of all copies that arrived after the first, over the time since the first. The first marks the beginning, so that
    /// its bits do not count. `None` unless there are two instants of arrival.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub throughput_bit_s: Option<f64>,
    /// Jitter after the last arrival \[s\]: J ← J + (|D| − J)/16 with D the difference of transit between a packet and the one that arrived before it
    /// (RFC 3550, section 6.4.1). Extra copies are passed over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter_rfc3550_s: Option<f64>,
}

/// How often each fate befell: `offered + duplicated = delivered + dropped + in flight`.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct FateCounts {
    /// Packets handed to the link.
    pub offered: u64,
    /// Copies made.
    pub duplicated: u64,
    /// Arrivals, copies included.
    pub delivered: u64,
    /// Drops by the name of their cause, copies included. Every cause is there.
    pub dropped: BTreeMap<&'static str, u64>,
    /// Packets and copies without an end.
    pub in_flight: u64,
    /// Arrivals marked with "congestion experienced".
    pub marked: u64,
    /// Arrivals with flipped bits.
    pub damaged: u64,
}

impl Achieved {
    /// The figures of these records, given in any order. Records of one instant are taken in the order in which they stand.
    #[must_use]
    pub fn of<'a>(records: impl IntoIterator<Item = &'a PacketRecord>) -> Self {
        let mut records: Vec<&PacketRecord> = records.into_iter().collect();
        records.sort_by_key(|record| record.at);
        let mut accumulator = Accumulator::new();
        for record in records {
            // They are sorted, so that none is refused.
            let _ = accumulator.record(record);
        }
        accumulator.finish()
    }
}

#[cfg(test)]
mod tests;
