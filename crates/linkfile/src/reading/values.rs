//! Readers of single values. Each reader returns `None` after a reported fault.

use core::time::Duration;

use cohaptic_units::parse::{self, ParseError};
use cohaptic_units::{Bytes, Instant, Probability, Rate};
use cohaptic_wan::ParameterValue;
use cohaptic_wan::parameters::{Form, Key};

pub use cohaptic_wan::parameters::{Quantity, WEIGHT};

use super::context::Context;
use super::names::one_of;
use crate::document::{BEGINNING, Node, Value, quote, shorten};

/// Reads the value of a key by its declared form.
///
/// # Panics
///
/// If the form of the key has no single value, or has values of another type than `T`.
#[track_caller]
pub fn of_key<T: TryFrom<ParameterValue>>(key: &Key, node: &Node, context: Context<'_>) -> Option<T> {
    let value = match key.form {
        Form::Duration => duration(node, context).map(ParameterValue::Duration),
        Form::PositiveDuration => positive_duration(node, context).map(ParameterValue::Duration),
        Form::Rate => rate(node, context).map(ParameterValue::Rate),
        Form::Size => size(node, context).map(ParameterValue::Size),
        Form::Probability => probability(node, context).map(ParameterValue::Probability),
        Form::Number(quantity) => quantity.read(node, context).map(ParameterValue::Number),
        Form::Integer(least, most) => integer(node, context, least..=most, &key.expected()).map(ParameterValue::Integer),
        Form::Boolean => boolean(node, context).map(ParameterValue::Boolean),
        Form::Words(words) => {
            let words: Vec<_> = words.iter().map(|(word, about)| (*word, *word, *about)).collect();
            word(node, context, &words).map(ParameterValue::Word)
        }
        Form::Text
        | Form::File
        | Form::Vector(_)
        | Form::Triple(_)
        | Form::Like(_)
        | Form::Table(_)
        | Form::List(_)
        | Form::Pair(_)
        | Form::AnyOf(_) => unreachable!("{} has a reader of its own", key.name),
    }?;
    Some(T::try_from(value).ok().expect("a key is read as its form says"))
}

/// Returns the declared default of a key as a node. The text of a default means the same in TOML and in JSON.
pub(super) fn default_of(default: &str) -> Node {
    // The forms of most defaults are recognised without the parser of TOML, because every link of a file reads a dozen defaults.
    let text = default.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).map(|text| Value::Text(text.to_owned()));
    let integer = || default.parse().ok().map(|integer| Value::Integer(Some(integer)));
    let boolean = || default.parse().ok().map(Value::Boolean);
    let empty = || (default == "[]").then(|| Value::List(Vec::new()));
    if let Some(value) = text.or_else(integer).or_else(boolean).or_else(empty) {
        return Node { value, place: BEGINNING, path: String::new() };
    }
    let value = toml::de::DeValue::parse(default).expect("the default of a key is a value");
    Node::value(&value, String::new(), 0, 0).expect("the default of a key is flat")
}

/// Reading of a number within a range.
pub trait ReadNumber {
    /// Reads the number of a value. Returns `None` after a reported fault: no number, or a number outside the range.
    fn read(self, node: &Node, context: Context<'_>) -> Option<f64>;
}

impl ReadNumber for Quantity {
    fn read(self, node: &Node, context: Context<'_>) -> Option<f64> {
        let value = number(node, context, &self.expected())?;
        if !self.contains(value) {
            context.fault_at(node, format!("{} is out of range: expected {}", written(node), self.expected()));
            return None;
        }
        // Adding zero turns a negative zero into an ordinary zero.
        Some(value + 0.0)
    }
}

/// Reads a finite number: a float, or an integer that a 64-bit float represents exactly.
pub fn number(node: &Node, context: Context<'_>, expected: &str) -> Option<f64> {
    let value = match &node.value {
        Value::Integer(integer) => {
            let exact = integer.and_then(exact_f64);
            if exact.is_none() {
                context.fault_at(node, format!("{} has no exact 64-bit floating-point value: expected {expected}", node.describe()));
            }
            exact?
        }
        // Rust parses every float of TOML. An unexpected text becomes NaN, which is refused below.
        Value::Float(text) => text.parse().unwrap_or(f64::NAN),
        Value::Text(_) | Value::Boolean(_) | Value::Date | Value::List(_) | Value::Table(_) => {
            context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
            return None;
        }
    };
    if !value.is_finite() {
        context.fault_at(node, format!("{} is not finite: expected {expected}", written(node)));
        return None;
    }
    Some(value)
}

/// Converts an integer to a 64-bit float, or returns `None` if the conversion would round.
fn exact_f64(integer: i128) -> Option<f64> {
    // Compared as decimal texts, because a comparison as numbers would round again.
    let decimal = integer.to_string();
    let value: f64 = decimal.parse().ok()?;
    (format!("{value:.0}") == decimal).then_some(value)
}

/// Returns a number as written in the document, or the description of a value that is no number.
#[must_use]
pub fn written(node: &Node) -> String {
    match &node.value {
        Value::Integer(Some(integer)) => integer.to_string(),
        Value::Float(text) => shorten(text),
        Value::Integer(None) | Value::Text(_) | Value::Boolean(_) | Value::Date | Value::List(_) | Value::Table(_) => node.describe(),
    }
}

/// Reads an integer in a range, both ends included.
pub(crate) fn integer(node: &Node, context: Context<'_>, range: core::ops::RangeInclusive<u64>, expected: &str) -> Option<u64> {
    let Value::Integer(integer) = &node.value else {
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
        return None;
    };
    let value = integer.and_then(|integer| u64::try_from(integer).ok()).filter(|value| range.contains(value));
    if value.is_none() {
        context.fault_at(node, format!("{} is out of range: expected {expected}", written(node)));
    }
    value
}

/// Reads `true` or `false`.
pub(crate) fn boolean(node: &Node, context: Context<'_>) -> Option<bool> {
    let Value::Boolean(value) = node.value else {
        context.fault_at(node, format!("found {}: expected true or false", node.describe()));
        return None;
    };
    Some(value)
}

/// Reads a text.
pub fn text<'a>(node: &'a Node, context: Context<'_>, expected: &str) -> Option<&'a str> {
    let text = node.as_text();
    if text.is_none() {
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
    }
    text
}

/// Reads a word out of a few. Each choice is a word, the value of the word, and the meaning. Returns the value of the word.
pub fn word<T: Clone>(node: &Node, context: Context<'_>, choices: &[(&str, T, &str)]) -> Option<T> {
    let words = || choices.iter().map(|(word, ..)| *word);
    let Some(given) = node.as_text() else {
        context.fault_at(node, format!("found {}: expected {}", node.describe(), one_of(words(), "")));
        return None;
    };
    let chosen = choices.iter().find(|(word, ..)| *word == given).map(|(_, value, _)| value.clone());
    if chosen.is_none() {
        context.fault_at(node, format!("unknown name {}: expected {}", quote(given), one_of(words(), given)));
    }
    chosen
}

/// Reads the elements of a list.
pub fn list<'a>(node: &'a Node, context: Context<'_>, expected: &str) -> Option<Vec<&'a Node>> {
    let Value::List(elements) = &node.value else {
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
        return None;
    };
    Some(elements.iter().map(|element| &**element).collect())
}

/// Reads a duration such as "8ms".
pub fn duration(node: &Node, context: Context<'_>) -> Option<Duration> {
    quantity(node, context, parse::duration)
}

/// Reads a duration above zero.
pub fn positive_duration(node: &Node, context: Context<'_>) -> Option<Duration> {
    let value = duration(node, context)?;
    if value.is_zero() {
        context.fault_at(node, "zero is out of range: expected a duration above zero such as \"8ms\"");
        return None;
    }
    Some(value)
}

/// Reads an instant, written as the time since the start of the run.
pub fn instant(node: &Node, context: Context<'_>) -> Option<Instant> {
    let since_beginning = duration(node, context)?;
    let instant = Instant::ZERO.checked_add(since_beginning);
    if instant.is_none() {
        context.fault_at(node, "beyond 584 years: expected a duration such as \"8ms\"");
    }
    instant
}

/// Reads a rate such as "10Mbit".
pub(crate) fn rate(node: &Node, context: Context<'_>) -> Option<Rate> {
    quantity(node, context, parse::rate)
}

/// Reads a size such as "1500B".
pub(crate) fn size(node: &Node, context: Context<'_>) -> Option<Bytes> {
    quantity(node, context, parse::size)
}

/// Reads a size in bytes that may be negative, such as "28B" or "-14B".
pub(crate) fn signed_size(node: &Node, context: Context<'_>) -> Option<i32> {
    const EXPECTED: &str = "a size such as \"28B\", or \"-14B\" for bytes that are not sent";
    let text = text(node, context, EXPECTED)?;
    let (negative, plain) = match text.trim_start().strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let size = match parse::size(plain) {
        // A size beyond the range of `i64` is refused below as out of range.
        Ok(size) => i64::try_from(size.get()).unwrap_or(i64::MAX),
        Err(error) => {
            // The fault of the shortened text: a message quotes the text whole.
            let error = parse::size(&shorten(plain)).err().unwrap_or(error);
            context.fault_at(node, error.to_string());
            return None;
        }
    };
    let size = i32::try_from(if negative { -size } else { size }).ok();
    if size.is_none() {
        context.fault_at(node, format!("{} is out of range: expected {EXPECTED}", quote(text)));
    }
    size
}

/// Parses a number of packets such as "100 packets". Returns `None`, without a fault, for any other text.
#[must_use]
pub(crate) fn packets(text: &str) -> Option<u64> {
    let number = text.trim().strip_suffix("packets").or_else(|| text.trim().strip_suffix("packet"))?.trim();
    // `parse` also takes a sign, so the digits are checked here.
    let plain = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| number.parse().ok()).flatten()
}

/// Reports why the emulator refuses the values `nodes` together, at the value written last, or at `fallback` if no value is given.
pub(crate) fn refuse(context: Context<'_>, nodes: &[Option<&Node>], fallback: &Node, error: &dyn core::fmt::Display) {
    let last = nodes.iter().copied().flatten().max_by_key(|node| node.place);
    let error = error.to_string();
    let message = if error.contains("expected") { error } else { format!("{error}: expected another value") };
    context.fault_at(last.unwrap_or(fallback), message);
}

/// Reads a probability: a number from 0 to 1, or a text such as "1.5%".
pub fn probability(node: &Node, context: Context<'_>) -> Option<Probability> {
    const EXPECTED: &str = "a probability, a number from 0 to 1 or a text such as \"1.5%\"";
    if node.as_text().is_some() {
        return quantity(node, context, parse::probability);
    }
    // Adding zero turns a negative zero into an ordinary zero.
    let value = number(node, context, EXPECTED)? + 0.0;
    let probability = Probability::new(value).ok();
    if probability.is_none() {
        context.fault_at(node, format!("{} is out of range: expected {EXPECTED}", written(node)));
    }
    probability
}

/// Reads a text with one of the parsers of `cohaptic-units`.
fn quantity<T>(node: &Node, context: Context<'_>, parse: fn(&str) -> Result<T, ParseError>) -> Option<T> {
    let Some(text) = node.as_text() else {
        // The error for an empty text carries the expected form.
        let expected = parse("").err().map_or("", |error| expected(&error));
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
        return None;
    };
    match parse(text) {
        Ok(value) => Some(value),
        Err(error) => {
            // The message quotes the text whole, so a long text is shortened first. The shortened text is faulty too, because no unit ends in an ellipsis.
            let error = parse(&shorten(text)).err().unwrap_or(error);
            context.fault_at(node, error.to_string());
            None
        }
    }
}

/// Returns the expected form in the error of a parser.
fn expected(error: &ParseError) -> &'static str {
    match error {
        ParseError::Number { expected, .. } | ParseError::Unit { expected, .. } | ParseError::Range { expected, .. } => expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_become_doubles_only_where_that_is_exact() {
        assert_eq!(exact_f64(-3), Some(-3.0));
        assert_eq!(exact_f64(0), Some(0.0));
        assert_eq!(exact_f64(1 << 53), Some(9_007_199_254_740_992.0));
        assert_eq!(exact_f64((1 << 53) + 1), None);
        assert_eq!(exact_f64((1 << 53) + 2), Some(9_007_199_254_740_994.0));
        assert_eq!(exact_f64(i128::MAX), None);
    }
}
