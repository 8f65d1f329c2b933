//! The keys of a link: of `[link]`, of an entry of `[\[links\]]`, of an access line, and of a change in the timeline.

use cohaptic_units::{Bytes, Probability, Rate};
use cohaptic_wan::{
    Bottleneck, Delay, Distribution, Framing, GilbertElliott, Jitter, LinkConfig, LinkModel, Loss, Order, Outage, Outages, QueueLimit,
};

use crate::context::Context;
use crate::table_reader::TableReader;
use crate::tree::{Entry, Node, Value, quote};
use crate::values;

/// What may be said about a link.
pub(crate) const LINK_KEYS: [&str; 8] = ["delay", "jitter", "order", "loss", "rate", "queue", "overhead", "outage"];

/// Reads the keys of a link. `beside`: keys of the same table that somebody else reads.
pub(crate) fn read_link(node: &Node, context: Context<'_>, beside: &[&'static str]) -> Option<LinkModel> {
    let mut table = TableReader::new(node, context, "a table of link keys such as { delay = \"24ms\" }")?;
    table.know(beside);
    table.know(&LINK_KEYS);
    let delay_node = table.get("delay");
    let delay = table.optional("delay", core::time::Duration::ZERO, values::duration);
    let jitter_node = table.get("jitter");
    let jitter = table.maybe("jitter", read_jitter);
    let orders = [("allow-reordering", Order::AllowReordering), ("in-order", Order::InOrder)];
    let order = table.optional("order", Order::AllowReordering, |node, context| values::choice(node, context, &orders));
    let loss = table.optional("loss", Loss::None, read_loss);
    let bottleneck = read_bottleneck(&mut table, context);
    let outages = table.optional("outage", Outages::default(), read_outages);
    table.finish();
    let mean = delay?;
    let delay = match jitter? {
        None => Delay::constant(mean),
        Some(jitter) => Delay::with_jitter(mean, jitter)
            .map_err(|error| {
                // Of the two keys that do not fit together, the one that was written last is the one to look at.
                let last = [delay_node, jitter_node].into_iter().flatten().max_by_key(|node| node.place);
                let error = error.to_string();
                let message = if error.contains("expected") { error } else { format!("{error}: expected a shorter one") };
                context.fault_at(last.unwrap_or(node), message);
            })
            .ok()?,
    };
    let config = LinkConfig { outages: outages?, loss: loss?, bottleneck: bottleneck?, delay, order: order?, ..LinkConfig::default() };
    Some(config.into())
}

fn read_jitter(node: &Node, context: Context<'_>) -> Option<Jitter> {
    if node.as_table().is_none() {
        return Some(Jitter::new(values::duration(node, context)?, Distribution::Normal));
    }
    let mut table = TableReader::new(node, context, "a duration or a table")?;
    let sd = table.required("sd", "the standard deviation, a duration such as \"2ms\"", values::duration);
    let laws = [("normal", Distribution::Normal), ("uniform", Distribution::Uniform)];
    let distribution = table.optional("distribution", Distribution::Normal, |node, context| {
        values::choice(node, context, &[0, 1].map(|i: usize| (laws[i].0, i))).map(|i| laws[i].1.clone())
    });
    table.finish();
    Some(Jitter::new(sd?, distribution?))
}

fn read_loss(node: &Node, context: Context<'_>) -> Option<Loss> {
    if node.as_table().is_none() {
        let probability = values::probability(node, context)?;
        return Some(if probability == Probability::ZERO { Loss::None } else { Loss::Independent(probability) });
    }
    let mut table = TableReader::new(node, context, "a probability or a table")?;
    let chain = table.required("gilbert-elliott", "a table such as { p = 0.01, r = 0.1 }", read_gilbert_elliott);
    table.finish();
    Some(Loss::GilbertElliott(chain?))
}

fn read_gilbert_elliott(node: &Node, context: Context<'_>) -> Option<GilbertElliott> {
    let mut table = TableReader::new(node, context, "a table such as { p = 0.01, r = 0.1 }")?;
    let p = table.required("p", "a probability, of going from good to bad", values::probability);
    let r = table.maybe("r", values::probability);
    let h = table.optional("h", Probability::ZERO, values::probability);
    let k = table.optional("k", Probability::ONE, values::probability);
    table.finish();
    let p = p?;
    let r = match r? {
        Some(r) => r,
        None => Probability::new(1.0 - p.get()).ok()?,
    };
    Some(GilbertElliott { p, r, h: h?, k: k? })
}

/// `rate`, `queue` and `overhead`.
fn read_bottleneck(table: &mut TableReader<'_>, context: Context<'_>) -> Option<Option<Bottleneck>> {
    let rate_entry = table.entry("rate");
    let queue_entry = table.entry("queue");
    let overhead_entry = table.entry("overhead");
    let rate = table.maybe("rate", read_rate);
    let limit = table.optional("queue", None, read_queue);
    let overhead = table.optional("overhead", Bytes::ZERO, values::size);
    let (rate, limit, overhead) = (rate?.flatten(), limit?, overhead?);
    if let Some(rate) = rate {
        let overhead = i32::try_from(overhead.get()).unwrap_or(i32::MAX);
        return Some(Some(Bottleneck { framing: Framing { overhead, cells: None }, limit, ..Bottleneck::at_rate(rate) }));
    }
    for entry in [queue_entry, overhead_entry].into_iter().flatten() {
        if !context.partial && rate_entry.is_none_or(|rate| written_together(rate, entry)) {
            let message = format!("{} means nothing on a link without a rate: expected a key rate such as \"1Mbit\" beside it", entry.name);
            context.fault(entry.key, &entry.node.path, message);
            return None;
        }
    }
    Some(None)
}

/// Whether two keys were written in the same table, as opposed to one being laid over the other: an inherited queue is taken away with its rate.
fn written_together(a: &Entry, b: &Entry) -> bool {
    let table = |entry: &Entry| entry.node.path.rsplit_once('.').map(|(table, _)| table.to_owned());
    a.key.source == b.key.source && table(a) == table(b)
}

/// `None` for "unlimited".
fn read_rate(node: &Node, context: Context<'_>) -> Option<Option<Rate>> {
    if node.as_text() == Some("unlimited") { Some(None) } else { values::rate(node, context).map(Some) }
}

fn read_queue(node: &Node, context: Context<'_>) -> Option<Option<QueueLimit>> {
    let mut table = TableReader::new(node, context, "a table such as { limit = \"100 packets\" }")?;
    let limit = table.required("limit", "a limit such as \"100 packets\" or \"64kB\"", read_limit);
    let discipline = table.optional("discipline", (), |node, context| values::choice(node, context, &[("tail-drop", ())]));
    table.finish();
    discipline?;
    Some(Some(limit?))
}

fn read_limit(node: &Node, context: Context<'_>) -> Option<QueueLimit> {
    const EXPECTED: &str = "a limit such as \"100 packets\" or \"64kB\"";
    let text = values::text(node, context, EXPECTED)?;
    let packets = text.trim().strip_suffix("packets").or_else(|| text.trim().strip_suffix("packet"));
    let limit = match packets {
        Some(number) => {
            let number = number.trim();
            let plain = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
            plain.then(|| number.parse().ok()).flatten().map(QueueLimit::Packets)
        }
        None => cohaptic_units::parse::size(text).ok().map(QueueLimit::Bytes),
    };
    if limit.is_none() {
        context.fault_at(node, format!("{} is no limit of a queue: expected {EXPECTED}", quote(text)));
    }
    limit
}

fn read_outages(node: &Node, context: Context<'_>) -> Option<Outages> {
    let elements = values::list(node, context, "a list such as [ { from = \"1s\", to = \"2s\" } ]")?;
    let read: Vec<Option<Outage>> = elements.iter().map(|element| read_outage(element, context)).collect();
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

fn read_outage(node: &Node, context: Context<'_>) -> Option<Outage> {
    let mut table = TableReader::new(node, context, "a table such as { from = \"1s\", to = \"2s\" }")?;
    let from = table.required("from", "a time such as \"1s\"", values::instant);
    let to = table.required("to", "a time such as \"2s\"", values::instant);
    table.finish();
    Some(Outage { from: from?, to: to? })
}

/// Whether a table has no keys.
pub(crate) fn is_empty(node: &Node) -> bool {
    matches!(&node.value, Value::Table(table) if table.0.is_empty())
}
