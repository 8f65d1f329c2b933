//! Readers of the keys of a link: in `[link]`, in an entry of `[\[links\]]`, in an access line, and in a change of the timeline.

mod bottleneck;
mod corrupt;
mod cross_traffic;
mod delay;
mod distribution;
pub(crate) mod keys;
pub(crate) mod library;
mod listed;
mod loss;
mod loss_pattern;
mod modulators;
mod netem;
mod outage;
mod profile;
mod queue;
mod reorder;
mod slots;
mod trace;

use std::borrow::Cow;

use cohaptic_wan::parameters::Table;
use cohaptic_wan::{Chance, LinkConfig, LinkModel, Order};

use crate::document::{Entry, Node, Value};
use crate::link::keys::LINK_TABLE;
use crate::reading::{Context, TableReader, values};

pub use modulators::read_modulators;

/// Reads the keys of a link. Returns `None` after a reported fault.
pub fn read_link(node: &Node, context: Context<'_>) -> Option<LinkModel> {
    read_link_of(&LINK_TABLE, node, context)
}

/// Reads the keys of a link in a table with the keys of `declaration`. Keys of the declaration that do not belong to a link are left to the caller.
pub(crate) fn read_link_of(declaration: &'static Table, node: &Node, context: Context<'_>) -> Option<LinkModel> {
    let mut table = TableReader::new(node, context, declaration, "a table of link keys such as { delay = \"24ms\" }")?;
    // A first pass over all declared keys reports the unknown keys. The second pass below reads only the keys of a link.
    table.know_all();
    table.finish();
    let resolved = profile::resolve(node, context)?;
    let (node, context) = match &resolved {
        Some(resolved) => (&resolved.keys, context.with_modulators(Some(&resolved.modulators))),
        None => (node, context),
    };
    let keys = in_force(node, context)?;
    let mut table = TableReader::new(&keys, context, &LINK_TABLE, "a table of link keys")?;
    // `in_force` has refused or removed all other keys beside a replay or words of tc.
    if let Some(replay) = table.get("replay").filter(|replay| !is_none(replay)) {
        return trace::read_replay(replay, context).map(LinkModel::Replay);
    }
    if let Some(model) = netem::read_netem(&mut table, context)? {
        return Some(model);
    }
    match table.get("modulated").filter(|modulated| !is_none(modulated)) {
        Some(modulated) => modulators::read_modulated(modulated, &keys, context).map(LinkModel::Modulated),
        None => read_config(&keys, context).map(LinkModel::Fixed),
    }
}

/// Reads the keys of a configuration of a link.
fn read_config(keys: &Node, context: Context<'_>) -> Option<LinkConfig> {
    let mut table = TableReader::new(keys, context, &LINK_TABLE, "a table of link keys")?;
    let delay = delay::read_delay(&mut table, keys, context);
    let order = table.choice("order", &Order::CHOICES);
    let loss = table.read("loss", loss::read_loss);
    let marks = table.value("mark-instead-of-loss");
    let duplication = table.read("duplicate", read_chance);
    let corruption = table.read("corrupt", corrupt::read_corruption);
    let reorder = table.read("reorder", reorder::read_reorder);
    let trace = table.read("trace", trace::read_trace);
    let (delivery, path) = match &trace {
        Some(Some(trace::Trace::Delivery(delivery))) => (Some(delivery.clone()), None),
        Some(Some(trace::Trace::Path(path))) => (None, Some(path.clone())),
        Some(None) | None => (None, None),
    };
    let bottleneck = bottleneck::read_bottleneck(&mut table, delivery, context);
    let cross_traffic = bottleneck::read_cross_traffic(&mut table, bottleneck.as_ref().and_then(Option::as_ref), context);
    let token_bucket = table.read("token-bucket", unless(NONE, bottleneck::read_token_bucket));
    let slots = table.read("slots", unless(NONE, slots::read_slots));
    let mtu = table.read("mtu", unless(UNLIMITED, values::size));
    let limit = table.read("limit", unless(UNLIMITED, queue::read_packets));
    let listed = listed::read_listed(&mut table, context);
    let outages = table.read("outage", outage::read_outages);
    // A refused recording gives neither delivery nor path. The link would be read as a link without a recording.
    trace?;
    Some(LinkConfig {
        mtu: mtu?,
        outages: outages?,
        loss: loss?,
        marks_instead_of_loss: marks?,
        duplication: duplication?,
        corruption: corruption?,
        limit: limit?,
        token_bucket: token_bucket?,
        bottleneck: bottleneck?,
        cross_traffic: cross_traffic?,
        slots: slots?,
        reorder: reorder?,
        trace: path,
        delay: delay?,
        listed: listed?,
        order: order?,
        ..LinkConfig::default()
    })
}

/// Word that removes the value of a key in the table below.
const NONE: &str = "none";
/// Word that removes the limit of a key in the table below.
const UNLIMITED: &str = "unlimited";

/// Returns whether a value is the word `none`.
fn is_none(node: &Node) -> bool {
    node.as_text() == Some(NONE)
}

/// Wraps the reader `read`: the wrapped reader returns `Some(None)` for `word`, and the answer of `read` for any other value.
fn unless<T>(word: &'static str, read: fn(&Node, Context<'_>) -> Option<T>) -> impl FnOnce(&Node, Context<'_>) -> Option<Option<T>> {
    move |node: &Node, context: Context<'_>| if node.as_text() == Some(word) { Some(None) } else { read(node, context).map(Some) }
}

/// Returns whether two keys were written in the same table, as opposed to a key laid over another table.
fn written_together(a: &Entry, b: &Entry) -> bool {
    let table = |entry: &Entry| entry.node.path.rsplit_once('.').map(|(table, _)| table.to_owned());
    // Each override is a source of its own, so a key from an override always counts as laid over the keys of the file.
    a.key.source == b.key.source && table(a) == table(b)
}

/// Returns whether a value is a table without keys.
#[must_use]
pub fn is_empty(node: &Node) -> bool {
    matches!(&node.value, Value::Table(table) if table.0.is_empty())
}

/// Reads a chance per packet: `"1%"` or `{ probability, correlation }`.
fn read_chance(node: &Node, context: Context<'_>) -> Option<Chance> {
    const EXPECTED: &str = "a probability or a table such as { probability = \"1%\", correlation = 0.5 }";
    if node.as_table().is_none() {
        return values::probability(node, context).map(Chance::independent);
    }
    // The table of `duplicate` stands for every chance, since its keys are the same.
    let mut table = TableReader::new(node, context, LINK_TABLE.table("duplicate"), EXPECTED)?;
    let chance = read_chance_in(&mut table, node, context);
    table.finish();
    chance
}

/// Reads the keys `probability` and `correlation` of a table that may have further keys.
fn read_chance_in(table: &mut TableReader<'_>, node: &Node, context: Context<'_>) -> Option<Chance> {
    let nodes = [table.get("probability"), table.get("correlation")];
    let (probability, correlation) = (table.value("probability"), table.value("correlation"));
    Chance::correlated(probability?, correlation?).map_err(|error| values::refuse(context, &nodes, node, &error)).ok()
}

/// Returns the keys in force. `netem` and `replay` describe the whole link, and remove all keys below. Another key in the same table as such a description, or
/// laid over the description, is a fault.
fn in_force<'a>(node: &'a Node, context: Context<'_>) -> Option<Cow<'a, Node>> {
    let table = node.as_table()?;
    // Entries stand in the order of laying over, so the last whole description applies.
    let whole = table.0.iter().enumerate().rfind(|(_, entry)| says_everything(entry));
    let Some((place, whole)) = whole else { return Some(Cow::Borrowed(node)) };
    let mut taken_away = Vec::new();
    for (index, entry) in table.0.iter().enumerate() {
        // The profile belongs to the words of tc.
        let belongs = entry.name == whole.name || (whole.name == "netem" && entry.name == "netem-profile");
        let known = LINK_TABLE.key(&entry.name).is_some();
        if belongs || !known || is_none_of_whole(entry) {
            continue;
        }
        if index > place || written_together(entry, whole) {
            let (first, last) = if entry.key < whole.key { (entry, whole) } else { (whole, entry) };
            let message = format!(
                "{} and {} exclude each other: {} says everything about this link; expected only one of them, or {} = \"none\"",
                last.name, first.name, whole.name, whole.name
            );
            context.fault(last.key, &last.node.path, message);
            return None;
        }
        taken_away.push(entry.name.as_str());
    }
    Some(Cow::Owned(node.without(&taken_away)))
}

/// Returns whether a key describes the whole link.
fn says_everything(entry: &Entry) -> bool {
    matches!(entry.name.as_str(), "netem" | "replay") && !is_none(&entry.node)
}

/// Returns whether a key of a link kind is `none`. `netem = "none"` beside `replay` contradicts nothing.
fn is_none_of_whole(entry: &Entry) -> bool {
    matches!(entry.name.as_str(), "netem" | "replay" | "modulated" | "profile") && is_none(&entry.node)
}
