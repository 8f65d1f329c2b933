//! Figures achieved by a link, with their uncertainty.
//!
//! All figures are defined in the literature, and have a standard error or an interval if a textbook gives one. The errors of means, proportions (Wilson)
//! and quantiles (order statistics) take the correlation between packets from batch means.
//!
//! | figure | definition |
//! | --- | --- |
//! | delay | arrival of the first copy − sending (RFC 7679). A damaged packet counts as arrived, unlike in the RFC, because the packet occupies the link |
//! | loss | share of packets without an arrived copy (RFC 7680) |
//! | loss run, gap | packets lost, or received, in a row in the order of sending (RFC 3357: loss period) |
//! | reordered | share of received packets that arrive after a packet sent later (RFC 4737, Type-P-Reordered by `NextExp`) |
//! | extent | number of arrivals from the first packet sent later to the reordered packet (RFC 4737, section 4.2) |
//! | duplicated | arrived extra copies divided by packets received (RFC 5560) |
//! | jitter | smoothed difference of successive transit times (RFC 3550, section 6.4.1) |
//! | throughput | bits of all arrivals after the first, divided by the time from the first to the last arrival |
//!
//! Packets on the way count as offered, and are left out of all other figures.

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

/// Figures of a link.
///
/// Serialises to a flat object in SI units: `mean_s`, `sd_s`, `loss`, `reordered` and so on. [`FateCounts`] is serialised separately. Undefined figures,
/// such as a mean of no values, are left out.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Achieved {
    /// Number of packets by fate.
    #[serde(skip)]
    pub fates: FateCounts,
    /// Figures of delays; `None` if no packet arrived.
    #[serde(flatten)]
    pub delay: Option<DelayFigures>,
    /// Figures of losses.
    #[serde(flatten)]
    pub loss: LossFigures,
    /// Figures of the order of arrivals.
    #[serde(flatten)]
    pub order: OrderFigures,
    /// Arrived extra copies divided by packets received; `None` if no packet arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duplicated: Option<f64>,
    /// Throughput \[bit/s\]: bits of all arrivals after the first, divided by the time since the first arrival. The first arrival only marks the beginning
    /// of that time. `None` if all arrivals have the same instant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub throughput_bit_s: Option<f64>,
    /// Jitter after the last arrival \[s\]: J ← J + (|D| − J)/16, with D the difference of transit times between a packet and the arrival before (RFC 3550,
    /// section 6.4.1). Extra copies are ignored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter_rfc3550_s: Option<f64>,
}

/// Number of packets by fate: `offered + duplicated = delivered + dropped + in_flight`.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct FateCounts {
    /// Packets handed to the link.
    pub offered: u64,
    /// Copies made by the link.
    pub duplicated: u64,
    /// Arrivals, copies included.
    pub delivered: u64,
    /// Drops by the name of their cause, copies included. All causes are present.
    pub dropped: BTreeMap<&'static str, u64>,
    /// Packets and copies without a final fate.
    pub in_flight: u64,
    /// Arrivals marked with "congestion experienced".
    pub marked: u64,
    /// Arrivals with flipped bits.
    pub damaged: u64,
}

impl Achieved {
    /// Computes the figures of records in any order. Records of the same instant count in the given order.
    #[must_use]
    pub fn of<'a>(records: impl IntoIterator<Item = &'a PacketRecord>) -> Self {
        let mut records: Vec<&PacketRecord> = records.into_iter().collect();
        records.sort_by_key(|record| record.at);
        let mut accumulator = Accumulator::new();
        for record in records {
            // The records are sorted by time, so none is refused.
            let _ = accumulator.record(record);
        }
        accumulator.finish()
    }
}

#[cfg(test)]
mod tests;
