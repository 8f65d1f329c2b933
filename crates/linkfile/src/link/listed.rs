//! Impairments that describe themselves: their parameters are read as the description says.

use cohaptic_wan::parameters::{Form, Key, Need, Table};
use cohaptic_wan::{Impairments, ParameterValue, Refusal, Values};

use super::is_none;
use crate::document::Node;
use crate::reading::values::{self, ReadNumber as _};
use crate::reading::{Context, TableReader};

/// Reads the keys of all listed impairments of a link.
pub(super) fn read_listed(table: &mut TableReader<'_>, context: Context<'_>) -> Option<Impairments> {
    let mut impairments = Impairments::default();
    let mut complete = true;
    for key in Impairments::KEYS {
        complete &= table.get(key.name).is_none_or(|node| read_impairment(&mut impairments, key, node, context).is_some());
    }
    complete.then_some(impairments)
}

fn read_impairment(impairments: &mut Impairments, key: &Key, node: &Node, context: Context<'_>) -> Option<()> {
    let values = match key.form.table().filter(|_| !is_none(node)) {
        Some(parameters) => Some(read_values(parameters, node, context)?),
        None => None,
    };
    // Of a part of a table not all values are known.
    if context.partial && values.as_ref().is_some_and(|values| missing(key, values)) {
        return Some(());
    }
    impairments.set(key.name, values.as_ref()).map_err(|refusal| refuse(&refusal, node, context)).ok()
}

fn missing(key: &Key, values: &Values) -> bool {
    key.form.table().is_some_and(|table| table.keys().any(|key| key.need == Need::Required && values.get(key.name).is_none()))
}

/// The values of a table of parameters, defaults included.
fn read_values(parameters: &'static Table, node: &Node, context: Context<'_>) -> Option<Values> {
    let names: Vec<&str> = parameters.keys().map(|key| key.name).collect();
    let mut table = TableReader::new(node, context, &format!("\"none\" or a table with {}", names.join(", ")))?;
    let mut values = Vec::new();
    let mut complete = true;
    for key in parameters.keys() {
        let read = match (table.get(key.name), key.need) {
            (Some(node), _) => read_value(key, node, context).map(Some),
            (None, Need::Default(default)) => read_value(key, &default_node(default), context).map(Some),
            (None, Need::Required | Need::RequiredSomewhere) => {
                table.miss(key.name, &expected(&key.form));
                Some(None)
            }
            (None, Need::Optional) => Some(None),
        };
        complete &= read.is_some();
        values.extend(read.flatten().map(|value| (key.name, value)));
    }
    table.finish();
    let known =
        complete && (context.partial || parameters.keys().all(|key| key.need != Need::Required || values.iter().any(|(name, _)| *name == key.name)));
    known.then_some(Values(values))
}

/// A default, which is the same in TOML and in JSON.
fn default_node(default: &str) -> Node {
    let value = toml::de::DeValue::parse(default).expect("the default of a parameter is a value");
    Node::value(&value, String::new(), 0, 0).expect("the default of a parameter is flat")
}

fn read_value(key: &Key, node: &Node, context: Context<'_>) -> Option<ParameterValue> {
    match &key.form {
        Form::Duration => values::duration(node, context).map(ParameterValue::Duration),
        Form::Rate => values::rate(node, context).map(ParameterValue::Rate),
        Form::Size => values::size(node, context).map(ParameterValue::Size),
        Form::Probability => values::probability(node, context).map(ParameterValue::Probability),
        Form::Number(quantity) => quantity.read(node, context).map(ParameterValue::Number),
        Form::Integer(least, most) => values::integer(node, context, *least..=*most, &expected(&key.form)).map(ParameterValue::Integer),
        Form::Boolean => values::boolean(node, context).map(ParameterValue::Boolean),
        Form::Words(words) => {
            let choices: Vec<(&'static str, &'static str)> = words.iter().map(|(word, _)| (*word, *word)).collect();
            values::choice(node, context, &choices).map(ParameterValue::Word)
        }
        Form::Text
        | Form::File
        | Form::Vector(_)
        | Form::Triple(_)
        | Form::Like(_)
        | Form::Table(_)
        | Form::List(_)
        | Form::Pair(_)
        | Form::AnyOf(_) => {
            context.fault_at(node, format!("{} cannot be read: expected a form with one value", key.name));
            None
        }
    }
}

/// A form in words, for a key that is missing.
fn expected(form: &Form) -> String {
    match form {
        Form::Duration => "a duration such as \"8ms\"".to_owned(),
        Form::Rate => "a rate such as \"10Mbit\"".to_owned(),
        Form::Size => "a size such as \"1500B\"".to_owned(),
        Form::Probability => "a probability such as \"1%\"".to_owned(),
        Form::Number(quantity) => quantity.expected(),
        Form::Integer(least, most) => format!("an integer from {least} to {most}"),
        Form::Boolean => "true or false".to_owned(),
        Form::Words(words) => words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", "),
        Form::Text
        | Form::File
        | Form::Vector(_)
        | Form::Triple(_)
        | Form::Like(_)
        | Form::Table(_)
        | Form::List(_)
        | Form::Pair(_)
        | Form::AnyOf(_) => "a value".to_owned(),
    }
}

fn refuse(refusal: &Refusal, node: &Node, context: Context<'_>) {
    let blamed = node.as_table().and_then(|table| table.get(refusal.key)).map_or(node, |entry| &*entry.node);
    values::refuse(context, &[Some(blamed)], node, &refusal.message);
}
