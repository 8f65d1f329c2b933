//! A key of a scene and the values that it takes in a campaign, as they are written: `KEY=LOW..HIGH/COUNT`, `KEY=LOW..HIGH/COUNT:log`, `KEY=A,B,C`.
//! Of `coordination.strategy` a value may have settings, `NAME{KEY=VALUE,…}`, which are put into the scene with it.

mod grid;
mod group;
mod list;

use cohaptic_units::print::SixDigits;
use grid::Grid;
use list::List;

use crate::table::{Kind, Value, value_text};

pub use list::split_at_commas;

/// The key whose values may have settings.
const STRATEGY: &str = "coordination.strategy";

/// The most values that one key takes.
pub const MOST_VALUES: usize = 1_000_000;

/// A key that is varied.
#[derive(Clone, PartialEq, Debug)]
pub struct Variation {
    text: String,
    key: String,
    unit: String,
    kind: Kind,
    logarithmic: bool,
    values: Vec<Varied>,
}

/// One value of a key.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Varied {
    /// As it is written: without settings, as it is put into the scene.
    pub(crate) text: String,
    /// As it stands in the table.
    pub(crate) value: Value,
    /// Overrides that are put into the scene with it, by their dotted paths.
    pub(crate) settings: Vec<String>,
}

impl Varied {
    /// A value without settings.
    pub(super) const fn plain(text: String, value: Value) -> Self {
        Self { text, value, settings: Vec::new() }
    }
}

/// Why a text does not vary a key.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum VaryError {
    /// There is no `=`, or nothing before it.
    #[error(
        "no key in \"{text}\": expected KEY=LOW..HIGH/COUNT, KEY=LOW..HIGH/COUNT:log or KEY=A,B,C, such as coordination.stiffness=0..6000/13 or link.delay=8ms,24ms"
    )]
    NoKey {
        /// The text as given.
        text: String,
    },
    /// A range does not say how many values it has, or nothing that could be a number of them.
    #[error(
        "no number of values in \"{text}\": expected a slash and a whole number of at least 2 behind the range, and :log for equal ratios, such as coordination.stiffness=0..6000/13 or coordination.stiffness=10..1000/5:log"
    )]
    NoCount {
        /// The text as given.
        text: String,
    },
    /// A range of no values or of one.
    #[error("a range of {count} in \"{text}\": expected at least 2 values, which are the two ends; for a single one, KEY=VALUE")]
    TooFew {
        /// The text as given.
        text: String,
        /// How many values.
        count: usize,
    },
    /// More values than [`MOST_VALUES`].
    #[error("too many values in \"{text}\": expected at most {MOST_VALUES}")]
    TooMany {
        /// The text as given.
        text: String,
    },
    /// An end is no number with a unit, or not finite.
    #[error("\"{end}\" in \"{text}\" is no end of a range: expected a finite number, with a unit where the key takes one")]
    End {
        /// The text as given.
        text: String,
        /// The end.
        end: String,
    },
    /// The ends have different units.
    #[error("the ends of \"{text}\" have the units \"{low}\" and \"{high}\": expected the same unit at both")]
    Units {
        /// The text as given.
        text: String,
        /// That of the lower end.
        low: String,
        /// That of the upper end.
        high: String,
    },
    /// The lower end is not below the upper one.
    #[error(
        "the range of \"{text}\" is empty: {} is not below {}; expected a range whose first end is below its second",
        SixDigits(*low),
        SixDigits(*high)
    )]
    Empty {
        /// The text as given.
        text: String,
        /// The lower end.
        low: f64,
        /// The upper end.
        high: f64,
    },
    /// Equal ratios need ends above zero.
    #[error("{} in \"{text}\" is not above zero: expected ends above zero for equal ratios (:log)", SixDigits(*low))]
    NoRatio {
        /// The text as given.
        text: String,
        /// The lower end.
        low: f64,
    },
    /// A list has an entry with nothing in it.
    #[error("a value of \"{text}\" is missing: expected values with commas between them, such as link.delay=8ms,24ms")]
    NoValue {
        /// The text as given.
        text: String,
    },
    /// Braces behind the name of a strategy do not hold settings.
    #[error(
        "\"{value}\" in \"{text}\" is no strategy with settings: expected NAME{{KEY=VALUE,...}}, such as local-damping{{damping=58}}, with parameters of that \
         strategy or other keys of the scene by their dotted paths"
    )]
    Settings {
        /// The text as given.
        text: String,
        /// The value.
        value: String,
    },
    /// A list has an entry twice.
    #[error("{value} is there twice in \"{text}\": expected different values; for more runs of each, --runs")]
    Twice {
        /// The text as given.
        text: String,
        /// The value.
        value: String,
    },
}

impl Variation {
    /// Reads what the user says. Values of a list may be anything that an override may be: numbers, quantities, text, lists and tables.
    ///
    /// Nothing is known of a scene here: whether it has such a key, and takes these values, is found out when a campaign is planned.
    ///
    /// # Errors
    ///
    /// [`VaryError`], which says what was expected.
    pub fn parse(text: &str) -> Result<Self, VaryError> {
        let no_key = || VaryError::NoKey { text: text.to_owned() };
        let (key, values) = text.split_once('=').ok_or_else(no_key)?;
        let key = key.trim();
        if key.is_empty() {
            return Err(no_key());
        }
        let (unit, kind, logarithmic, values) = match Grid::parse(text, values)? {
            Some(grid) => (grid.unit.clone(), Kind::Number, grid.logarithmic, grid.values()),
            None => {
                let list = List::parse(text, same_key(key, STRATEGY).then_some(key), values)?;
                (list.unit, list.kind, false, list.values)
            }
        };
        Ok(Self { text: text.trim().to_owned(), key: key.to_owned(), unit, kind, logarithmic, values })
    }

    /// The text that it was read from.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The dotted path of the key.
    #[must_use]
    pub fn key(&self) -> &str {
        &self.key
    }

    /// How many values it takes; at least one.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.values.len()
    }

    /// The key with a value as it is written, by its place: `KEY=VALUE`.
    ///
    /// # Panics
    ///
    /// If there are fewer values.
    #[must_use]
    pub fn label(&self, place: usize) -> String {
        format!("{}={}", self.key, self.values[place].text)
    }

    /// The overrides that a value puts into the scene, by its place: `KEY=VALUE`, and those of its settings.
    ///
    /// # Panics
    ///
    /// If there are fewer values.
    #[must_use]
    pub fn overrides(&self, place: usize) -> Vec<String> {
        let varied = &self.values[place];
        let name = if varied.settings.is_empty() { varied.text.as_str() } else { varied.text.split('{').next().unwrap_or_default() };
        std::iter::once(format!("{}={name}", self.key)).chain(varied.settings.iter().cloned()).collect()
    }

    /// Its values as they are written, in order.
    pub fn texts(&self) -> impl ExactSizeIterator<Item = &str> {
        self.values.iter().map(|varied| varied.text.as_str())
    }

    /// The name of its column: the key, and the unit if all values have the same: `link.delay_ms`, `link.loss_percent`.
    #[must_use]
    pub fn column(&self) -> String {
        match self.unit.as_str() {
            "" => self.key.clone(),
            "%" => format!("{}_percent", self.key),
            unit => format!("{}_{unit}", self.key),
        }
    }

    /// The unit that all its values have; empty if they have none, or not the same.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// Whether its values are a range of equal ratios.
    #[must_use]
    pub const fn is_logarithmic(&self) -> bool {
        self.logarithmic
    }

    /// A value by its place, as a number in the unit of all; `None` if it is text, or if there are fewer.
    #[must_use]
    pub fn number(&self, place: usize) -> Option<f64> {
        match &self.values.get(place)?.value {
            #[expect(clippy::cast_precision_loss, reason = "a number to be drawn")]
            Value::Integer(integer) => Some(*integer as f64),
            Value::Number(number) => Some(*number),
            Value::Text(_) | Value::Absent => None,
        }
    }

    /// A value by its place, as it is written; empty if there are fewer.
    #[must_use]
    pub fn value_text(&self, place: usize) -> &str {
        self.values.get(place).map_or("", |varied| &varied.text)
    }

    /// A value by its place, as it stands in a table of text; empty if there are fewer.
    #[must_use]
    pub fn cell(&self, place: usize) -> String {
        self.values.get(place).map_or_else(String::new, |varied| value_text(&varied.value))
    }

    pub(crate) const fn kind(&self) -> Kind {
        self.kind
    }

    pub(crate) fn values(&self) -> &[Varied] {
        &self.values
    }

    /// Whether it varies that key, however its parts are quoted.
    #[must_use]
    pub fn is_key(&self, key: &str) -> bool {
        same_key(&self.key, key)
    }
}

/// Whether two dotted paths are the same key.
pub(crate) fn same_key(one: &str, other: &str) -> bool {
    let parts = |key: &str| key.split('.').map(|part| part.trim().trim_matches('"').to_owned()).collect::<Vec<_>>();
    parts(one) == parts(other)
}

#[cfg(test)]
mod tests;
