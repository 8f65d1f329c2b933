//! Readers of single values. Each answers `None` after it has reported what is wrong.

use core::time::Duration;

use cohaptic_units::print::Counted;
use cohaptic_units::{Bytes, Instant, ParseError, Probability, Rate, parse};

use crate::context::Context;
use crate::names::one_of;
use crate::tree::{Node, Value, quote, shorten};

/// What a number of the scene means: its range and its unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantity {
    range: Range,
    unit: &'static str,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Range {
    Any,
    NotNegative,
    Positive,
    Fraction,
    Correlation,
}

/// Above zero \[kg\].
pub(crate) const MASS: Quantity = Quantity { range: Range::Positive, unit: "kg" };
/// At least zero \[kg\].
pub(crate) const ADDED_MASS: Quantity = Quantity { range: Range::NotNegative, unit: "kg" };
/// At least zero [N·s/m].
pub(crate) const DAMPING: Quantity = Quantity { range: Range::NotNegative, unit: "N·s/m" };
/// At least zero [N/m].
pub(crate) const STIFFNESS: Quantity = Quantity { range: Range::NotNegative, unit: "N/m" };
/// Above zero [N/m].
pub(crate) const WALL_STIFFNESS: Quantity = Quantity { range: Range::Positive, unit: "N/m" };
/// Any \[m\].
pub(crate) const POSITION: Quantity = Quantity { range: Range::Any, unit: "m" };
/// Above zero \[m\].
pub(crate) const DISTANCE: Quantity = Quantity { range: Range::Positive, unit: "m" };
/// Any [m/s].
pub(crate) const VELOCITY: Quantity = Quantity { range: Range::Any, unit: "m/s" };
/// Any \[N\].
pub(crate) const FORCE: Quantity = Quantity { range: Range::Any, unit: "N" };
/// Above zero \[N\].
pub(crate) const POSITIVE_FORCE: Quantity = Quantity { range: Range::Positive, unit: "N" };
/// Above zero [counts/(N·m)].
pub(crate) const POSITIVE_COUNTS: Quantity = Quantity { range: Range::Positive, unit: "counts/(N·m)" };
/// At least zero \[Hz\].
pub(crate) const FREQUENCY: Quantity = Quantity { range: Range::NotNegative, unit: "Hz" };
/// Any \[rad\].
pub(crate) const ANGLE: Quantity = Quantity { range: Range::Any, unit: "rad" };
/// At least zero, beside others.
pub(crate) const WEIGHT: Quantity = Quantity { range: Range::NotNegative, unit: "" };
/// At least zero \[packet\].
pub(crate) const PACKETS: Quantity = Quantity { range: Range::NotNegative, unit: "packets" };
/// From 0 to 1.
pub(crate) const FRACTION: Quantity = Quantity { range: Range::Fraction, unit: "" };
/// From −1 to below 1.
pub(crate) const CORRELATION: Quantity = Quantity { range: Range::Correlation, unit: "" };

impl Quantity {
    /// In words: `a number above zero \[kg\]`.
    pub(crate) fn expected(self) -> String {
        let range = match self.range {
            Range::Any => "a number",
            Range::NotNegative => "a number of at least zero",
            Range::Positive => "a number above zero",
            Range::Fraction => "a number from 0 to 1",
            Range::Correlation => "a number from -1 to below 1",
        };
        if self.unit.is_empty() { range.to_owned() } else { format!("{range} [{}]", self.unit) }
    }

    /// The unit, as in messages; empty for a plain number.
    pub(crate) const fn unit(self) -> &'static str {
        self.unit
    }

    /// The range as JSON Schema says it: keywords and bounds.
    pub(crate) const fn bounds(self) -> &'static [(&'static str, i8)] {
        match self.range {
            Range::Any => &[],
            Range::NotNegative => &[("minimum", 0)],
            Range::Positive => &[("exclusiveMinimum", 0)],
            Range::Fraction => &[("minimum", 0), ("maximum", 1)],
            Range::Correlation => &[("minimum", -1), ("exclusiveMaximum", 1)],
        }
    }

    /// Reads a number in that range.
    pub(crate) fn read(self, node: &Node, context: Context<'_>) -> Option<f64> {
        let value = number(node, context, &self.expected())?;
        let within = match self.range {
            Range::Any => true,
            Range::NotNegative => value >= 0.0,
            Range::Positive => value > 0.0,
            Range::Fraction => (0.0..=1.0).contains(&value),
            Range::Correlation => (-1.0..1.0).contains(&value),
        };
        if !within {
            context.fault_at(node, format!("{} is out of range: expected {}", written(node), self.expected()));
            return None;
        }
        // A negative zero becomes an ordinary one.
        Some(value + 0.0)
    }

    /// Reads one number for each axis. A plain number stands for a list of one or, where `spread` allows it, for the same number on every axis.
    pub(crate) fn read_vector(self, node: &Node, context: Context<'_>, spread: Spread) -> Option<[f64; 3]> {
        let count = context.axes.map(crate::Axes::count);
        let mut vector = [0.0; 3];
        if let Value::List(elements) = &node.value {
            if elements.len() > 3 || elements.is_empty() || count.is_some_and(|count| count != elements.len()) {
                let expected = count.map_or_else(|| "1, 2 or 3".to_owned(), |count| count.to_string());
                let message = format!("found a list of {}: expected as many as the scene has axes, {expected}", Counted(elements.len(), "number"));
                context.fault_at(node, message);
                return None;
            }
            let numbers: Vec<Option<f64>> = elements.iter().map(|element| self.read(element, context)).collect();
            for (component, number) in vector.iter_mut().zip(numbers) {
                *component = number?;
            }
            return Some(vector);
        }
        let value = self.read(node, context)?;
        match (count, spread) {
            (Some(2..), Spread::Refused) => {
                let axes = count.unwrap_or(1);
                context.fault_at(node, format!("{} has one component: expected a list of {axes} numbers [{}]", written(node), self.unit));
                None
            }
            (_, Spread::Refused) => Some([value, 0.0, 0.0]),
            (_, Spread::EveryAxis) => {
                vector[..count.unwrap_or(1).min(3)].fill(value);
                Some(vector)
            }
        }
    }
}

/// What a plain number means where there is more than one axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Spread {
    /// Nothing: a list must be written.
    Refused,
    /// The same number on every axis.
    EveryAxis,
}

/// A finite number.
pub(crate) fn number(node: &Node, context: Context<'_>, expected: &str) -> Option<f64> {
    let value = match &node.value {
        Value::Integer(integer) => {
            let exact = integer.and_then(exact_f64);
            if exact.is_none() {
                context.fault_at(node, format!("{} has no exact 64-bit floating-point value: expected {expected}", node.describe()));
            }
            exact?
        }
        // The text of a TOML float is one that Rust reads; what is not becomes a NaN, which is refused.
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

/// The number as a double, if it is one exactly.
fn exact_f64(integer: i128) -> Option<f64> {
    let decimal = integer.to_string();
    let value: f64 = decimal.parse().ok()?;
    (format!("{value:.0}") == decimal).then_some(value)
}

/// A number as it is written.
fn written(node: &Node) -> String {
    match &node.value {
        Value::Integer(Some(integer)) => integer.to_string(),
        Value::Float(text) => shorten(text),
        Value::Integer(None) | Value::Text(_) | Value::Boolean(_) | Value::Date | Value::List(_) | Value::Table(_) => node.describe(),
    }
}

/// An integer in a range, both ends included.
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

/// `true` or `false`.
pub(crate) fn boolean(node: &Node, context: Context<'_>) -> Option<bool> {
    let Value::Boolean(value) = node.value else {
        context.fault_at(node, format!("found {}: expected true or false", node.describe()));
        return None;
    };
    Some(value)
}

/// A text.
pub(crate) fn text<'a>(node: &'a Node, context: Context<'_>, expected: &str) -> Option<&'a str> {
    let text = node.as_text();
    if text.is_none() {
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
    }
    text
}

/// One of a few words.
pub(crate) fn choice<T: Copy>(node: &Node, context: Context<'_>, choices: &[(&str, T)]) -> Option<T> {
    let words = || choices.iter().map(|(word, _)| *word);
    let given = text(node, context, &one_of(words(), ""))?;
    let chosen = choices.iter().find(|(word, _)| *word == given).map(|(_, value)| *value);
    if chosen.is_none() {
        context.fault_at(node, format!("unknown name {}: expected {}", quote(given), one_of(words(), given)));
    }
    chosen
}

/// A list, as its elements.
pub(crate) fn list<'a>(node: &'a Node, context: Context<'_>, expected: &str) -> Option<Vec<&'a Node>> {
    let Value::List(elements) = &node.value else {
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
        return None;
    };
    Some(elements.iter().map(|element| &**element).collect())
}

/// A duration such as "8ms".
pub(crate) fn duration(node: &Node, context: Context<'_>) -> Option<Duration> {
    quantity(node, context, parse::duration)
}

/// A duration above zero.
pub(crate) fn positive_duration(node: &Node, context: Context<'_>) -> Option<Duration> {
    let value = duration(node, context)?;
    if value.is_zero() {
        context.fault_at(node, "zero is out of range: expected a duration above zero such as \"8ms\"");
        return None;
    }
    Some(value)
}

/// An instant, as the time since the scene began.
pub(crate) fn instant(node: &Node, context: Context<'_>) -> Option<Instant> {
    let since_beginning = duration(node, context)?;
    let instant = Instant::ZERO.checked_add(since_beginning);
    if instant.is_none() {
        context.fault_at(node, "beyond 584 years: expected a duration such as \"8ms\"");
    }
    instant
}

/// A rate such as "10Mbit".
pub(crate) fn rate(node: &Node, context: Context<'_>) -> Option<Rate> {
    quantity(node, context, parse::rate)
}

/// A size such as "1500B".
pub(crate) fn size(node: &Node, context: Context<'_>) -> Option<Bytes> {
    quantity(node, context, parse::size)
}

/// A size that may be taken away, such as "28B" or "-14B".
pub(crate) fn signed_size(node: &Node, context: Context<'_>) -> Option<i32> {
    const EXPECTED: &str = "a size such as \"28B\", or \"-14B\" for bytes that are not sent";
    let text = text(node, context, EXPECTED)?;
    let (negative, plain) = match text.trim_start().strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let size = match parse::size(plain) {
        Ok(size) => i64::try_from(size.get()).unwrap_or(i64::MAX),
        Err(error) => {
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

/// A number of packets such as "100 packets"; `None` if the text is none.
pub(crate) fn packets(text: &str) -> Option<u64> {
    let number = text.trim().strip_suffix("packets").or_else(|| text.trim().strip_suffix("packet"))?.trim();
    let plain = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| number.parse().ok()).flatten()
}

/// Reports why the emulator refuses something, at the value that was written last of those that do not fit together.
pub(crate) fn refuse(context: Context<'_>, nodes: &[Option<&Node>], fallback: &Node, error: &dyn core::fmt::Display) {
    let last = nodes.iter().copied().flatten().max_by_key(|node| node.place);
    let error = error.to_string();
    let message = if error.contains("expected") { error } else { format!("{error}: expected another value") };
    context.fault_at(last.unwrap_or(fallback), message);
}

/// A probability: a number from 0 to 1, or a text such as "1.5%".
pub(crate) fn probability(node: &Node, context: Context<'_>) -> Option<Probability> {
    const EXPECTED: &str = "a probability: a number from 0 to 1 or a text such as \"1.5%\"";
    if node.as_text().is_some() {
        return quantity(node, context, parse::probability);
    }
    let value = number(node, context, EXPECTED)? + 0.0;
    let probability = Probability::new(value).ok();
    if probability.is_none() {
        context.fault_at(node, format!("{} is out of range: expected {EXPECTED}", written(node)));
    }
    probability
}

/// A text that one of the parsers of `cohaptic-units` reads.
fn quantity<T>(node: &Node, context: Context<'_>, parse: fn(&str) -> Result<T, ParseError>) -> Option<T> {
    let Some(text) = node.as_text() else {
        let expected = parse("").err().map_or("", |error| expected(&error));
        context.fault_at(node, format!("found {}: expected {expected}", node.describe()));
        return None;
    };
    match parse(text) {
        Ok(value) => Some(value),
        Err(error) => {
            // The beginning of a text that is too long to be shown is wrong too: it ends in an ellipsis, which no unit does.
            let error = parse(&shorten(text)).err().unwrap_or(error);
            context.fault_at(node, error.to_string());
            None
        }
    }
}

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
