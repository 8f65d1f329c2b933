//! `modulated`: keys that hold while a modulator is in one of its states.

use cohaptic_wan::{LINK_KIND_PARAMETERS, LinkConfig, Modulated};

use super::{LINK_KEYS, read_config};
use crate::document::{Node, Value, quote};
use crate::reading::{Context, TableReader, one_of, values};

/// Keys that say which kind of link it is cannot change with a state.
const NOT_OF_A_STATE: [&str; LINK_KIND_PARAMETERS.len()] = {
    let mut names = [""; LINK_KIND_PARAMETERS.len()];
    let mut key = 0;
    while key < names.len() {
        names[key] = LINK_KIND_PARAMETERS[key].name;
        key += 1;
    }
    names
};

/// `{ by = "cell", good = { … }, bad = { … } }`: the keys of each state laid over `keys`, those of the link.
pub(super) fn read_modulated(node: &Node, keys: &Node, context: Context<'_>) -> Option<Modulated> {
    const EXPECTED: &str = "\"none\" or a table such as { by = \"cell\", good = { delay = \"20ms\" }, bad = { delay = \"80ms\" } }";
    let Value::Table(table) = &node.value else {
        context.fault_at(node, format!("found {}: expected {EXPECTED}", node.describe()));
        return None;
    };
    let base = keys.without(&NOT_OF_A_STATE);
    // On their own, so that a fault in a key that every state replaces is found too.
    let sound = read_config(&base, context.of_part());
    let Some(by) = table.get("by") else {
        context.fault_at(node, "missing key by: expected the name of a modulator");
        return None;
    };
    let name = values::text(&by.node, context, "the name of a modulator")?;
    // Without the list of modulators, the fault is there.
    let modulators = context.modulators?;
    let Some((modulator, states)) = modulators.get(name) else {
        let names = modulators.keys().map(String::as_str);
        let known = if modulators.is_empty() { "an entry [[modulators]]".to_owned() } else { one_of(names, name) };
        context.fault_at(&by.node, format!("there is no modulator {}: expected {known}", quote(name)));
        return None;
    };
    let mut complete = sound.is_some();
    for entry in table.0.iter().filter(|entry| entry.name != "by") {
        if !states.contains(&entry.name) {
            let expected = one_of(states.iter().map(String::as_str), &entry.name);
            context.fault(entry.key, &entry.node.path, format!("modulator {} has no such state: expected by, or {expected}", quote(name)));
            complete = false;
        }
    }
    let configs: Vec<Option<LinkConfig>> = states
        .iter()
        .map(|state| match table.get(state) {
            None => read_config(&base, context),
            Some(entry) => {
                check_keys(&entry.node, context)?;
                read_config(&entry.node.over(&base, &[]), context)
            }
        })
        .collect();
    let configs = configs.into_iter().collect::<Option<Vec<_>>>().filter(|_| complete)?;
    Modulated::new(modulator.clone(), configs).map_err(|error| values::refuse(context, &[], node, &error)).ok()
}

/// A state may say what a link says, but not which kind of link it is.
fn check_keys(node: &Node, context: Context<'_>) -> Option<()> {
    let mut table = TableReader::new(node, context, "a table of link keys such as { delay = \"80ms\" }")?;
    let keys: Vec<&'static str> = LINK_KEYS.into_iter().filter(|key| !NOT_OF_A_STATE.contains(key)).collect();
    table.know(&keys);
    table.finish();
    Some(())
}
