//! Keys that say everything about a link: beside them nothing else can be said.

use std::borrow::Cow;

use super::{LINK_KEYS, is_none, written_together};
use crate::document::{Entry, Node};
use crate::reading::Context;

/// The keys that hold: one that says everything takes away whatever it is laid over. What is written beside it, or laid over it, is a fault.
pub(super) fn in_force<'a>(node: &'a Node, context: Context<'_>) -> Option<Cow<'a, Node>> {
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
