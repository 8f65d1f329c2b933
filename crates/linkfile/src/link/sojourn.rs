//! How long something lasts, by chance.

use cohaptic_wan::Sojourn;

use crate::document::Node;
use crate::reading::{Context, TableReader, only_one, values};

/// What stands in place of a sojourn where something else was found.
pub(super) const SOJOURN: &str =
    "a mean such as \"2s\" (exponential), { fixed = \"2s\" }, { uniform = [\"1s\", \"3s\"] } or { erlang = { mean = \"2s\", stages = 4 } }";

/// The law of a span of time, which comes to an end.
pub(super) fn read_sojourn(node: &Node, context: Context<'_>) -> Option<Sojourn> {
    let sojourn = if node.as_text().is_some() { Sojourn::Exponential(values::duration(node, context)?) } else { read_law(node, context)? };
    if !sojourn.is_sound() {
        context.fault_at(node, "a span that cannot be drawn or takes no time: expected times above zero, the longest not below the shortest");
        return None;
    }
    Some(sojourn)
}

fn read_law(node: &Node, context: Context<'_>) -> Option<Sojourn> {
    let mut table = TableReader::new(node, context, SOJOURN)?;
    let laws = [table.entry("fixed"), table.entry("uniform"), table.entry("erlang"), table.entry("exponential")];
    table.finish();
    let law = only_one(node, context, &laws, SOJOURN)?;
    match law.name.as_str() {
        "fixed" => values::duration(&law.node, context).map(Sojourn::Fixed),
        "exponential" => values::duration(&law.node, context).map(Sojourn::Exponential),
        "uniform" => {
            const EXPECTED: &str = "a list of the shortest and the longest span such as [\"1s\", \"3s\"]";
            let ends = values::list(&law.node, context, EXPECTED)?;
            let [from, to] = ends.as_slice() else {
                context.fault_at(&law.node, format!("a list of {}: expected {EXPECTED}", ends.len()));
                return None;
            };
            let (from, to) = (values::duration(from, context), values::duration(to, context));
            Some(Sojourn::Uniform(from?, to?))
        }
        _ => {
            let mut table = TableReader::new(&law.node, context, "a table such as { mean = \"2s\", stages = 4 }")?;
            let mean = table.required("mean", "the mean of all stages together, a duration", values::duration);
            let stages = table.required("stages", "a number of stages from 1 to 1000", |node, context| {
                values::integer(node, context, 1..=1000, "a number of stages from 1 to 1000")
            });
            table.finish();
            Some(Sojourn::Erlang(mean?, u32::try_from(stages?).ok()?))
        }
    }
}
