//! The keys of a link: of `[link]`, of an entry of `[\[links\]]`, of an access line, and of a change in the timeline.

mod bottleneck;
mod corrupt;
mod delay;
mod distribution;
mod listed;
mod loss;
mod loss_pattern;
mod modulators;
mod netem;
mod outage;
mod queue;
mod reorder;
mod slots;
mod trace;

use std::borrow::Cow;

use cohaptic_wan::parameters::Key;
use cohaptic_wan::{Chance, LinkConfig, LinkModel, Loss, Order, Outages};

use crate::document::{Entry, Node, Value};
use crate::reading::values::{self, CORRELATION, ReadNumber as _};
use crate::reading::{Context, TableReader};
use crate::schema::link::LINK;

pub use modulators::read_modulators;

/// The keys of a link, in the order in which they are explained.
pub static LINK_KEYS: [&str; names_in(&LINK)] = {
    let mut names = [""; names_in(&LINK)];
    let (mut count, mut group) = (0, 0);
    while group < LINK.len() {
        let mut key = 0;
        while key < LINK[group].len() {
            names[count] = LINK[group][key].name;
            (count, key) = (count + 1, key + 1);
        }
        group += 1;
    }
    names
};

const fn names_in(groups: &[&[Key]]) -> usize {
    let (mut count, mut group) = (0, 0);
    while group < groups.len() {
        count += groups[group].len();
        group += 1;
    }
    count
}

/// Reads the keys of a link. `beside`: keys of the same table that somebody else reads.
pub fn read_link(node: &Node, context: Context<'_>, beside: &[&'static str]) -> Option<LinkModel> {
    let mut table = TableReader::new(node, context, "a table of link keys such as { delay = \"24ms\" }")?;
    table.know(beside);
    table.know(&LINK_KEYS);
    table.finish();
    let keys = in_force(node, context)?;
    let mut table = TableReader::new(&keys, context, "a table of link keys")?;
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

/// Reads the keys that say what one configuration does.
fn read_config(keys: &Node, context: Context<'_>) -> Option<LinkConfig> {
    let mut table = TableReader::new(keys, context, "a table of link keys")?;
    let orders = [("allow-reordering", Order::AllowReordering), ("in-order", Order::InOrder)];
    let delay = delay::read_delay(&mut table, keys, context);
    let order = table.optional("order", Order::AllowReordering, |node, context| values::choice(node, context, &orders));
    let loss = table.optional("loss", Loss::None, loss::read_loss);
    let marks = table.optional("mark-instead-of-loss", false, values::boolean);
    let duplication = table.optional("duplicate", Chance::default(), read_chance);
    let corruption = table.optional("corrupt", None, corrupt::read_corruption);
    let reorder = table.optional("reorder", None, reorder::read_reorder);
    let trace = table.maybe("trace", trace::read_trace);
    let (delivery, path) = match &trace {
        Some(Some(Some(trace::Trace::Delivery(delivery)))) => (Some(delivery.clone()), None),
        Some(Some(Some(trace::Trace::Path(path)))) => (None, Some(path.clone())),
        Some(Some(None) | None) | None => (None, None),
    };
    let bottleneck = bottleneck::read_bottleneck(&mut table, delivery, context);
    let token_bucket = table.optional("token-bucket", None, unless(NONE, bottleneck::read_token_bucket));
    let slots = table.optional("slots", None, unless(NONE, slots::read_slots));
    let mtu = table.optional("mtu", None, unless(UNLIMITED, values::size));
    let limit = table.optional("limit", None, unless(UNLIMITED, queue::read_packets));
    let listed = listed::read_listed(&mut table, context);
    let outages = table.optional("outage", Outages::default(), outage::read_outages);
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
        slots: slots?,
        reorder: reorder?,
        trace: path,
        delay: delay?,
        listed: listed?,
        order: order?,
        ..LinkConfig::default()
    })
}

/// The word that takes away what a key below says.
const NONE: &str = "none";
/// The word that takes away a limit that a key below says.
const UNLIMITED: &str = "unlimited";

fn is_none(node: &Node) -> bool {
    node.as_text() == Some(NONE)
}

/// A reader of a value that a word takes away: the answer to the word is `None`.
fn unless<'a, T>(
    word: &'static str,
    read: impl FnOnce(&'a Node, Context<'a>) -> Option<T>,
) -> impl FnOnce(&'a Node, Context<'a>) -> Option<Option<T>> {
    move |node, context| if node.as_text() == Some(word) { Some(None) } else { read(node, context).map(Some) }
}

/// Reads a table of two values that must be there, each with its key, what it is, and its reader.
fn read_two<'a, A, B>(
    node: &'a Node,
    context: Context<'a>,
    expected: &str,
    (key, about, read): (&'static str, &str, impl FnOnce(&'a Node, Context<'a>) -> Option<A>),
    (other_key, other_about, read_other): (&'static str, &str, impl FnOnce(&'a Node, Context<'a>) -> Option<B>),
) -> Option<(A, B)> {
    let mut table = TableReader::new(node, context, expected)?;
    let (one, other) = (table.required(key, about, read), table.required(other_key, other_about, read_other));
    table.finish();
    Some((one?, other?))
}

/// Whether two keys were written in the same table, as opposed to one being laid over the other.
fn written_together(a: &Entry, b: &Entry) -> bool {
    let table = |entry: &Entry| entry.node.path.rsplit_once('.').map(|(table, _)| table.to_owned());
    a.key.source == b.key.source && table(a) == table(b)
}

/// Whether a table has no keys.
#[must_use]
pub fn is_empty(node: &Node) -> bool {
    matches!(&node.value, Value::Table(table) if table.0.is_empty())
}

/// `"1%"` or `{ probability, correlation }`.
fn read_chance(node: &Node, context: Context<'_>) -> Option<Chance> {
    if node.as_table().is_none() {
        return values::probability(node, context).map(Chance::independent);
    }
    let mut table = TableReader::new(node, context, "a probability or a table such as { probability = \"1%\", correlation = 0.5 }")?;
    let chance = read_chance_in(&mut table, node, context);
    table.finish();
    chance
}

/// The keys `probability` and `correlation` of a table that has others too.
fn read_chance_in(table: &mut TableReader<'_>, node: &Node, context: Context<'_>) -> Option<Chance> {
    let nodes = [table.get("probability"), table.get("correlation")];
    let probability = table.required("probability", "a probability such as \"1%\"", values::probability);
    let correlation = table.optional("correlation", 0.0, |node, context| CORRELATION.read(node, context));
    Chance::correlated(probability?, correlation?).map_err(|error| values::refuse(context, &nodes, node, &error)).ok()
}

/// The keys that hold: one that says everything takes away whatever it is laid over. A key next to it, or laid over it, is a fault.
fn in_force<'a>(node: &'a Node, context: Context<'_>) -> Option<Cow<'a, Node>> {
    let table = node.as_table()?;
    // Entries stand in the order in which they were laid over each other.
    let whole = table.0.iter().enumerate().rfind(|(_, entry)| says_everything(entry));
    let Some((place, whole)) = whole else { return Some(Cow::Borrowed(node)) };
    let mut taken_away = Vec::new();
    for (index, entry) in table.0.iter().enumerate() {
        let belongs = entry.name == whole.name || (whole.name == "netem" && entry.name == "netem-profile");
        let known = LINK_KEYS.contains(&entry.name.as_str());
        if belongs || !known || is_none_of_whole(entry) {
            continue;
        }
        if index > place || written_together(entry, whole) {
            let (first, last) = if entry.key < whole.key { (entry, whole) } else { (whole, entry) };
            let message = format!(
                "{} beside {}: {} says everything about this link: expected only one of them, or {} = \"none\"",
                last.name, first.name, whole.name, whole.name
            );
            context.fault(last.key, &last.node.path, message);
            return None;
        }
        taken_away.push(entry.name.as_str());
    }
    Some(Cow::Owned(node.without(&taken_away)))
}

fn says_everything(entry: &Entry) -> bool {
    matches!(entry.name.as_str(), "netem" | "replay") && !is_none(&entry.node)
}

/// `netem = "none"` beside `replay` says nothing that contradicts it.
fn is_none_of_whole(entry: &Entry) -> bool {
    matches!(entry.name.as_str(), "netem" | "replay" | "modulated") && is_none(&entry.node)
}
