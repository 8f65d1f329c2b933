//! Reader of `[conditions]`: the product of the values of some keys of the scene.

use cohaptic_campaign::{Variation, split_at_commas};
use cohaptic_linkfile::document::{Node, Value, quote, value_text};
use cohaptic_linkfile::reading::{Context, values};

use crate::model::{Condition, Factor};

/// Reads the factors and their product. Without the table there is one condition, the scene as written.
pub(super) fn read_conditions(node: Option<&Node>, most: usize, context: Context<'_>) -> Option<(Vec<Factor>, Vec<Condition>)> {
    let Some(node) = node else {
        return Some((
            Vec::new(),
            vec![Condition { overrides: Vec::new(), values: Vec::new(), texts: Vec::new(), label: "scene".to_owned(), tracks: false }],
        ));
    };
    let Some(table) = node.as_table() else {
        context.fault_at(node, format!("found {}: expected a table such as {{ \"link.delay\" = [\"0ms\", \"100ms\"] }}", node.describe()));
        return None;
    };
    let read: Vec<Option<Variation>> = table.0.iter().map(|entry| read_factor(&entry.name, &entry.node, context)).collect();
    let variations: Vec<Variation> = read.into_iter().collect::<Option<_>>()?;
    let count = variations.iter().try_fold(1_usize, |count, factor| count.checked_mul(factor.count()));
    let Some(count) = count.filter(|count| *count <= most) else {
        context.fault_at(node, format!("more than {most} conditions: expected fewer values, or fewer keys"));
        return None;
    };
    let conditions = (0..count).map(|condition| of_places(&places(condition, &variations), &variations)).collect();
    let factors = variations.iter().map(|factor| Factor { key: factor.key().to_owned(), column: factor.column(), kind: factor.kind() });
    Some((factors.collect(), conditions))
}

/// Reads the values of a key, with the types and the unit of a key that a campaign varies.
fn read_factor(key: &str, node: &Node, context: Context<'_>) -> Option<Variation> {
    const EXPECTED: &str = "a list of values such as [\"0ms\", \"100ms\"]";
    let elements = values::list(node, context, EXPECTED)?;
    if elements.is_empty() {
        context.fault_at(node, format!("no value is given: expected {EXPECTED}"));
        return None;
    }
    if key == "scene.seed" || key.starts_with("measure") || key.starts_with("task.timeout") {
        context.fault_at(node, format!("{} is the same in all conditions of a study: expected another key", quote(key)));
        return None;
    }
    let written = elements.iter().map(|element| match &element.value {
        // A word stands as it is, as in a campaign: a strategy may have settings in braces.
        Value::Text(text) if is_word(text) => text.clone(),
        Value::Text(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::List(_) | Value::Table(_) => {
            value_text(element)
        }
    });
    match Variation::parse(&format!("{key}={}", written.collect::<Vec<_>>().join(","))) {
        Ok(variation) => Some(variation),
        Err(error) => {
            let message = error.to_string();
            context.fault_at(node, if message.contains("expected") { message } else { format!("{message}: expected {EXPECTED}") });
            None
        }
    }
}

/// Returns whether a text stands in a list of values as it is, without quotes.
fn is_word(text: &str) -> bool {
    let is_plain = !text.contains(['"', '\'', '[', '\n']) && !text.contains("..") && text.trim() == text && !text.is_empty();
    is_plain && split_at_commas(text).len() == 1
}

/// Returns the index of the value of each factor in a condition. The last factor varies fastest.
fn places(condition: usize, factors: &[Variation]) -> Vec<usize> {
    let mut left = condition;
    let mut places = vec![0; factors.len()];
    for (place, factor) in places.iter_mut().zip(factors).rev() {
        *place = left % factor.count();
        left /= factor.count();
    }
    places
}

fn of_places(places: &[usize], factors: &[Variation]) -> Condition {
    let chosen = || places.iter().zip(factors);
    let texts: Vec<String> = chosen().map(|(place, factor)| factor.value_text(*place).trim_matches('"').to_owned()).collect();
    Condition {
        overrides: chosen().flat_map(|(place, factor)| factor.overrides(*place)).collect(),
        values: chosen().map(|(place, factor)| factor.value(*place)).collect(),
        label: texts.join(", "),
        texts,
        // Known as soon as the scene of the condition is read.
        tracks: false,
    }
}
