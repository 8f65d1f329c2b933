//! The queueing discipline.

use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use cohaptic_units::Instant;

use super::correlated::{Correlated, distributed};
use super::loss::LossModel;
use super::parameters::Parameters;
use super::prng::{Prng, Unseeded};
use super::slot::Slots;
use super::table::Table;
use super::time_fifo::TimeFifo;
use crate::netem::{Contradiction, Distribution, Netem, SlotGap, TableName};

/// Netem as Linux 6.6 has it, on a device of infinite speed.
///
/// The kernel looks at the queue after every packet it is offered and whenever a timer ends; with slots it draws when it looks. So to see what it
/// does, call [`dequeue`](Self::dequeue) until it gives `None` after every [`enqueue`](Self::enqueue) and at [`next_at`](Self::next_at), and never
/// else. Time must not go back.
#[derive(Clone, Debug)]
pub struct Qdisc<T> {
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
    /// How many packets were delayed since one was reordered.
    counter: u32,
    /// Packets that leave at once, the last one first, and when they came \[ns\].
    reordered: Vec<(i64, Packet<T>)>,
    line: TimeFifo<Packet<T>>,
}

#[derive(Clone, Debug)]
struct Packet<T> {
    item: T,
    size: u32,
    copy: u8,
    ect: bool,
    marked: bool,
    corrupted: Option<FlippedBit>,
}

/// Why a netem has no qdisc.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum QdiscError {
    /// The options contradict each other.
    Contradiction(Contradiction),
    /// There is no table of that name.
    UnknownTable {
        /// The name.
        name: TableName,
    },
    /// `tc` counts delays in 2³² ticks of 64 ns.
    DelayTooLong {
        /// The delay, or the jitter.
        delay: Duration,
    },
}

impl fmt::Display for QdiscError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Contradiction(error) => fmt::Display::fmt(error, f),
            Self::UnknownTable { name } => write!(
                f,
                "no table for the distribution \"{}\": expected uniform, normal, pareto, paretonormal or a table that was given",
                name.as_str()
            ),
            Self::DelayTooLong { delay } => {
                write!(f, "a delay of {}: expected less than 274.877907s, which is what 32 bits of ticks hold", cohaptic_units::print::Span(*delay))
            }
        }
    }
}

impl core::error::Error for QdiscError {}

impl From<Contradiction> for QdiscError {
    fn from(error: Contradiction) -> Self {
        Self::Contradiction(error)
    }
}

/// What happens to a packet as it is offered.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Output<T> {
    /// A copy was made. It goes its own way, and is told of before the packet.
    Duplicated,
    /// It was dropped.
    Dropped {
        /// The packet.
        item: T,
        /// 0 for the packet, 1 for its copy.
        copy: u8,
        /// Why.
        reason: DropReason,
    },
}

/// Why a packet was dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DropReason {
    /// The loss model took it.
    Loss,
    /// `limit` packets were held already.
    Limit,
}

/// A packet that leaves.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Dequeued<T> {
    /// The packet.
    pub item: T,
    /// Its length as it was offered \[bytes\].
    pub size: u32,
    /// 0 for the packet, 1 for its copy.
    pub copy: u8,
    /// Whether it got a congestion mark in place of a loss. The kernel counts this as a drop.
    pub marked: bool,
    /// The bit that was flipped. The checksums were completed before, so a host that checks them drops the packet.
    pub corrupted: Option<FlippedBit>,
    /// Whether it left before those that waited.
    pub reordered: bool,
}

/// Where a bit was flipped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FlippedBit {
    /// The byte, from the beginning of the Ethernet header.
    pub byte: u32,
    /// The bit in it, 0 for the least significant.
    pub bit: u8,
}

impl<T> Qdisc<T> {
    /// The qdisc as it is when `tc` has just added it, at [`Instant::ZERO`]. `seed` takes the place of `seed` in the words where there is none, and
    /// seeds what the kernel draws elsewhere.
    ///
    /// # Errors
    ///
    /// [`QdiscError`] if options contradict each other, a delay is beyond what `tc` counts, or a distribution is not built in.
    pub fn new(netem: &Netem, seed: u64) -> Result<Self, QdiscError> {
        Self::with_tables(netem, seed, |_| None)
    }

    /// Like [`new`](Self::new), with `tables` for the distributions that are not built in.
    ///
    /// # Errors
    ///
    /// As for [`new`](Self::new); a name is unknown if `tables` gives `None`.
    pub fn with_tables(netem: &Netem, seed: u64, mut tables: impl FnMut(&TableName) -> Option<Table>) -> Result<Self, QdiscError> {
        netem.check()?;
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

    /// How many packets are held, copies included. This is what `limit` limits.
    #[must_use]
    pub fn len(&self) -> usize {
        self.reordered.len() + self.line.len()
    }

    /// Whether no packet is held.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// When [`dequeue`](Self::dequeue) must be called next; `None` if no packet is held. May change with every call.
    ///
    /// No packet leaves earlier. With slots one may leave later: the call finds that another slot has to open, and moves this instant on.
    #[must_use]
    pub fn next_at(&self) -> Option<Instant> {
        let time = match self.reordered.last() {
            Some((time, _)) => *time,
            None => self.line.first_time()?.max(self.slots.as_ref().map_or(i64::MIN, |slots| slots.next)),
        };
        // A time before the beginning is due at the beginning.
        Some(Instant::from_nanos(u64::try_from(time).unwrap_or(0)))
    }

    /// Takes out what leaves at `now`; `None` if nothing (more) does.
    pub fn dequeue(&mut self, now: Instant) -> Option<Dequeued<T>> {
        if let Some((_, packet)) = self.reordered.pop() {
            return Some(packet.leave(true));
        }
        let now = nanos(now);
        let time = self.line.first_time()?;
        if let Some(slots) = &mut self.slots {
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
        Some(packet.leave(false))
    }
}

impl<T: Clone> Qdisc<T> {
    /// Offers a packet of `size` bytes, **with** the 14 of the Ethernet header, which is what the kernel counts (an overhead of −14 in `rate` takes
    /// them off again). `ect` says whether it can carry a congestion mark. What happens to it at once is told to `out`.
    pub fn enqueue(&mut self, now: Instant, size: u32, ect: bool, item: T, out: &mut impl FnMut(Output<T>)) {
        let packet = Packet { item, size, copy: 0, ect, marked: false, corrupted: None };
        self.admit(nanos(now), packet, out);
    }

    fn admit(&mut self, now: i64, mut packet: Packet<T>, out: &mut impl FnMut(Output<T>)) {
        let is_original = packet.copy == 0;
        let mut copies = 1;
        if is_original && self.duplicate_sequence.happens(self.parameters.duplicate, &mut self.prng) {
            copies += 1;
        }
        if self.loss.loses(&mut self.prng) {
            if self.parameters.ecn && packet.ect {
                packet.marked = true;
            } else {
                copies -= 1;
            }
        }
        if copies == 0 {
            return out(Output::Dropped { item: packet.item, copy: packet.copy, reason: DropReason::Loss });
        }
        if copies == 2 {
            out(Output::Duplicated);
            self.admit(now, Packet { copy: 1, ..packet.clone() }, out);
        }
        if self.corrupt_sequence.happens(self.parameters.corrupt, &mut self.prng) {
            packet.corrupted = flip(packet.size, &mut self.unseeded);
        }
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

    /// Whether a packet's turn to be reordered has come, and the draw, made only then, says so.
    fn goes_at_once(&mut self) -> bool {
        let gap = self.parameters.gap;
        gap != 0 && self.counter >= gap - 1 && self.parameters.reorder >= self.reorder_sequence.next(&mut self.prng)
    }

    fn time_to_leave(&mut self, now: i64, size: u32) -> i64 {
        let Parameters { latency, jitter, airtime, .. } = self.parameters;
        let delay = distributed(latency, jitter, || self.delay_sequence.next(&mut self.prng), self.table.as_ref());
        let Some(airtime) = airtime else { return now.saturating_add(delay) };
        // The packet reordered longest ago counts as well: it can only be a copy, just now.
        let reordered = self.reordered.first().map(|(time, _)| *time);
        let ready = match self.line.last_time().max(reordered) {
            None => now.saturating_add(delay),
            Some(last) => last.saturating_add(delay.wrapping_sub(last.wrapping_sub(now)).max(0)),
        };
        ready.saturating_add(airtime.of(size).cast_signed())
    }
}

impl<T> Packet<T> {
    fn leave(self, reordered: bool) -> Dequeued<T> {
        Dequeued { item: self.item, size: self.size, copy: self.copy, marked: self.marked, corrupted: self.corrupted, reordered }
    }
}

/// A bit of a packet, if it has any.
fn flip(size: u32, unseeded: &mut Unseeded) -> Option<FlippedBit> {
    let byte = unseeded.below(size);
    let bit = u8::try_from(unseeded.below(8)).unwrap_or(0);
    (size > 0).then_some(FlippedBit { byte, bit })
}

/// An instant \[ns\], of which there are 292 years here.
fn nanos(instant: Instant) -> i64 {
    i64::try_from(instant.as_nanos()).unwrap_or(i64::MAX)
}
