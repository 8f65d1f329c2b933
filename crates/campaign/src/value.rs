//! Values of keys and of columns.

use std::sync::Arc;

/// Type of the values of a column.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Integers, `i64`.
    Integer,
    /// Numbers, `f64`.
    Number,
    /// Text, UTF-8.
    Text,
}

/// A value of a row.
#[derive(Clone, PartialEq, Debug)]
pub enum Value {
    /// No value: a peer absent from this run, or a mean of nothing.
    Absent,
    /// A value of an integer column.
    Integer(i64),
    /// A value of a number column; may be infinite or NaN in a diverged run.
    Number(f64),
    /// A value of a text column.
    Text(Arc<str>),
}

/// Returns a value as a cell of text; empty for no value.
pub(crate) fn value_text(value: &Value) -> String {
    match value {
        Value::Absent => String::new(),
        Value::Integer(integer) => integer.to_string(),
        Value::Number(number) => number_text(*number),
        Value::Text(text) => text.to_string(),
    }
}

/// Returns a number with the fewest digits that read back as the same `f64`.
pub(crate) fn number_text(number: f64) -> String {
    format!("{number:?}")
}
