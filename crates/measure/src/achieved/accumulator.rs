//! Collects records one by one, and computes figures from them.

use cohaptic_units::Instant;
use cohaptic_wan::{DropCause, Fate, PacketRecord};

use super::order::OrderOfArrival;
use super::{Achieved, DelayFigures, FateCounts, LossFigures};
use crate::series::count_u64;

/// Collects the records of a link in order of time, and returns its figures at any time.
///
/// Needs 17 bytes per packet, and 16 bytes for each break in the order of arrivals. [`Accumulator::finish`] needs about 48 bytes per packet more during the
/// call. [`Accumulator::of_first`] limits the number of packets.
#[derive(Clone, Debug, Default)]
pub struct Accumulator {
    /// Number of first packets with figures; later packets are only counted. `None` for all packets.
    most: Option<u64>,
    /// Number of packets after the first `most`.
    beyond: u64,
    /// History of packets, indexed by sequence number.
    packets: Vec<Packet>,
    counts: FateCounts,
    order: OrderOfArrival,
    /// Instant of the newest record.
    latest: Instant,
    first_arrival: Option<Instant>,
    last_arrival: Instant,
    /// Bytes of all arrivals after the first arrival.
    bytes_after_first: u128,
    /// Arrivals of packets with an earlier arrived copy.
    extra_copies: u64,
    jitter: Jitter,
}

/// History of a packet. The default is a packet without a record.
#[derive(Clone, Copy, Debug, Default)]
struct Packet {
    /// Delay of the first arrived copy \[ns\] plus one; 0 if none arrived. The shift saves the space of an `Option`.
    delay_plus_one: u64,
    /// Number of copies made minus number of ends.
    more_copies_than_ends: i32,
    known: bool,
}

/// Final knowledge about a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// The packet arrived, with the delay of its first arrived copy \[ns\].
    Received(u64),
    /// No copy arrived, and none is on the way.
    Lost,
    /// No copy arrived, but a copy may still arrive.
    OnTheWay,
}

/// A record was older than a record before. The record was not added.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a record of {at} came after one of {latest}: expected records in the order in which things happened")]
pub struct RecordOutOfOrder {
    /// Instant of the refused record.
    pub at: Instant,
    /// Instant of the newest record before.
    pub latest: Instant,
}

impl Accumulator {
    /// Creates an accumulator without records. All causes of drops are present with a count of zero.
    #[must_use]
    pub fn new() -> Self {
        let dropped = DropCause::ALL.into_iter().map(|cause| (cause.name(), 0)).collect();
        Self { counts: FateCounts { dropped, ..FateCounts::default() }, ..Self::default() }
    }

    /// Creates an accumulator with figures of the first `packets` packets only, which limits the memory. Fates are counted for all packets.
    #[must_use]
    pub fn of_first(packets: u64) -> Self {
        Self { most: Some(packets), ..Self::new() }
    }

    /// Adds a record. The order of the calls is the order of arrival, also for equal instants.
    ///
    /// Packets are numbered from 0 without gaps, as a link numbers packets. The memory grows with the largest number.
    ///
    /// # Errors
    ///
    /// [`RecordOutOfOrder`] if an earlier record had a later instant.
    ///
    /// # Panics
    ///
    /// If the list of packets does not fit into the address space.
    pub fn record(&mut self, record: &PacketRecord) -> Result<(), RecordOutOfOrder> {
        if record.at < self.latest {
            return Err(RecordOutOfOrder { at: record.at, latest: self.latest });
        }
        self.latest = record.at;
        self.count(record);
        // Beyond the limit only the counts above matter, and the largest number, which tells how many packets were offered.
        if let Some(beyond) = self.most.and_then(|most| record.sequence.checked_sub(most)) {
            self.beyond = self.beyond.max(beyond + 1);
            return Ok(());
        }
        let number = usize::try_from(record.sequence).expect("a list of packets fits into memory");
        if number >= self.packets.len() {
            self.packets.resize(number + 1, Packet::default());
        }
        let packet = &mut self.packets[number];
        packet.known = true;
        match record.fate {
            Fate::Duplicated => packet.more_copies_than_ends += 1,
            Fate::Dropped(_) => packet.more_copies_than_ends -= 1,
            Fate::Delivered(at) => {
                packet.more_copies_than_ends -= 1;
                let first_copy = packet.delay_plus_one == 0;
                if first_copy {
                    let delay = at.saturating_duration_since(record.offered).as_nanos();
                    packet.delay_plus_one = u64::try_from(delay).unwrap_or(u64::MAX).saturating_add(1);
                }
                self.arrives(record, at, first_copy);
            }
        }
        Ok(())
    }

    /// Counts the fate of a record.
    fn count(&mut self, record: &PacketRecord) {
        match record.fate {
            Fate::Duplicated => self.counts.duplicated += 1,
            Fate::Dropped(cause) => *self.counts.dropped.entry(cause.name()).or_default() += 1,
            Fate::Delivered(_) => {
                self.counts.delivered += 1;
                self.counts.marked += u64::from(record.marked);
                self.counts.damaged += u64::from(record.damaged);
            }
        }
    }

    /// Adds an arrival to throughput, order and jitter. Only first copies count for order and jitter.
    fn arrives(&mut self, record: &PacketRecord, at: Instant, first_copy: bool) {
        if self.first_arrival.is_some() {
            self.bytes_after_first += u128::from(record.size.get());
        } else {
            self.first_arrival = Some(at);
        }
        self.last_arrival = at;
        if first_copy {
            self.order.arrives(record.sequence);
            self.jitter.arrives(record.offered, at);
        } else {
            self.extra_copies += 1;
        }
    }

    /// Computes the figures of all records so far.
    #[must_use]
    pub fn finish(&self) -> Achieved {
        let outcomes: Vec<Outcome> = self.packets.iter().map(|packet| packet.outcome()).collect();
        let loss = LossFigures::of(&outcomes);
        Achieved {
            fates: self.counts(),
            delay: DelayFigures::of(&outcomes),
            duplicated: (loss.received > 0).then(|| count_u64(self.extra_copies) / count_u64(loss.received)),
            loss,
            order: self.order.figures(),
            throughput_bit_s: self.throughput(),
            jitter_rfc3550_s: self.jitter.seconds(),
        }
    }

    fn counts(&self) -> FateCounts {
        // Packets after the first ones count as offered up to the largest number seen, because numbers have no gaps.
        let offered = self.packets.iter().map(|packet| u64::from(packet.known)).sum::<u64>() + self.beyond;
        let dropped: u64 = self.counts.dropped.values().sum();
        let in_flight = (offered + self.counts.duplicated).saturating_sub(self.counts.delivered + dropped);
        FateCounts { offered, in_flight, ..self.counts.clone() }
    }

    fn throughput(&self) -> Option<f64> {
        let span = self.last_arrival.saturating_duration_since(self.first_arrival?).as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "a reading for people")]
        let bits = (self.bytes_after_first * 8) as f64;
        (span > 0.0).then(|| bits / span)
    }
}

impl Packet {
    const fn outcome(self) -> Outcome {
        match self.delay_plus_one {
            // A packet with all its copies has one end more than copies. So a negative difference means that all have ended, none by arrival.
            0 if self.known && self.more_copies_than_ends < 0 => Outcome::Lost,
            0 => Outcome::OnTheWay,
            delay_plus_one => Outcome::Received(delay_plus_one - 1),
        }
    }
}

/// Jitter estimator of RFC 3550, in `f64` instead of the integers of the RFC.
#[derive(Clone, Copy, Debug, Default)]
struct Jitter {
    /// Instants of sending and arrival of the packet that arrived last.
    last: Option<(Instant, Instant)>,
    /// Smoothed difference J \[ns\].
    nanos: f64,
    differences: u64,
}

impl Jitter {
    fn arrives(&mut self, offered: Instant, at: Instant) {
        if let Some((last_offered, last_at)) = self.last {
            // D = (Rj − Sj) − (Ri − Si), computed as (Rj − Ri) − (Sj − Si): arrivals never go back in time, but the order of sending may. All terms stay
            // unsigned.
            let between_arrivals = at.saturating_duration_since(last_at).as_nanos();
            let later = offered.saturating_duration_since(last_offered).as_nanos();
            let earlier = last_offered.saturating_duration_since(offered).as_nanos();
            #[expect(clippy::cast_precision_loss, reason = "a smoothed figure")]
            let difference = (between_arrivals + earlier).abs_diff(later) as f64;
            self.nanos += (difference - self.nanos) / 16.0;
            self.differences += 1;
        }
        self.last = Some((offered, at));
    }

    fn seconds(self) -> Option<f64> {
        (self.differences > 0).then(|| self.nanos / 1e9)
    }
}
