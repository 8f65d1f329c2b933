//! Reader of `slots`: a line that releases packets only at certain instants.

use core::num::NonZeroU64;

use cohaptic_wan::Slots;

use super::delay::read_delay;
use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, values};

/// Reads the law of the gaps between slots, and the largest numbers of packets and bytes per slot.
pub(super) fn read_slots(node: &Node, context: Context<'_>) -> Option<Slots> {
    const EXPECTED: &str = "\"none\" or a table such as { min = \"10ms\", max = \"20ms\" }";
    let mut table = TableReader::new(node, context, LINK_TABLE.table("slots"), EXPECTED)?;
    let ends = [table.entry("min"), table.entry("max")];
    let law = [table.entry("delay"), table.entry("jitter")];
    // `min` and `max` give a uniform law, `delay` and `jitter` any other law. The first given key stands for the pair in a message.
    let slots = match (ends.into_iter().flatten().next(), law.into_iter().flatten().next()) {
        (Some(end), Some(law)) => {
            let (first, last) = if end.key < law.key { (end, law) } else { (law, end) };
            let message = format!("{} and {} exclude each other: expected either min and max, or delay and jitter", last.name, first.name);
            context.fault(last.key, &last.node.path, message);
            None
        }
        (None, Some(_)) => read_delay(&mut table, node, context).map(Slots::drawn),
        (_, None) => read_ends(&mut table, node, context),
    };
    let packets: Option<Option<u64>> = table.maybe_value("packets");
    let bytes = table.maybe("bytes", |node, context| {
        let bytes = NonZeroU64::new(values::size(node, context)?.get());
        if bytes.is_none() {
            context.fault_at(node, "zero is out of range: expected a size above zero such as \"1500B\"");
        }
        bytes
    });
    table.finish();
    let mut slots = slots?;
    (slots.packets, slots.bytes) = (packets?.and_then(NonZeroU64::new), bytes?);
    Some(slots)
}

/// Reads uniform gaps between `min` and `max`. Without `max`, every gap is `min`.
fn read_ends(table: &mut TableReader<'_>, node: &Node, context: Context<'_>) -> Option<Slots> {
    let nodes = [table.get("min"), table.get("max")];
    let (min, max) = (table.value("min"), table.maybe_value("max"));
    let (min, max) = (min?, max?);
    Slots::new(min, max.unwrap_or(min)).map_err(|error| values::refuse(context, &nodes, node, &error)).ok()
}
