//! From records, one by one, to figures.

use cohaptic_units::Instant;
use cohaptic_wan::{DropCause, Fate, PacketRecord};

use super::order::OrderOfArrival;
use super::{Achieved, DelayFigures, FateCounts, LossFigures};
use crate::series::count_u64;

/// Takes the records of one link as they happen and gives its figures at any time.
///
/// It holds 17 bytes for every packet, and 16 for every place where arrivals do not follow the order of sending; [`Accumulator::finish`] needs about 48
/// bytes a packet more while it runs. [`Accumulator::of_first`] bounds the number of packets.
#[derive(Clone, Debug, Default)]
pub struct Accumulator {
    /// The number of packets that figures are of; packets with greater numbers are counted only. `None`: all.
    most: Option<u64>,
    /// The number of packets beyond these.
    beyond: u64,
    /// Packets by sequence.
    packets: Vec<Packet>,
    counts: FateCounts,
    order: OrderOfArrival,
    latest: Instant,
    first_arrival: Option<Instant>,
    last_arrival: Instant,
    bytes_after_first: u128,
    extra_copies: u64,
    jitter: Jitter,
}

/// The history of one packet. Default: never heard of.
#[derive(Clone, Copy, Debug, Default)]
struct Packet {
    /// Delay of the first copy to arrive \[ns\], plus one; 0: none arrived.
    delay_plus_one: u64,
    /// Copies made, less ends.
    more_copies_than_ends: i32,
    known: bool,
}

/// What can be said of a packet in the end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// It arrived after this delay \[ns\].
    Received(u64),
    /// No copy arrived, and none can arrive any more.
    Lost,
    /// A copy may still arrive.
    OnTheWay,
}

/// A record came after one of a later instant. Nothing was changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a record of {at} came after one of {latest}: expected records in the order in which things happened")]
pub struct RecordOutOfOrder {
    /// The instant of the record.
    pub at: Instant,
    /// The latest instant before.
    pub latest: Instant,
}

impl Accumulator {
    /// Nothing has happened yet.
    #[must_use]
    pub fn new() -> Self {
        let dropped = DropCause::ALL.into_iter().map(|cause| (cause.name(), 0)).collect();
        Self { counts: FateCounts { dropped, ..FateCounts::default() }, ..Self::default() }
    }

    /// Nothing has happened yet. Figures will be of the first packets only, that number of them at most, so that memory is bounded; fates are counted of all.
    #[must_use]
    pub fn of_first(packets: u64) -> Self {
        Self { most: Some(packets), ..Self::new() }
    }

    /// Takes one record. The order of the calls is the order of arrival, also at equal instants.
    ///
    /// Packets are numbered from 0 without gaps, as a link numbers them; memory grows with the greatest number.
    ///
    /// # Errors
    ///
    /// [`RecordOutOfOrder`] if an earlier record had a later instant.
    ///
    /// # Panics
    ///
    /// If the list of packets outgrows the address space.
    pub fn record(&mut self, record: &PacketRecord) -> Result<(), RecordOutOfOrder> {
        if record.at < self.latest {
            return Err(RecordOutOfOrder { at: record.at, latest: self.latest });
        }
        self.latest = record.at;
        self.count(record);
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

    /// The figures of all that was recorded so far.
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
        // A packet beyond the first ones is taken for known if a later one is: they are numbered without gaps.
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
            // The packet itself has one end beyond those of its copies.
            0 if self.known && self.more_copies_than_ends < 0 => Outcome::Lost,
            0 => Outcome::OnTheWay,
            delay_plus_one => Outcome::Received(delay_plus_one - 1),
        }
    }
}

/// The estimator of RFC 3550 in `f64`; the RFC's integer form only saves cycles.
#[derive(Clone, Copy, Debug, Default)]
struct Jitter {
    last: Option<(Instant, Instant)>,
    nanos: f64,
    differences: u64,
}

impl Jitter {
    fn arrives(&mut self, offered: Instant, at: Instant) {
        if let Some((last_offered, last_at)) = self.last {
            // D = (Rj − Sj) − (Ri − Si), as (Rj − Ri) − (Sj − Si): arrivals do not go back, sendings may.
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
