//! A link that behaves like the kernel's netem.

use alloc::vec;

use cohaptic_units::Instant;

use crate::fates::damage::Damage;
use crate::fates::fate::DropCause;
use crate::netem::kernel::{DropReason, Output as QdiscOutput, Qdisc};
use crate::packet::{Carried, Exit, Output, Outputs};

/// The kernel's queueing discipline on a device of infinite speed, as a stage of a link.
#[derive(Clone, Debug)]
pub(crate) struct KernelStage<T> {
    qdisc: Qdisc<Carried<T>>,
}

impl<T: Clone> KernelStage<T> {
    pub(crate) const fn new(qdisc: Qdisc<Carried<T>>) -> Self {
        Self { qdisc }
    }

    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, outputs: &mut Outputs<T>) {
        let size = u32::try_from(packet.info.size.get()).unwrap_or(u32::MAX);
        let original = packet.clone();
        self.qdisc.enqueue(now, size, packet.info.ecn.is_capable(), packet, &mut |output| {
            outputs.push(match output {
                QdiscOutput::Duplicated => Output { packet: original.clone().as_copy(1), exit: Exit::Copied(now) },
                QdiscOutput::Dropped { item, copy, reason } => {
                    let cause = match reason {
                        DropReason::Loss => DropCause::Loss,
                        DropReason::Limit => DropCause::Limit,
                    };
                    Output { packet: item.as_copy(copy), exit: Exit::Dropped(now, cause) }
                }
            });
        });
        self.leave(now, outputs);
    }

    pub(crate) fn next_at(&self) -> Option<Instant> {
        self.qdisc.next_at()
    }

    pub(crate) fn pass(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        while let Some(at) = self.qdisc.next_at().filter(|at| *at <= now) {
            let before = outputs.len();
            self.leave(at, outputs);
            // A look may only have moved the next slot to a later instant, and the loop goes on. A look without any effect would repeat for ever.
            if outputs.len() == before && self.qdisc.next_at() == Some(at) {
                return;
            }
        }
    }

    fn leave(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        while let Some(left) = self.qdisc.dequeue(now) {
            // Marks of earlier lines stay on the packet.
            let mut packet = left.item.as_copy(left.copy);
            packet.marks.congestion |= left.marked;
            if let Some(bit) = left.corrupted {
                packet.marks.damage(Damage::of(vec![u64::from(bit.byte) * 8 + u64::from(bit.bit)]), true);
            }
            outputs.push(Output { packet, exit: Exit::Arrives(now) });
        }
    }
}
