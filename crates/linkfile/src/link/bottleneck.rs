//! `rate`, `queue`, `overhead` and `cells`: the serialiser and the queue before it.

use core::num::NonZeroU32;

use cohaptic_units::Rate;
use cohaptic_wan::{Bottleneck, Cells, DeliveryTrace, Discipline, Framing, Service};

use super::queue::{Queue, read_queue};
use super::{is_none, is_unlimited, written_together};
use crate::document::Node;
use crate::reading::{Context, TableReader, values};

/// The bottleneck, whose line sends at a rate or at the instants of a recording.
pub(super) fn read_bottleneck(table: &mut TableReader<'_>, recorded: Option<DeliveryTrace>, context: Context<'_>) -> Option<Option<Bottleneck>> {
    let (rate_entry, trace_entry) = (table.entry("rate"), table.entry("trace"));
    let parts = [table.entry("queue"), table.entry("overhead"), table.entry("cells")];
    let rate = table.maybe("rate", read_rate);
    let none = Queue { limit: None, discipline: Discipline::TailDrop };
    let queue = table.optional("queue", none, read_queue);
    let overhead = table.optional("overhead", 0, values::signed_size);
    let cells = table.optional("cells", None, read_cells);
    let (rate, queue, overhead, cells) = (rate?.flatten(), queue?, overhead?, cells?);
    let service = match (rate, recorded) {
        (None, None) => None,
        (Some(rate), None) => Some(Service::Rate(rate)),
        (None, Some(trace)) => Some(Service::Recorded(trace)),
        (Some(rate), Some(trace)) => {
            let (rate_entry, trace_entry) = (rate_entry?, trace_entry?);
            if written_together(rate_entry, trace_entry) {
                let last = if rate_entry.key < trace_entry.key { trace_entry } else { rate_entry };
                context.fault(
                    last.key,
                    &last.node.path,
                    "a line cannot have a rate and a recording of what it can deliver: expected one of rate and trace",
                );
                return None;
            }
            // The one that was laid over the other holds.
            let trace_is_over = table.names().position(|name| name == "trace") > table.names().position(|name| name == "rate");
            Some(if trace_is_over { Service::Recorded(trace) } else { Service::Rate(rate) })
        }
    };
    if let Some(service) = service {
        let Queue { limit, discipline } = queue;
        return Some(Some(Bottleneck { service, framing: Framing { overhead, cells }, limit, discipline }));
    }
    for entry in parts.into_iter().flatten() {
        // A queue that was inherited is taken away with the line before which it stands.
        let beside = |line: Option<&crate::document::Entry>| line.is_none_or(|line| written_together(line, entry));
        if !context.partial && beside(rate_entry) && beside(trace_entry) {
            let message = format!("{} means nothing on a link without a rate: expected a key rate such as \"1Mbit\" beside it", entry.name);
            context.fault(entry.key, &entry.node.path, message);
            return None;
        }
    }
    Some(None)
}

/// `None` for "unlimited".
fn read_rate(node: &Node, context: Context<'_>) -> Option<Option<Rate>> {
    if is_unlimited(node) { Some(None) } else { values::rate(node, context).map(Some) }
}

/// `None` for "none".
fn read_cells(node: &Node, context: Context<'_>) -> Option<Option<Cells>> {
    if is_none(node) {
        return Some(None);
    }
    const EXPECTED: &str = "a table such as { payload = \"48B\", overhead = \"5B\" }";
    let mut table = TableReader::new(node, context, EXPECTED)?;
    let size = |least: u32| {
        move |node: &Node, context: Context<'_>| {
            let size = values::size(node, context)?;
            let found = u32::try_from(size.get()).ok().filter(|size| *size >= least);
            if found.is_none() {
                context.fault_at(node, format!("{size} is out of range: expected a size from {least}B to {}B", u32::MAX));
            }
            found
        }
    };
    let payload = table.required("payload", "what a cell carries, a size such as \"48B\"", size(1));
    let overhead = table.optional("overhead", 0, size(0));
    table.finish();
    Some(Some(Cells { payload: NonZeroU32::new(payload?)?, overhead: overhead? }))
}
