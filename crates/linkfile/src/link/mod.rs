//! The keys of a link: of `[link]`, of an entry of `[\[links\]]`, of an access line, and of a change in the timeline.

mod bottleneck;
mod chance;
mod corrupt;
mod delay;
mod distribution;
mod exclusive;
mod loss;
mod loss_pattern;
mod modulated;
mod modulators;
mod netem;
mod outage;
mod queue;
mod reorder;
mod replay;
mod slots;
mod sojourn;
mod token_bucket;
mod trace;

pub use modulators::read_modulators;

use cohaptic_wan::parameters::Key;
use cohaptic_wan::{LinkConfig, LinkModel, Loss, Order, Outages};

use crate::document::{Entry, Node, Value};
use crate::reading::{Context, TableReader, values};
use crate::schema::link::LINK;

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
    let keys = exclusive::in_force(node, context)?;
    let mut table = TableReader::new(&keys, context, "a table of link keys")?;
    if let Some(replay) = table.get("replay").filter(|replay| !is_none(replay)) {
        return replay::read_replay(replay, context).map(LinkModel::Replay);
    }
    if let Some(model) = netem::read_netem(&mut table, context)? {
        return Some(model);
    }
    match table.get("modulated").filter(|modulated| !is_none(modulated)) {
        Some(modulated) => modulated::read_modulated(modulated, &keys, context).map(LinkModel::Modulated),
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
    let duplication = table.optional("duplicate", cohaptic_wan::Chance::default(), chance::read_chance);
    let corruption = table.optional("corrupt", None, corrupt::read_corruption);
    let reorder = table.optional("reorder", None, reorder::read_reorder);
    let trace = table.maybe("trace", trace::read_trace);
    let (delivery, path) = match &trace {
        Some(Some(Some(trace::Trace::Delivery(delivery)))) => (Some(delivery.clone()), None),
        Some(Some(Some(trace::Trace::Path(path)))) => (None, Some(path.clone())),
        Some(Some(None) | None) | None => (None, None),
    };
    let bottleneck = bottleneck::read_bottleneck(&mut table, delivery, context);
    let token_bucket = table.optional("token-bucket", None, token_bucket::read_token_bucket);
    let slots = table.optional("slots", None, slots::read_slots);
    let mtu = table.optional("mtu", None, |node, context| if is_unlimited(node) { Some(None) } else { values::size(node, context).map(Some) });
    let limit = table.optional("limit", None, queue::read_packets);
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
        order: order?,
        ..LinkConfig::default()
    })
}

/// "none": what a key below says is taken away.
fn is_none(node: &Node) -> bool {
    node.as_text() == Some("none")
}

/// "unlimited": a limit that a key below says is taken away.
fn is_unlimited(node: &Node) -> bool {
    node.as_text() == Some("unlimited")
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
