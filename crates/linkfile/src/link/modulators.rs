//! Readers of `[\[modulators\]]` and `modulated`. A modulator is a chain of states with a name, so that several links can follow the same chain. The keys of a
//! state under `modulated` hold while the modulator is in this state.

use std::sync::Arc;

use cohaptic_wan::{LINK_KIND_PARAMETERS, LinkConfig, MODULATOR, Modulated, Modulator, ModulatorState};

use super::outage::{SOJOURN, read_sojourn};
use super::read_config;
use crate::document::{Node, Value, quote};
use crate::link::keys::LINK_TABLE;
use crate::reading::values::{self, ReadNumber as _, WEIGHT};
use crate::reading::{Context, Modulators, TableReader, one_of};

/// Reads the list of modulators. Returns `None` if a modulator was refused. A missing list is an empty list.
pub fn read_modulators(node: Option<&Node>, context: Context<'_>) -> Option<Arc<Modulators>> {
    let Some(node) = node else { return Some(Arc::default()) };
    let entries = values::list(node, context, "entries [[modulators]]")?;
    let mut modulators = Modulators::new();
    let mut complete = true;
    for entry in entries {
        let Some((name, name_node, read)) = read_modulator(entry, context) else {
            complete = false;
            continue;
        };
        if modulators.insert(name.clone(), read).is_some() {
            context.fault_at(name_node, format!("there is a modulator {} already: expected another name", quote(&name)));
            complete = false;
        }
    }
    complete.then(|| Arc::new(modulators))
}

/// Modulator, and the names of the states in order.
type Read = (Modulator, Vec<String>);

/// Reads a modulator: the name, the node of the name, the chain, and the names of the states.
fn read_modulator<'a>(node: &'a Node, context: Context<'a>) -> Option<(String, &'a Node, Read)> {
    let mut table = TableReader::new(node, context, &MODULATOR, "a table with name and states")?;
    let (name_node, states_node) = (table.get("name"), table.get("states"));
    let name = table.read("name", read_name);
    let states = table.read("states", read_states);
    table.finish();
    let (name, (names, states)) = (name?, states?);
    match Modulator::new(&name, states) {
        Ok(modulator) => Some((name, name_node?, (modulator, names))),
        Err(error) => {
            values::refuse(context, &[], states_node?, &error);
            None
        }
    }
}

/// Reads the name of a modulator or of a state. The name `by` is reserved, because the key `by` stands beside the states under `modulated`.
fn read_name(node: &Node, context: Context<'_>) -> Option<String> {
    const EXPECTED: &str = "a name without space or dot, and not \"by\"";
    let name = values::text(node, context, EXPECTED)?;
    if name.is_empty() || name == "by" || name.contains(|c: char| c.is_whitespace() || c.is_control() || c == '.') {
        context.fault_at(node, format!("{} cannot be this name: expected {EXPECTED}", quote(name)));
        return None;
    }
    Some(name.to_owned())
}

/// Reads the states of a modulator: names, and sojourns with the weights of the next states.
fn read_states(node: &Node, context: Context<'_>) -> Option<(Vec<String>, Vec<ModulatorState>)> {
    let entries = values::list(node, context, "a list of states such as [{ name = \"good\", sojourn = \"2s\" }]")?;
    let mut names: Vec<String> = Vec::new();
    let mut tables = Vec::new();
    for entry in entries {
        let mut table = TableReader::new(entry, context, MODULATOR.table("states.0"), "a table with name, sojourn and next")?;
        let name_node = table.get("name");
        let name = table.read("name", read_name);
        let sojourn = table.maybe("sojourn", read_sojourn);
        let next = table.get("next");
        table.finish();
        let name = name?;
        if names.contains(&name) {
            context.fault_at(name_node.unwrap_or(entry), format!("there is a state {} already: expected another name", quote(&name)));
            return None;
        }
        names.push(name);
        tables.push((entry, sojourn?, next));
    }
    // A second pass, because `next` may name any state of the list.
    let mut states = Vec::with_capacity(tables.len());
    for (place, (entry, sojourn, next)) in tables.into_iter().enumerate() {
        let next = match next {
            Some(next) => read_next(next, context, &names)?,
            // All other states are equally likely.
            None => (0..names.len()).map(|other| if other == place { 0.0 } else { 1.0 }).collect(),
        };
        // A state without a sojourn lasts forever and needs no next state. Any other state needs a next state other than itself.
        let weight_of_itself = next.get(place).copied().unwrap_or(0.0);
        if weight_of_itself != 0.0 || (sojourn.is_some() && next.iter().all(|weight| *weight == 0.0)) {
            let message =
                format!("the state {} ends, and no other one follows: expected another state under next, or no sojourn", quote(&names[place]));
            context.fault_at(entry, message);
            return None;
        }
        states.push(ModulatorState { sojourn, next });
    }
    if states.is_empty() {
        context.fault_at(node, format!("no state: expected at least one, each with a name and a sojourn, {SOJOURN}"));
        return None;
    }
    Some((names, states))
}

/// Reads the weights of the next states, indexed by state: the name of a state, or names with weights.
fn read_next(node: &Node, context: Context<'_>, names: &[String]) -> Option<Vec<f64>> {
    let mut weights = vec![0.0; names.len()];
    let place = |name: &str, at: &dyn Fn(String)| {
        let found = names.iter().position(|known| known == name);
        if found.is_none() {
            at(format!("there is no state {}: expected {}", quote(name), one_of(names.iter().map(String::as_str), name)));
        }
        found
    };
    match &node.value {
        Value::Text(name) => weights[place(name, &|message| context.fault_at(node, message))?] = 1.0,
        Value::Table(table) => {
            for entry in &table.0 {
                let place = place(&entry.name, &|message| context.fault(entry.key, &entry.node.path, message));
                let weight = WEIGHT.read(&entry.node, context);
                weights[place?] = weight?;
            }
        }
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::List(_) => {
            context.fault_at(node, format!("found {}: expected the name of a state, or a table such as {{ bad = 1, worse = 2 }}", node.describe()));
            return None;
        }
    }
    Some(weights)
}

/// Reads `{ by = "cell", good = { … }, bad = { … } }`. The keys of each state are laid over `keys`, the keys of the link.
pub(super) fn read_modulated(node: &Node, keys: &Node, context: Context<'_>) -> Option<Modulated> {
    const EXPECTED: &str = "\"none\" or a table such as { by = \"cell\", good = { delay = \"20ms\" }, bad = { delay = \"80ms\" } }";
    let Value::Table(table) = &node.value else {
        context.fault_at(node, format!("found {}: expected {EXPECTED}", node.describe()));
        return None;
    };
    // The keys of link kinds (such as `modulated` itself) do not belong to the configuration of a state.
    let base = keys.without(&LINK_KIND_PARAMETERS.each_ref().map(|key| key.name));
    // The keys of the link are also read alone, so that a fault in a key is found even if every state replaces the key.
    let sound = read_config(&base, context.of_part());
    let Some(by) = table.get("by") else {
        context.fault_at(node, "missing key by: expected the name of a modulator");
        return None;
    };
    let name = values::text(&by.node, context, "the name of a modulator")?;
    // Without a list of modulators, the fault of the list has been reported.
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
    // All states are read before the results are collected, so that the first fault of the text is found.
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

/// Reports unknown keys of a state. A state takes all keys of a link but the keys of link kinds.
fn check_keys(node: &Node, context: Context<'_>) -> Option<()> {
    let mut table = TableReader::new(node, context, LINK_TABLE.table("modulated.STATE"), "a table of link keys such as { delay = \"80ms\" }")?;
    table.know_all();
    table.finish();
    Some(())
}
