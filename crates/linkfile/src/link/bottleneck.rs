//! Readers of `rate`, `queue`, `overhead`, `cells`, `cross-traffic` and `token-bucket`: the serialiser, the queue before the serialiser and its other packets,
//! and the shaper of bursts.

use core::num::NonZeroU32;

use cohaptic_wan::{Bottleneck, Cells, CrossTraffic, DeliveryTrace, Discipline, Framing, Peak, Service, TokenBucket};

use super::queue::{Queue, read_limit, read_queue};
use super::{NONE, UNLIMITED, cross_traffic, is_none, unless, written_together};
use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, values};

/// Reads the bottleneck: a line with a rate, or with the instants `recorded` of sending. Returns `Some(None)` for a link without a bottleneck.
pub(super) fn read_bottleneck(table: &mut TableReader<'_>, recorded: Option<DeliveryTrace>, context: Context<'_>) -> Option<Option<Bottleneck>> {
    let (rate_entry, trace_entry) = (table.entry("rate"), table.entry("trace"));
    let cross_traffic = table.entry("cross-traffic").filter(|entry| !is_none(&entry.node));
    let parts = [table.entry("queue"), table.entry("overhead"), table.entry("cells"), cross_traffic];
    let rate = table.read("rate", unless(UNLIMITED, values::rate));
    let queue = table.maybe("queue", read_queue);
    let overhead = table.read("overhead", values::signed_size);
    let cells = table.read("cells", unless(NONE, read_cells));
    // Every key is read before the first `?`, so that the first fault of the text is found.
    let (rate, queue, overhead, cells) = (rate?, queue?, overhead?, cells?);
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
            // One key was laid over the other, and the upper key applies. The order of names is the order of laying over.
            let trace_is_over = table.names().position(|name| name == "trace") > table.names().position(|name| name == "rate");
            Some(if trace_is_over { Service::Recorded(trace) } else { Service::Rate(rate) })
        }
    };
    if let Some(service) = service {
        let Queue { limit, discipline } = queue.unwrap_or(Queue { limit: None, discipline: Discipline::TailDrop });
        return Some(Some(Bottleneck { service, framing: Framing { overhead, cells }, limit, discipline }));
    }
    for entry in parts.into_iter().flatten() {
        // A queue written beside a missing rate is a fault. An inherited queue disappears without a fault, together with the rate that was taken away.
        let beside = |line: Option<&crate::document::Entry>| line.is_none_or(|line| written_together(line, entry));
        if !context.partial && beside(rate_entry) && beside(trace_entry) {
            let message = format!("{} means nothing on a link without a rate: expected a key rate such as \"1Mbit\" too", entry.name);
            context.fault(entry.key, &entry.node.path, message);
            return None;
        }
    }
    Some(None)
}

/// Reads the cross-traffic of `bottleneck`. Returns `Some(None)` for a link without cross-traffic, or without a bottleneck.
pub(super) fn read_cross_traffic(table: &mut TableReader<'_>, bottleneck: Option<&Bottleneck>, context: Context<'_>) -> Option<Option<CrossTraffic>> {
    let node = table.get("cross-traffic");
    let traffic = table.read("cross-traffic", unless(NONE, cross_traffic::read_cross_traffic))?;
    let (Some(traffic), Some(bottleneck), Some(node)) = (traffic, bottleneck, node) else { return Some(None) };
    let load = traffic.load(bottleneck);
    if load >= 1.0 && bottleneck.limit.is_none() {
        let message = format!(
            "cross-traffic alone needs {:.0} % of the line, and a queue without a limit would grow for ever: expected less traffic, or a limit such as queue = {{ limit = \"100 packets\" }}",
            load * 100.0
        );
        context.fault_at(node, message);
        return None;
    }
    Some(Some(traffic))
}

/// Reads the cells of a link layer: payload and overhead per cell \[bytes\].
fn read_cells(node: &Node, context: Context<'_>) -> Option<Cells> {
    const EXPECTED: &str = "a table such as { payload = \"48B\", overhead = \"5B\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("cells"), EXPECTED)?;
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
    // A cell without payload would carry no packet. The overhead may be zero.
    let payload = table.read("payload", size(1));
    let overhead = table.read("overhead", size(0));
    table.finish();
    Some(Cells { payload: NonZeroU32::new(payload?)?, overhead: overhead? })
}

/// Reads a token bucket.
pub(super) fn read_token_bucket(node: &Node, context: Context<'_>) -> Option<TokenBucket> {
    const EXPECTED: &str = "\"none\" or a table such as { rate = \"1Mbit\", burst = \"10kB\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("token-bucket"), EXPECTED)?;
    let (rate, burst) = (table.value("rate"), table.value("burst"));
    let peak = table.maybe("peak", read_peak);
    let limit = table.read("limit", unless(UNLIMITED, read_limit));
    let overhead = table.read("overhead", values::signed_size);
    table.finish();
    let framing = Framing { overhead: overhead?, cells: None };
    Some(TokenBucket { rate: rate?, burst: burst?, peak: peak?, framing, limit: limit? })
}

/// Reads the peak rate of a token bucket.
fn read_peak(node: &Node, context: Context<'_>) -> Option<Peak> {
    const EXPECTED: &str = "a table such as { rate = \"2Mbit\", burst = \"1500B\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("token-bucket.peak"), EXPECTED)?;
    let (rate, burst) = (table.value("rate"), table.value("burst"));
    table.finish();
    Some(Peak { rate: rate?, burst: burst? })
}
