//! An event that happens to a packet with a probability: a number, or a table with its correlation.

use cohaptic_wan::Chance;

use crate::document::Node;
use crate::reading::values::{self, CORRELATION, ReadNumber as _};
use crate::reading::{Context, TableReader};

/// `"1%"` or `{ probability, correlation }`.
pub(super) fn read_chance(node: &Node, context: Context<'_>) -> Option<Chance> {
    if node.as_table().is_none() {
        return values::probability(node, context).map(Chance::independent);
    }
    let mut table = TableReader::new(node, context, "a probability or a table such as { probability = \"1%\", correlation = 0.5 }")?;
    let chance = read_chance_in(&mut table, node, context);
    table.finish();
    chance
}

/// The keys `probability` and `correlation` of a table that has others too.
pub(super) fn read_chance_in(table: &mut TableReader<'_>, node: &Node, context: Context<'_>) -> Option<Chance> {
    let nodes = [table.get("probability"), table.get("correlation")];
    let probability = table.required("probability", "a probability such as \"1%\"", values::probability);
    let correlation = table.optional("correlation", 0.0, |node, context| CORRELATION.read(node, context));
    Chance::correlated(probability?, correlation?).map_err(|error| values::refuse(context, &nodes, node, &error)).ok()
}
