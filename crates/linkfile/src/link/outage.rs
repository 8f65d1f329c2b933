//! Reader of `outage`, the times at which a link is down, and of sojourns, the laws of durations.

use cohaptic_wan::{IdleOutages, Outage, Outages, RandomOutages, Sojourn};

use crate::document::Node;
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, only_one, values};

/// Reads outages: a list of spans, or a table `{ scheduled, random, idle }`.
pub(super) fn read_outages(node: &Node, context: Context<'_>) -> Option<Outages> {
    if node.as_table().is_none() {
        return read_scheduled(node, context);
    }
    let mut table = TableReader::new(node, context, LINK_TABLE.table("outage"), "a list, or a table with scheduled, random and idle")?;
    let (random_node, idle_node) = (table.get("random"), table.get("idle"));
    let scheduled = table.read("scheduled", read_scheduled);
    let random = table.maybe("random", read_random);
    let idle = table.maybe("idle", read_idle);
    table.finish();
    // Refusals count only after `finish`, so that every key is checked.
    let mut outages = scheduled?;
    if let Some(random) = random? {
        outages = outages.with_random(random).map_err(|error| values::refuse(context, &[random_node], node, &error)).ok()?;
    }
    if let Some(idle) = idle? {
        outages = outages.with_idle(idle).map_err(|error| values::refuse(context, &[idle_node], node, &error)).ok()?;
    }
    Some(outages)
}

/// Reads random outages: the laws of the times up and down.
fn read_random(node: &Node, context: Context<'_>) -> Option<RandomOutages> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("outage.random"), "a table such as { up = \"30s\", down = \"1s\" }")?;
    let [up, down] = ["up", "down"].map(|key| table.read_expecting(key, SOJOURN, read_sojourn));
    table.finish();
    Some(RandomOutages { up: up?, down: down? })
}

/// Reads outages of an idle link: the idle time before the link goes down, and the time until the link comes back.
fn read_idle(node: &Node, context: Context<'_>) -> Option<IdleOutages> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("outage.idle"), "a table such as { after = \"10s\", down = \"2s\" }")?;
    let (after, down) = (table.value("after"), table.value("down"));
    table.finish();
    Some(IdleOutages { after: after?, down: down? })
}

/// Reads a list of spans in which the link is down.
fn read_scheduled(node: &Node, context: Context<'_>) -> Option<Outages> {
    let elements = values::list(node, context, "a list such as [ { from = \"1s\", to = \"2s\" } ]")?;
    // Collected as options first, so that each span is read also after a refused span.
    let read: Vec<Option<Outage>> = elements.iter().map(|element| read_span(element, context)).collect();
    let mut outages = Vec::with_capacity(read.len());
    for outage in read {
        outages.push(outage?);
    }
    // The shortest refused prefix of the list ends with the faulty outage.
    Outages::new(outages.clone())
        .map_err(|error| {
            let fits = |count: &usize| Outages::new(outages[..*count].to_vec()).is_ok();
            let first = (1..=outages.len()).find(|count| !fits(count)).unwrap_or(1);
            let at = elements.get(first - 1).copied().unwrap_or(node);
            context.fault_at(at, format!("{error}: expected outages in order of time, none empty, none within another"));
        })
        .ok()
}

/// Reads a span of time: `from` and `to`, counted from the start of the run.
pub(super) fn read_span(node: &Node, context: Context<'_>) -> Option<Outage> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("outage.0"), "a table such as { from = \"1s\", to = \"2s\" }")?;
    let (from, to) = (table.read("from", values::instant), table.read("to", values::instant));
    table.finish();
    Some(Outage { from: from?, to: to? })
}

/// Expected text of a sojourn, for messages.
pub(super) const SOJOURN: &str =
    "a mean such as \"2s\" (exponential), { fixed = \"2s\" }, { uniform = [\"1s\", \"3s\"] } or { erlang = { mean = \"2s\", stages = 4 } }";

/// Reads a sojourn: the law of a duration above zero.
pub(super) fn read_sojourn(node: &Node, context: Context<'_>) -> Option<Sojourn> {
    let sojourn = if node.as_text().is_some() { Sojourn::Exponential(values::duration(node, context)?) } else { read_law(node, context)? };
    if !sojourn.is_sound() {
        context.fault_at(node, "a span that cannot be drawn or takes no time: expected times above zero, the longest not below the shortest");
        return None;
    }
    Some(sojourn)
}

/// Reads a sojourn given as a table with the name of a law.
fn read_law(node: &Node, context: Context<'_>) -> Option<Sojourn> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("outage.random.up"), SOJOURN)?;
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
            let declaration = LINK_TABLE.table("outage.random.up.erlang");
            let mut table = TableReader::new(&law.node, context, declaration, "a table such as { mean = \"2s\", stages = 4 }")?;
            let (mean, stages): (_, Option<u64>) = (table.value("mean"), table.value("stages"));
            table.finish();
            Some(Sojourn::Erlang(mean?, u32::try_from(stages?).ok()?))
        }
    }
}
