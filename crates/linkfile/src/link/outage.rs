//! `outage`: when a link is down.

use cohaptic_wan::{IdleOutages, Outage, Outages, RandomOutages};

use super::sojourn::{SOJOURN, read_sojourn};
use crate::document::Node;
use crate::reading::{Context, TableReader, values};

/// A list of spans, or `{ scheduled, random, idle }`.
pub(super) fn read_outages(node: &Node, context: Context<'_>) -> Option<Outages> {
    if node.as_table().is_none() {
        return read_scheduled(node, context);
    }
    let mut table = TableReader::new(node, context, "a list, or a table with scheduled, random and idle")?;
    let (random_node, idle_node) = (table.get("random"), table.get("idle"));
    let scheduled = table.optional("scheduled", Outages::default(), read_scheduled);
    let random = table.maybe("random", read_random);
    let idle = table.maybe("idle", read_idle);
    table.finish();
    let mut outages = scheduled?;
    if let Some(random) = random? {
        outages = outages.with_random(random).map_err(|error| values::refuse(context, &[random_node], node, &error)).ok()?;
    }
    if let Some(idle) = idle? {
        outages = outages.with_idle(idle).map_err(|error| values::refuse(context, &[idle_node], node, &error)).ok()?;
    }
    Some(outages)
}

fn read_random(node: &Node, context: Context<'_>) -> Option<RandomOutages> {
    let mut table = TableReader::new(node, context, "a table such as { up = \"30s\", down = \"1s\" }")?;
    let up = table.required("up", SOJOURN, read_sojourn);
    let down = table.required("down", SOJOURN, read_sojourn);
    table.finish();
    Some(RandomOutages { up: up?, down: down? })
}

fn read_idle(node: &Node, context: Context<'_>) -> Option<IdleOutages> {
    let mut table = TableReader::new(node, context, "a table such as { after = \"10s\", down = \"2s\" }")?;
    let after = table.required("after", "how long nothing must be sent, a duration such as \"10s\"", values::positive_duration);
    let down = table.required("down", "how long the link is down then, a duration such as \"2s\"", values::positive_duration);
    table.finish();
    Some(IdleOutages { after: after?, down: down? })
}

fn read_scheduled(node: &Node, context: Context<'_>) -> Option<Outages> {
    let elements = values::list(node, context, "a list such as [ { from = \"1s\", to = \"2s\" } ]")?;
    let read: Vec<Option<Outage>> = elements.iter().map(|element| read_span(element, context)).collect();
    let mut outages = Vec::with_capacity(read.len());
    for outage in read {
        outages.push(outage?);
    }
    // Grown one at a time, so that the first that does not fit is known without looking into the error.
    Outages::new(outages.clone())
        .map_err(|error| {
            let fits = |count: &usize| Outages::new(outages[..*count].to_vec()).is_ok();
            let first = (1..=outages.len()).find(|count| !fits(count)).unwrap_or(1);
            let at = elements.get(first - 1).copied().unwrap_or(node);
            context.fault_at(at, format!("{error}: expected outages in order of time, none empty, none within another"));
        })
        .ok()
}

/// A span of time.
pub(super) fn read_span(node: &Node, context: Context<'_>) -> Option<Outage> {
    let mut table = TableReader::new(node, context, "a table such as { from = \"1s\", to = \"2s\" }")?;
    let from = table.required("from", "a time such as \"1s\"", values::instant);
    let to = table.required("to", "a time such as \"2s\"", values::instant);
    table.finish();
    Some(Outage { from: from?, to: to? })
}
