//! A link with a log of fates to replay.

use alloc::collections::BinaryHeap;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::cmp::Reverse;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::fates::damage::Damage;
use crate::fates::fate::{DropCause, Fate};
use crate::fates::log::FateLog;
use crate::fates::record::PacketRecord;
use crate::packet::{Carried, Exit, Output, Outputs};

/// A log, and the drops and copies to come. Arrivals are given to the owner at the offer.
#[derive(Clone, Debug)]
pub(crate) struct ReplayStage<T> {
    log: Arc<FateLog>,
    /// Instant of each output to come, and its index in `later`. Simultaneous outputs come in the order of the log.
    order: BinaryHeap<Reverse<(Instant, usize)>>,
    /// Outputs to come; `None` for an output already out. Emptied when no output is left, so indices in `order` stay valid.
    later: Vec<Option<Output<T>>>,
}

impl<T: Clone> ReplayStage<T> {
    pub(crate) const fn new(log: Arc<FateLog>) -> Self {
        Self { log, order: BinaryHeap::new(), later: Vec::new() }
    }

    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, outputs: &mut Outputs<T>) {
        let log = Arc::clone(&self.log);
        let records = log.of_packet(packet.number);
        if records.is_empty() {
            outputs.push(Output { packet, exit: Exit::Dropped(now, DropCause::EndOfLog) });
            return;
        }
        // A log may record the making of a copy under the number of the packet or of the copy. So the n-th copy made is taken as the n-th copy with an end.
        let mut copies = records.iter().filter(|record| record.copy > 0 && record.fate.is_end()).map(|record| record.copy);
        for record in records {
            let at = now.saturating_add(after(record));
            let (copy, exit) = match record.fate {
                Fate::Delivered(_) => (record.copy, Exit::Arrives(at)),
                Fate::Dropped(cause) => (record.copy, Exit::Dropped(at, cause)),
                Fate::Duplicated => (copies.next().unwrap_or(record.copy), Exit::Copied(at)),
            };
            // The packet's marks of earlier lines stay, and the recorded marks are added.
            let mut packet = packet.clone().as_copy(copy);
            packet.marks.congestion |= record.marked;
            if record.damaged {
                packet.marks.damage(Some(Damage::unknown()), false);
            }
            let output = Output { packet, exit };
            // An arrival goes out at once, because the owner keeps packets in propagation. A later drop or copy waits here for its instant.
            if at == now || matches!(exit, Exit::Arrives(_)) {
                outputs.push(output);
            } else {
                self.order.push(Reverse((at, self.later.len())));
                self.later.push(Some(output));
            }
        }
    }

    pub(crate) fn next_at(&self) -> Option<Instant> {
        self.order.peek().map(|Reverse((at, _))| *at)
    }

    pub(crate) fn pass(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        while self.next_at().is_some_and(|at| at <= now) {
            let Some(Reverse((_, place))) = self.order.pop() else { break };
            outputs.extend(self.later[place].take());
        }
        // An empty list starts again from index 0, so memory does not grow over the run.
        if self.order.is_empty() {
            self.later.clear();
        }
    }
}

/// Returns the time from a packet's offer to the recorded event.
fn after(record: &PacketRecord) -> Duration {
    record.at.saturating_duration_since(record.offered)
}
