//! Reader of `reorder`: packets that are moved out of order on purpose.

use core::num::NonZeroU32;

use cohaptic_wan::{Chance, Displacement, Reorder};

use super::read_chance_in;
use crate::document::{Entry, Node};
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, only_one, values};

/// Reads `"25%"` (such packets jump ahead), or `{ probability, correlation }` with `gap`, with `behind` and `at-most`, or with `later`. Returns `Some(None)` if
/// no packet is ever moved.
pub(super) fn read_reorder(node: &Node, context: Context<'_>) -> Option<Option<Reorder>> {
    // A gap of 1 lets any packet jump, with the given probability.
    let any = Displacement::Jump { gap: NonZeroU32::MIN };
    if node.as_table().is_none() {
        let packets = Chance::independent(values::probability(node, context)?);
        return Some((!packets.is_never()).then_some(Reorder { packets, how: any }));
    }
    let declaration = LINK_TABLE.table("reorder");
    let mut table = TableReader::new(node, context, declaration, "a probability or a table such as { probability = \"25%\", gap = 5 }")?;
    let packets = read_chance_in(&mut table, node, context);
    let how = [table.entry("gap"), table.entry("behind"), table.entry("later")];
    // Asked for before `finish`, so that the key counts as known and gets the message below.
    let at_most_entry = table.entry("at-most");
    let at_most = table.maybe_value("at-most");
    if how[1].is_some() && at_most_entry.is_none() {
        table.miss("at-most", "how long a packet is held at most, a duration such as \"50ms\"");
    }
    table.finish();
    let how = if how.iter().all(Option::is_none) { None } else { Some(only_one(node, context, &how, "gap, behind and later")?) };
    if let Some(at_most) = at_most_entry.filter(|_| how.is_none_or(|how| how.name != "behind")) {
        context.fault(at_most.key, &at_most.node.path, "at-most says how long a packet is held: expected it together with behind");
        return None;
    }
    let count = |how: &Entry| {
        let count: u64 = values::of_key(declaration.key(&how.name)?, &how.node, context)?;
        NonZeroU32::new(u32::try_from(count).ok()?)
    };
    let how = match how {
        None => any,
        Some(how) if how.name == "gap" => Displacement::Jump { gap: count(how)? },
        Some(how) if how.name == "behind" => {
            let packets = count(how);
            let at_most = at_most?;
            // `miss` has reported a missing key, except in a part, which may lack the key.
            let at_most = if context.partial { at_most.unwrap_or_default() } else { at_most? };
            Displacement::Behind { packets: packets?, at_most }
        }
        Some(how) => Displacement::Later { by: values::duration(&how.node, context)? },
    };
    let packets = packets?;
    Some((!packets.is_never()).then_some(Reorder { packets, how }))
}
