//! Reader of listed impairments, which declare their parameters themselves.

use cohaptic_wan::parameters::{Key, Need, Table};
use cohaptic_wan::{Impairments, Refusal, Values};

use super::is_none;
use crate::document::Node;
use crate::reading::{Context, TableReader, values};

/// Reads the keys of all listed impairments of a link. Returns `None` if an impairment was refused.
pub(super) fn read_listed(table: &mut TableReader<'_>, context: Context<'_>) -> Option<Impairments> {
    let mut impairments = Impairments::default();
    let mut complete = true;
    for key in Impairments::KEYS {
        // No early return: every impairment is read, so that the first fault of the text is found.
        complete &= table.get(key.name).is_none_or(|node| read_impairment(&mut impairments, key, node, context).is_some());
    }
    complete.then_some(impairments)
}

/// Reads an impairment, and sets the impairment in `impairments`. `"none"` and forms without parameters set no values.
fn read_impairment(impairments: &mut Impairments, key: &Key, node: &Node, context: Context<'_>) -> Option<()> {
    let parameters = key.form.table().filter(|_| !is_none(node));
    let values = match parameters {
        Some(parameters) => Some(read_values(parameters, node, context)?),
        None => None,
    };
    // A part will be laid over values not known here, so an impairment without all required values cannot be built and checked.
    if let (Some(parameters), Some(values), true) = (parameters, &values, context.partial)
        && parameters.keys().any(|key| key.need == Need::Required && values.get(key.name).is_none())
    {
        return Some(());
    }
    impairments.set(key.name, values.as_ref()).map_err(|refusal| refuse(&refusal, node, context)).ok()
}

/// Reads the values of a table of parameters, defaults included.
fn read_values(parameters: &'static Table, node: &Node, context: Context<'_>) -> Option<Values> {
    let names: Vec<&str> = parameters.keys().map(|key| key.name).collect();
    let mut table = TableReader::new(node, context, parameters, &format!("\"none\" or a table with {}", names.join(", ")))?;
    let mut values = Vec::new();
    let mut complete = true;
    for key in parameters.keys() {
        // In a part, a required parameter may come from the table below.
        let may_be_missing = key.need == Need::Optional || (context.partial && key.need == Need::Required);
        let read = if may_be_missing { table.maybe_value(key.name) } else { table.value(key.name).map(Some) };
        complete &= read.is_some();
        values.extend(read.flatten().map(|value| (key.name, value)));
    }
    table.finish();
    complete.then_some(Values(values))
}

/// Reports the refusal of an impairment, at the blamed parameter or else at the whole value.
fn refuse(refusal: &Refusal, node: &Node, context: Context<'_>) {
    let blamed = node.as_table().and_then(|table| table.get(refusal.key)).map_or(node, |entry| &*entry.node);
    values::refuse(context, &[Some(blamed)], node, &refusal.message);
}
