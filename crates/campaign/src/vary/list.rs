//! `A,B,C`.

use std::sync::Arc;

use cohaptic_linkfile::number_and_unit;

use super::group::Group;
use super::{MOST_VALUES, Varied, VaryError};
use crate::table::{Kind, Value};

/// Values one by one.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct List {
    pub(super) unit: String,
    pub(super) kind: Kind,
    pub(super) values: Vec<Varied>,
}

impl List {
    /// `with_settings`: the key, if its values may have settings.
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

/// Integers if all are, numbers if all are and have one unit, or else text as it is written, without the quotes around it.
fn typed(texts: &[String]) -> (String, Kind, Vec<Value>) {
    if let Some(integers) = texts.iter().map(|text| text.parse().ok().map(Value::Integer)).collect::<Option<Vec<Value>>>() {
        return (String::new(), Kind::Integer, integers);
    }
    let quantities = texts.iter().map(|text| number_and_unit(unquoted(text))).collect::<Option<Vec<(f64, &str)>>>().unwrap_or_default();
    match quantities.first() {
        Some((_, unit)) if quantities.iter().all(|(_, other)| other == unit) => {
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

/// Splits at commas, but for those within brackets, braces and quotes: values may be lists, tables and texts. Space around the parts is taken away.
#[must_use]
pub fn split_at_commas(text: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0_u32, None);
    for letter in text.chars() {
        match (quote, letter) {
            (Some(open), _) if open == letter => quote = None,
            (None, '"' | '\'') => quote = Some(letter),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(part) = parts.last_mut() {
            part.push(letter);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}
