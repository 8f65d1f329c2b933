//! Variations: a key of a scene and the values of the key in a campaign, written as `KEY=LOW..HIGH/COUNT`, `KEY=LOW..HIGH/COUNT:log` or `KEY=A,B,C`. A value of
//! `coordination.strategy` may have settings, `NAME{KEY=VALUE,…}`, which are set together with the value.

mod commas;
mod error;
mod grid;
mod group;
mod list;
mod varied;

use grid::Grid;
use list::List;

use crate::value::{Kind, Value, value_text};

pub use commas::split_at_commas;
pub use error::VaryError;
pub(crate) use varied::Varied;

/// Key whose values may have settings.
const STRATEGY: &str = "coordination.strategy";

/// A varied key with its values. The index of a value counts from 0.
#[derive(Clone, PartialEq, Debug)]
pub struct Variation {
    text: String,
    key: String,
    unit: String,
    kind: Kind,
    logarithmic: bool,
    values: Vec<Varied>,
}

impl Variation {
    /// Reads a variation. Values of a list may be all that an override may be: numbers, quantities, text, lists and tables.
    ///
    /// The key and the values are not compared with a scene here. [`Campaign::open`](crate::Campaign::open) checks them.
    ///
    /// # Errors
    ///
    /// [`VaryError`] with the expected form.
    pub fn parse(text: &str) -> Result<Self, VaryError> {
        let no_key = || VaryError::NoKey { text: text.to_owned() };
        let (key, values) = text.split_once('=').ok_or_else(no_key)?;
        let key = key.trim();
        if key.is_empty() {
            return Err(no_key());
        }
        // A text beginning with a number and two dots is a range. Everything else is a list, for example of paths such as `../a.trace`.
        let (unit, kind, logarithmic, values) = match Grid::parse(text, values)? {
            Some(grid) => (grid.unit.clone(), Kind::Number, grid.logarithmic, grid.values()),
            None => {
                let list = List::parse(text, same_key(key, STRATEGY).then_some(key), values)?;
                (list.unit, list.kind, false, list.values)
            }
        };
        Ok(Self { text: text.trim().to_owned(), key: key.to_owned(), unit, kind, logarithmic, values })
    }

    /// Returns the text of the variation, as given to [`Variation::parse`] but without space around it.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the dotted path of the key.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the number of values, at least one.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.values.len()
    }

    /// Returns key and value as written: `KEY=VALUE`. `place`: index of the value.
    ///
    /// # Panics
    ///
    /// If `place` is not below [`Variation::count`].
    #[must_use]
    pub fn label(&self, place: usize) -> String {
        format!("{}={}", self.key, self.values[place].text)
    }

    /// Returns the overrides of a value: `KEY=VALUE`, followed by its settings. `place`: index of the value.
    ///
    /// # Panics
    ///
    /// If `place` is not below [`Variation::count`].
    #[must_use]
    pub fn overrides(&self, place: usize) -> Vec<String> {
        let varied = &self.values[place];
        // With settings, the written value is `NAME{…}`, and the key itself takes the name.
        let name = if varied.settings.is_empty() { varied.text.as_str() } else { varied.text.split('{').next().unwrap_or_default() };
        std::iter::once(format!("{}={name}", self.key)).chain(varied.settings.iter().cloned()).collect()
    }

    /// Returns the values as written, in order.
    pub(crate) fn texts(&self) -> impl ExactSizeIterator<Item = &str> {
        self.values.iter().map(|varied| varied.text.as_str())
    }

    /// Returns the name of the key's column: the key, and the unit common to all values, as in `link.delay_ms` and `link.loss_percent`.
    #[must_use]
    pub fn column(&self) -> String {
        match self.unit.as_str() {
            "" => self.key.clone(),
            "%" => format!("{}_percent", self.key),
            unit => format!("{}_{unit}", self.key),
        }
    }

    /// Returns the unit common to all values; empty if the values have no unit or different units.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// Returns `true` if the values are a range of equal ratios.
    #[must_use]
    pub const fn is_logarithmic(&self) -> bool {
        self.logarithmic
    }

    /// Returns a value as a number in the common unit; `None` for a text or an index without a value.
    #[must_use]
    pub fn number(&self, place: usize) -> Option<f64> {
        match &self.values.get(place)?.value {
            #[expect(clippy::cast_precision_loss, reason = "a number to be drawn")]
            Value::Integer(integer) => Some(*integer as f64),
            Value::Number(number) => Some(*number),
            Value::Text(_) | Value::Absent => None,
        }
    }

    /// Returns a value; [`Value::Absent`] for an index without a value.
    #[must_use]
    pub fn value(&self, place: usize) -> Value {
        self.values.get(place).map_or(Value::Absent, |varied| varied.value.clone())
    }

    /// Returns a value as written; empty for an index without a value.
    #[must_use]
    pub fn value_text(&self, place: usize) -> &str {
        self.values.get(place).map_or("", |varied| &varied.text)
    }

    /// Returns a value as a cell of text; empty for an index without a value.
    #[must_use]
    pub fn cell(&self, place: usize) -> String {
        self.values.get(place).map_or_else(String::new, |varied| value_text(&varied.value))
    }

    /// Returns the type of the values.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        self.kind
    }

    pub(crate) fn values(&self) -> &[Varied] {
        &self.values
    }

    /// Returns `true` if the variation is of this key, however the parts of the two paths are quoted.
    #[must_use]
    pub fn is_key(&self, key: &str) -> bool {
        same_key(&self.key, key)
    }
}

/// Returns `true` if two dotted paths name the same key.
pub(crate) fn same_key(one: &str, other: &str) -> bool {
    // `a."b"` and `a.b` are the same key in TOML.
    let parts = |key: &str| key.split('.').map(|part| part.trim().trim_matches('"').to_owned()).collect::<Vec<_>>();
    parts(one) == parts(other)
}

#[cfg(test)]
mod tests;
