//! Reader of `profile`: a link of the library, over which the other keys of the link are laid.

use std::sync::Arc;

use super::library::ProfileName;
use super::{is_none, says_everything, written_together};
use crate::document::{Entry, Node, Place, Table, Value, join};
use crate::reading::{Context, Modulators, values};

/// Keys of a link whose profile was put in, with the modulators of the profile.
pub(super) struct Resolved {
    /// Keys of the profile, and over them the keys of the link. The key `profile` itself is gone.
    pub(super) keys: Node,
    pub(super) modulators: Arc<Modulators>,
}

/// Puts the keys of a profile below the other keys of a link. Returns `Some(None)` for a link without a profile, and `None` after a fault.
pub(super) fn resolve(node: &Node, context: Context<'_>) -> Option<Option<Resolved>> {
    let table = node.as_table()?;
    let Some((place, entry)) = table.0.iter().enumerate().find(|(_, entry)| entry.name == "profile") else { return Some(None) };
    if is_none(&entry.node) {
        return Some(None);
    }
    let text = values::text(&entry.node, context, "the name of a link of the library, such as \"starlink/up\"")?;
    let named = text.parse().and_then(|name: ProfileName| name.one_direction().map(|direction| (name.profile, direction)));
    let (profile, direction) = match named {
        Ok(named) => named,
        Err(error) => {
            context.fault_at(&entry.node, error.to_string());
            return None;
        }
    };
    if let Some((whole_place, whole)) = table.0.iter().enumerate().rfind(|(_, entry)| says_everything(entry)) {
        // The keys of one table have no order, so neither of two whole descriptions in one table is laid over the other.
        if written_together(whole, entry) {
            let message = format!("profile and {} exclude each other: expected only one of them, or {} = \"none\"", whole.name, whole.name);
            context.fault(entry.key, &entry.node.path, message);
            return None;
        }
        // A whole description that is laid over the profile replaces the profile, together with all other keys.
        if whole_place > place {
            return Some(None);
        }
    }
    let title = profile.title();
    context.note_profile(if profile.is_symmetric() { title } else { format!("{title}/{}", direction.word()) });
    // Later entries are laid over earlier entries. An entry of another table before the profile is below the profile, and has no effect: a profile describes
    // the whole link.
    let is_over = |(index, other): (usize, &&Entry)| index != place && (index > place || written_together(other, entry));
    let over: Vec<Entry> = table.0.iter().enumerate().filter(|(index, other)| is_over((*index, other))).map(|(_, other)| other.clone()).collect();
    // A key of the user holds in every state. The same key is removed from the states of the profile, because keys of states are laid over keys of the link.
    let own: Vec<&str> = over.iter().map(|entry| entry.name.as_str()).collect();
    let below = without_in_states(&at(&profile.line(direction).keys, entry.node.place, &node.path), &own);
    let over = Node { value: Value::Table(Table(over.clone())), place: node.place, path: node.path.clone() };
    // A `modulated` that is laid over the profile names modulators of the file, so these stay known.
    let mut modulators = context.modulators.map_or_else(Modulators::new, |modulators| modulators.as_ref().clone());
    if over.as_table().is_none_or(|table| table.get("modulated").is_none()) {
        modulators.extend(profile.modulators.iter().map(|(name, modulator)| (name.clone(), modulator.clone())));
    }
    Some(Some(Resolved { keys: over.over(&below, &[]), modulators: Arc::new(modulators) }))
}

/// Returns the keys of a profile without `keys` in the states of its modulator, because a key laid over a profile holds in every state.
fn without_in_states(line: &Node, keys: &[&str]) -> Node {
    let mut line = line.clone();
    if let Value::Table(table) = &mut line.value
        && let Some(entry) = table.0.iter_mut().find(|entry| entry.name == "modulated")
    {
        let modulated = Arc::make_mut(&mut entry.node);
        if let Value::Table(states) = &mut modulated.value {
            states.0.iter_mut().filter(|state| state.name != "by").for_each(|state| state.node = Arc::new(state.node.without(keys)));
        }
    }
    line
}

/// Returns a value of the library as if it stood at `place` of the user's file, where a fault of the value is shown.
fn at(node: &Node, place: Place, path: &str) -> Node {
    let value = match &node.value {
        Value::Table(table) => {
            let entry = |entry: &Entry| {
                let path = join(path, &entry.name);
                Entry { name: entry.name.clone(), key: place, node: Arc::new(at(&entry.node, place, &path)) }
            };
            Value::Table(Table(table.0.iter().map(entry).collect()))
        }
        Value::List(list) => Value::List(list.iter().map(|element| Arc::new(at(element, place, path))).collect()),
        value @ (Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date) => value.clone(),
    };
    Node { value, place, path: path.to_owned() }
}
