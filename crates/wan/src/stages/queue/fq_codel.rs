//! FQ-CoDel: a queue per flow, served in turn, each with CoDel (Høiland-Jørgensen, McKenney, Taht, Gettys & Dumazet, RFC 8290, 2018).
//!
//! ```text
//!            ┌─ queue of flow 7  ─┐   new: queues that were empty when a packet came, served first
//! packet ──► ├─ queue of flow 12 ─┤
//!  flow      └─ …                ─┘   old: all other queues with packets, served in turn, `quantum` bytes each
//! ```
//!
//! A queue begins as a new queue, and becomes an old queue after its first quantum. So the packet of a flow that sends rarely waits only for the packet on
//! the line. Where RFC 8290 leaves a choice, the choice is the choice of Linux: a full queue drops half of the bytes of the longest queue, from its head and at
//! most 64 packets (section 4.1), and CoDel's limit of one packet is compared with the bytes of all queues together.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;
use core::num::NonZeroU32;

use cohaptic_units::Instant;

use super::CoDel;
use super::codel::{CoDelState, Verdict};
use super::fifo::Rules;
use crate::fates::fate::DropCause;
use crate::parameters::{Form, Table, usual};

/// Parameters of FQ-CoDel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FqCoDel {
    /// CoDel of each queue. `mtu` is compared with the bytes of all queues together.
    pub codel: CoDel,
    /// Bytes that a queue may send in its turn, usually 1514.
    pub quantum: NonZeroU32,
    /// Number of queues, usually 1024. Flows with the same remainder of their number share a queue.
    pub flows: NonZeroU32,
}

impl Default for FqCoDel {
    /// Returns the defaults of Linux: 5 ms, 100 ms, an MTU and a quantum of 1514 bytes, 1024 queues, and ECN.
    fn default() -> Self {
        let [quantum, flows] = [1514, 1024].map(|number| NonZeroU32::MIN.saturating_add(number - 1));
        Self { codel: CoDel { mtu: cohaptic_units::Bytes::new(1514), ecn: true, ..CoDel::default() }, quantum, flows }
    }
}

/// Packets dropped at once from the longest queue, at most.
const MOST_DROPPED: u64 = 64;

/// Bytes that a packet counts in the turns of queues, at most: above the largest size in a network. Keeps the number of turns for one packet small.
const MOST_BYTES: u64 = 1 << 24;

/// The queues of all flows.
#[derive(Clone, Debug)]
pub(crate) struct FlowQueues<P> {
    /// Queues that ever had a packet, by number. The queue of the cross-traffic has no number, and does not count among the `flows` queues. An empty queue
    /// stays, because CoDel remembers the latest drops of the queue.
    queues: BTreeMap<Option<u32>, FlowQueue<P>>,
    /// Numbers of new queues, in their order of service.
    new: VecDeque<Option<u32>>,
    /// Numbers of old queues, in their order of service.
    old: VecDeque<Option<u32>>,
    /// Number of waiting packets.
    count: usize,
    /// Number of packets so far. Gives the order of the waiting packets after a change to another discipline.
    offered: u64,
}

/// Queue of the flows with one number.
#[derive(Clone, Debug)]
struct FlowQueue<P> {
    /// Waiting packets, each with its place in the order of offers.
    waiting: VecDeque<(u64, P)>,
    /// Bytes of the waiting packets.
    bytes: u128,
    /// Bytes that the queue may still send in its turn. At most zero if the turn is over.
    credit: i64,
    codel: CoDelState,
    /// `true` if the queue is in a list. A queue stays in a list until its turn finds the queue empty.
    is_listed: bool,
}

impl<P> FlowQueues<P> {
    pub(crate) const fn new() -> Self {
        Self { queues: BTreeMap::new(), new: VecDeque::new(), old: VecDeque::new(), count: 0, offered: 0 }
    }

    /// Returns the number of waiting packets.
    pub(crate) const fn len(&self) -> usize {
        self.count
    }

    /// Appends a packet to the queue of its flow, and returns its place in the order of offers.
    pub(crate) fn push<R: Rules<P>>(&mut self, rules: &R, fq_codel: &FqCoDel, packet: P) -> u64 {
        let number = rules.flow(&packet).map(|flow| flow % fq_codel.flows);
        let empty = || FlowQueue { waiting: VecDeque::new(), bytes: 0, credit: 0, codel: CoDelState::default(), is_listed: false };
        let queue = self.queues.entry(number).or_insert_with(empty);
        if !queue.is_listed {
            (queue.is_listed, queue.credit) = (true, fq_codel.quantum.get().into());
            self.new.push_back(number);
        }
        queue.bytes += u128::from(rules.size(&packet).get());
        queue.waiting.push_back((self.offered, packet));
        self.offered += 1;
        self.count += 1;
        self.offered - 1
    }

    /// Removes the next packet to send (RFC 8290, section 4.2). `dropped` takes the packets that CoDel drops, and `sums` loses all of these packets.
    pub(crate) fn take<R: Rules<P>>(
        &mut self,
        now: Instant,
        rules: &R,
        fq_codel: &FqCoDel,
        sums: &mut R::Sums,
        mut dropped: impl FnMut(DropCause, P),
    ) -> Option<P> {
        let Self { queues, new, old, count, .. } = self;
        loop {
            let is_new = !new.is_empty();
            let list = if is_new { &mut *new } else { &mut *old };
            let number = list.pop_front()?;
            let Some(queue) = queues.get_mut(&number) else { continue };
            if queue.credit <= 0 {
                // The turn is over. The next turn comes after the turns of all old queues.
                queue.credit += i64::from(fq_codel.quantum.get());
                old.push_back(number);
                continue;
            }
            while let Some((_, mut packet)) = queue.waiting.pop_front() {
                let size = rules.size(&packet).get();
                queue.bytes -= u128::from(size);
                rules.remove(sums, &packet);
                *count -= 1;
                let sojourn = now.saturating_duration_since(rules.offered(&packet));
                match queue.codel.verdict(&fq_codel.codel, now, sojourn, rules.waiting(sums, *count).0, rules.ecn(&packet).is_capable()) {
                    Verdict::Drop => {
                        dropped(DropCause::CoDel, packet);
                        continue;
                    }
                    Verdict::Mark => rules.mark(&mut packet),
                    Verdict::Send => {}
                }
                queue.credit = queue.credit.saturating_sub_unsigned(size.min(MOST_BYTES));
                // The turn goes on with the next packet.
                let list = if is_new { new } else { old };
                list.push_front(number);
                return Some(packet);
            }
            queue.codel.finds_nothing();
            // An empty new queue becomes an old queue first. Otherwise a flow with one packet at a time would be served before all old queues for ever.
            if is_new && !old.is_empty() {
                old.push_back(number);
            } else {
                queue.is_listed = false;
            }
        }
    }

    /// Drops half of the bytes of the longest queue, from its head, at least one packet and at most [`MOST_DROPPED`]. Of equally long queues the queue of the
    /// cross-traffic counts as the longest, or else the queue with the smallest number. Returns the place of the last dropped packet in the order of offers,
    /// or `None` if no packet waits.
    pub(crate) fn drop_from_longest<R: Rules<P>>(&mut self, rules: &R, sums: &mut R::Sums, mut dropped: impl FnMut(DropCause, P)) -> Option<u64> {
        let filled = self.queues.values_mut().filter(|queue| !queue.waiting.is_empty());
        let queue = filled.reduce(|longest, queue| if queue.bytes > longest.bytes { queue } else { longest })?;
        let (rest, mut last) = (queue.bytes - queue.bytes / 2, None);
        for _ in 0..MOST_DROPPED {
            let Some((order, packet)) = queue.waiting.pop_front() else { break };
            last = Some(order);
            queue.bytes -= u128::from(rules.size(&packet).get());
            rules.remove(sums, &packet);
            self.count -= 1;
            // Drops at a full queue are drops without success for CoDel too: it drops faster from now on.
            queue.codel.counts_drop();
            dropped(DropCause::QueueFull, packet);
            if queue.bytes <= rest {
                break;
            }
        }
        last
    }

    /// Returns the waiting packets, in the order of their queues.
    pub(crate) fn packets(&self) -> impl Iterator<Item = &P> {
        self.queues.values().flat_map(|queue| &queue.waiting).map(|(_, packet)| packet)
    }

    /// Returns the waiting packets in the order of their offers.
    pub(crate) fn into_packets(self) -> impl Iterator<Item = P> {
        let mut packets: Vec<(u64, P)> = self.queues.into_values().flat_map(|queue| queue.waiting).collect();
        packets.sort_unstable_by_key(|(order, _)| *order);
        packets.into_iter().map(|(_, packet)| packet)
    }

    /// Returns the same queues with each packet converted to another type.
    pub(crate) fn converted<Q>(self, mut convert: impl FnMut(P) -> Q) -> FlowQueues<Q> {
        let Self { queues, new, old, count, offered } = self;
        let queues = queues
            .into_iter()
            .map(|(number, FlowQueue { waiting, bytes, credit, codel, is_listed })| {
                let waiting = waiting.into_iter().map(|(order, packet)| (order, convert(packet))).collect();
                (number, FlowQueue { waiting, bytes, credit, codel, is_listed })
            })
            .collect();
        FlowQueues { queues, new, old, count, offered }
    }
}

/// Parameters of the discipline.
pub(crate) static FQ_CODEL: Table = Table::of(&[&[
    usual("target", Form::PositiveDuration, "\"5ms\"", "Wait that packets should not exceed"),
    usual("interval", Form::PositiveDuration, "\"100ms\"", "Time for which packets may wait longer than the target"),
    usual("mtu", Form::Size, "\"1514B\"", "Size of all queues together up to which no packet is dropped"),
    usual("ecn", Form::Boolean, "true", "Whether packets are marked instead of dropped"),
    usual("quantum", Form::Size, "\"1514B\"", "Bytes that a queue sends in its turn").expecting("a size of 1B to 4294967295B"),
    usual("flows", Form::Integer(1, 65_536), "1024", "Number of queues, to which the flows are spread"),
]]);
