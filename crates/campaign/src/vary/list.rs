//! Lists of values: `A,B,C`.

use std::sync::Arc;

use cohaptic_linkfile::number_and_unit;

use super::commas::split_at_commas;
use super::error::{MOST_VALUES, VaryError};
use super::group::Group;
use super::varied::Varied;
use crate::value::{Kind, Value};

/// A list of values with their common unit and type.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct List {
    pub(super) unit: String,
    pub(super) kind: Kind,
    pub(super) values: Vec<Varied>,
}

impl List {
    /// Reads a list. `with_settings`: the key, if its values may have settings. `whole`: text of the user, for errors.
    pub(super) fn parse(whole: &str, with_settings: Option<&str>, text: &str) -> Result<Self, VaryError> {
        let whole = || whole.to_owned();
        let mut texts = split_at_commas(text);
        if texts.iter().any(String::is_empty) {
            return Err(VaryError::NoValue { text: whole() });
        }
        if texts.len() > MOST_VALUES {
            return Err(VaryError::TooMany { text: whole() });
        }
        let mut settings = vec![Vec::new(); texts.len()];
        for (text, settings) in texts.iter_mut().zip(&mut settings).filter(|_| with_settings.is_some()) {
            let group = Group::parse(with_settings.unwrap_or_default(), text);
            if let Some(group) = group.map_err(|()| VaryError::Settings { text: whole(), value: text.clone() })? {
                (*text, *settings) = (group.text, group.settings);
            }
        }
        // Sorted, because comparing each pair would take too long for a million values.
        let mut sorted: Vec<&String> = texts.iter().collect();
        sorted.sort_unstable();
        if let Some(value) = sorted.windows(2).find_map(|pair| (pair[0] == pair[1]).then(|| pair[0].clone())) {
            return Err(VaryError::Twice { text: whole(), value });
        }
        let (unit, kind, values) = typed(&texts);
        let values = texts.into_iter().zip(values).zip(settings).map(|((text, value), settings)| Varied { text, value, settings }).collect();
        Ok(Self { unit, kind, values })
    }
}

/// Returns unit, type and values of a list: integers if every value is an integer, numbers if every value is a number with the same unit, otherwise text
/// without the enclosing quotes.
fn typed(texts: &[String]) -> (String, Kind, Vec<Value>) {
    if let Some(integers) = texts.iter().map(|text| text.parse().ok().map(Value::Integer)).collect::<Option<Vec<Value>>>() {
        return (String::new(), Kind::Integer, integers);
    }
    // One value without a number makes the list a list of text.
    let quantities = texts.iter().map(|text| number_and_unit(unquoted(text))).collect::<Option<Vec<(f64, &str)>>>().unwrap_or_default();
    match quantities.first() {
        Some((_, unit)) if quantities.iter().all(|(_, other)| other == unit) => {
            // Adding 0.0 turns −0.0 into 0.0, so both have one form in the table.
            let numbers = quantities.iter().map(|(value, _)| Value::Number(value + 0.0)).collect();
            ((*unit).to_owned(), Kind::Number, numbers)
        }
        Some(_) | None => (String::new(), Kind::Text, texts.iter().map(|text| Value::Text(Arc::from(unquoted(text)))).collect()),
    }
}

fn unquoted(text: &str) -> &str {
    let within = |quote: char| text.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote)).filter(|inner| !inner.contains(quote));
    within('"').or_else(|| within('\'')).unwrap_or(text)
}
