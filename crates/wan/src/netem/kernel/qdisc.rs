//! The queueing discipline of the kernel's netem.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::correlated::{Correlated, distributed};
use super::loss::LossModel;
use super::parameters::{Parameters, QdiscError};
use super::prng::{Prng, Unseeded};
use super::slot::Slots;
use super::table::Table;
use super::time_fifo::TimeFifo;
use crate::netem::{Contradiction, Distribution, Netem, SlotGap, TableName};

/// The netem of Linux 6.6, on a device of infinite speed.
///
/// The kernel looks at the queue after every packet offered and whenever a timer ends, and with slots each look may draw random numbers. To get the kernel's
/// decisions, call [`dequeue`](Self::dequeue) until `None` is returned, after every [`enqueue`](Self::enqueue) and at [`next_at`](Self::next_at), and at no
/// other time. Time must not go back.
#[derive(Clone, Debug)]
pub(crate) struct Qdisc<T> {
    parameters: Parameters,
    table: Option<Table>,
    loss: LossModel,
    slots: Option<Slots>,
    prng: Prng,
    unseeded: Unseeded,
    delay_sequence: Correlated,
    duplicate_sequence: Correlated,
    corrupt_sequence: Correlated,
    reorder_sequence: Correlated,
    /// Number of packets delayed since the last reordering.
    counter: u32,
    /// Packets without delay, and the times of their arrival \[ns\]. The newest packet leaves first.
    pub(super) reordered: Vec<(i64, Packet<T>)>,
    line: TimeFifo<Packet<T>>,
}

/// A packet in the qdisc, or on its way out.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Packet<T> {
    /// The packet, as offered.
    pub(crate) item: T,
    /// Length of the packet as offered \[bytes\].
    size: u32,
    /// 0 for the packet, 1 for its copy.
    pub(crate) copy: u8,
    /// Whether the packet can carry a congestion mark.
    ect: bool,
    /// `true` if the packet was marked instead of lost. The kernel counts the mark as a drop.
    pub(crate) marked: bool,
    /// The flipped bit, or `None`. The kernel completes checksums before the flip of the bit, so a host with verification of checksums drops the packet.
    pub(crate) corrupted: Option<FlippedBit>,
}

/// An event of a packet in the call of its offer.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Output<T> {
    /// A copy of the packet was made. Packet and copy go on separately, and the events of the copy come first.
    Duplicated,
    /// The packet or its copy was dropped.
    Dropped {
        /// The dropped packet.
        item: T,
        /// 0 for the packet, 1 for its copy.
        copy: u8,
        /// Reason of the drop.
        reason: DropReason,
    },
}

/// The reason of a drop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum DropReason {
    /// The loss model lost the packet.
    Loss,
    /// The qdisc held `limit` packets already.
    Limit,
}

/// The place of a flipped bit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct FlippedBit {
    /// Index of the byte, from the beginning of the Ethernet header.
    pub(crate) byte: u32,
    /// Index of the bit in the byte, 0 for the least significant.
    pub(crate) bit: u8,
}

impl<T> Qdisc<T> {
    /// Makes the qdisc in its state right after `tc` has added the qdisc, at [`Instant::ZERO`]. `seed` seeds the values from the kernel's unseeded generator,
    /// and also the seeded generator if the words have no `seed`. `tables` returns the tables of distributions that are not built in.
    ///
    /// # Errors
    ///
    /// [`QdiscError`] if options contradict each other, a delay does not fit into the ticks of `tc`, or `tables` returns `None`.
    pub(crate) fn new(netem: &Netem, seed: u64, mut tables: impl FnMut(&TableName) -> Option<Table>) -> Result<Self, QdiscError> {
        netem.check()?;
        if netem.cross.is_some() {
            return Err(Contradiction::CrossInKernel.into());
        }
        let parameters = Parameters::new(netem)?;
        let mut table = |distribution: &Distribution| match distribution {
            Distribution::Uniform => Ok(None),
            Distribution::Normal => Ok(Some(Table::normal())),
            Distribution::Pareto => Ok(Some(Table::pareto())),
            Distribution::ParetoNormal => Ok(Some(Table::pareto_normal())),
            Distribution::Table(name) => tables(name).map(Some).ok_or_else(|| QdiscError::UnknownTable { name: name.clone() }),
        };
        let distribution = netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).and_then(|jitter| jitter.distribution.as_ref());
        let delay_table = distribution.map_or(Ok(None), &mut table)?;
        let slots = match &netem.slot {
            None => None,
            Some(slot) => {
                let table = match &slot.gap {
                    SlotGap::Range { .. } => None,
                    SlotGap::Drawn { distribution, .. } => table(distribution)?,
                };
                Slots::new(slot, table)
            }
        };
        // The sequences draw their first values in the order of the fields below. This order decides their values for a given seed.
        let mut unseeded = Unseeded::new(seed);
        let correlations = parameters.correlations;
        Ok(Self {
            loss: LossModel::new(netem.loss.as_ref(), &mut unseeded),
            delay_sequence: Correlated::new(correlations.delay, &mut unseeded),
            duplicate_sequence: Correlated::new(correlations.duplicate, &mut unseeded),
            corrupt_sequence: Correlated::new(correlations.corrupt, &mut unseeded),
            reorder_sequence: Correlated::new(correlations.reorder, &mut unseeded),
            parameters,
            table: delay_table,
            slots,
            prng: Prng::new(netem.seed.unwrap_or(seed)),
            unseeded,
            counter: 0,
            reordered: Vec::new(),
            line: TimeFifo::new(),
        })
    }

    /// Returns the number of packets held, copies included. `limit` is the limit of this number.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.reordered.len() + self.line.len()
    }

    /// Returns the instant of the next call of [`dequeue`](Self::dequeue), or `None` if no packet is held. The instant may change with every call.
    ///
    /// No packet leaves before this instant. With slots a packet may leave later: the call then opens another slot first, and the instant moves on.
    #[must_use]
    pub(crate) fn next_at(&self) -> Option<Instant> {
        let time = match self.reordered.last() {
            Some((time, _)) => *time,
            None => self.line.first_time()?.max(self.slots.as_ref().map_or(i64::MIN, |slots| slots.next)),
        };
        // A time before the beginning of the run is due at the beginning.
        Some(Instant::from_nanos(u64::try_from(time).unwrap_or(0)))
    }

    /// Removes and returns a packet with its departure at `now`, or returns `None` if no further packet leaves.
    pub(crate) fn dequeue(&mut self, now: Instant) -> Option<Packet<T>> {
        // Reordered packets leave before all further packets, and use no slot.
        if let Some((_, packet)) = self.reordered.pop() {
            return Some(packet);
        }
        let now = nanos(now);
        let time = self.line.first_time()?;
        if let Some(slots) = &mut self.slots {
            // A slot from before the packet's time is over, and another slot has to open first.
            if slots.next < time {
                slots.advance(now, &mut self.prng, &mut self.unseeded);
            }
            if slots.next > now {
                return None;
            }
        }
        if time > now {
            return None;
        }
        let packet = self.line.pop()?;
        if let Some(slots) = &mut self.slots
            && slots.spend(packet.size)
        {
            slots.advance(now, &mut self.prng, &mut self.unseeded);
        }
        Some(packet)
    }
}

impl<T: Clone> Qdisc<T> {
    /// Offers a packet of `size` bytes. The size **includes** the 14 bytes of the Ethernet header, as counted by the kernel (an overhead of −14 in `rate`
    /// subtracts these bytes again). `ect` says whether the packet can carry a congestion mark. `out` is called for each event of the packet in this call.
    pub(crate) fn enqueue(&mut self, now: Instant, size: u32, ect: bool, item: T, out: &mut impl FnMut(Output<T>)) {
        let packet = Packet { item, size, copy: 0, ect, marked: false, corrupted: None };
        self.admit(nanos(now), packet, out);
    }

    fn admit(&mut self, now: i64, mut packet: Packet<T>, out: &mut impl FnMut(Output<T>)) {
        // A copy is not copied again, and draws no number for the question.
        let is_original = packet.copy == 0;
        let mut copies = 1;
        if is_original && self.duplicate_sequence.happens(self.parameters.duplicate, &mut self.prng) {
            copies += 1;
        }
        if self.loss.loses(&mut self.prng) {
            if self.parameters.ecn && packet.ect {
                packet.marked = true;
            } else {
                // If a copy was to be made as well, one packet is left: the packet itself passes, and no copy is made.
                copies -= 1;
            }
        }
        if copies == 0 {
            return out(Output::Dropped { item: packet.item, copy: packet.copy, reason: DropReason::Loss });
        }
        if copies == 2 {
            // The copy goes first through all steps, so its draws come before the packet's remaining draws.
            out(Output::Duplicated);
            self.admit(now, Packet { copy: 1, ..packet.clone() }, out);
        }
        if self.corrupt_sequence.happens(self.parameters.corrupt, &mut self.prng) {
            packet.corrupted = flip(packet.size, &mut self.unseeded);
        }
        // The kernel counts the packets in propagation too.
        if self.len() >= self.parameters.limit as usize {
            return out(Output::Dropped { item: packet.item, copy: packet.copy, reason: DropReason::Limit });
        }
        if self.goes_at_once() {
            self.counter = 0;
            self.reordered.push((now, packet));
        } else {
            let time = self.time_to_leave(now, packet.size);
            self.counter = self.counter.wrapping_add(1);
            self.line.push(time, packet);
        }
    }

    /// Returns whether a packet leaves at once. The draw is made only if the packet is a candidate.
    fn goes_at_once(&mut self) -> bool {
        let gap = self.parameters.gap;
        gap != 0 && self.counter >= gap - 1 && self.parameters.reorder >= self.reorder_sequence.next(&mut self.prng)
    }

    fn time_to_leave(&mut self, now: i64, size: u32) -> i64 {
        let Parameters { latency, jitter, airtime, .. } = self.parameters;
        let delay = distributed(latency, jitter, || self.delay_sequence.next(&mut self.prng), self.table.as_ref());
        let Some(airtime) = airtime else { return now.saturating_add(delay) };
        // The first reordered packet counts as well. Only a copy of the offered packet can be in the list here, because the driver empties the list after each
        // offer.
        let reordered = self.reordered.first().map(|(time, _)| *time);
        let ready = match self.line.last_time().max(reordered) {
            None => now.saturating_add(delay),
            // The transmission begins at the later of now + delay and the latest time to leave.
            Some(last) => last.saturating_add(delay.wrapping_sub(last.wrapping_sub(now)).max(0)),
        };
        ready.saturating_add(airtime.of(size).cast_signed())
    }
}

/// Chooses a bit of a packet, or returns `None` for a packet without bytes.
fn flip(size: u32, unseeded: &mut Unseeded) -> Option<FlippedBit> {
    let byte = unseeded.below(size);
    let bit = u8::try_from(unseeded.below(8)).unwrap_or(0);
    (size > 0).then_some(FlippedBit { byte, bit })
}

/// Returns an instant \[ns\]. Instants from 2⁶³ ns (292 years) on count as 2⁶³ − 1.
fn nanos(instant: Instant) -> i64 {
    i64::try_from(instant.as_nanos()).unwrap_or(i64::MAX)
}
