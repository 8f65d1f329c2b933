//! The range of values of one open key of a family of scenes, read from a text such as `coordination.stiffness=0..6000`.

use cohaptic_linkfile::{number_and_unit, text_of_quantity};
use cohaptic_units::print::SixDigits;

/// A key of a scene and the interval of its values, both ends included.
#[derive(Clone, PartialEq, Debug)]
pub struct KeyRange {
    /// The dotted path of the key, as for an override.
    pub key: String,
    /// The smallest value, in `unit`.
    pub low: f64,
    /// The largest value, in `unit`.
    pub high: f64,
    /// Unit of both ends as written after the number, such as `ms` or `%`. Empty for a plain number.
    pub unit: String,
}

/// Reason for which a text is not a range of a key.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KeyRangeError {
    /// The text has no `=`, or nothing before the `=`.
    #[error("no key in \"{text}\": expected KEY=LOW..HIGH such as coordination.stiffness=0..6000 or link.delay=0ms..50ms")]
    NoKey {
        /// The text as given.
        text: String,
    },
    /// The text after the `=` has no `..`.
    #[error("no range in \"{text}\": expected KEY=LOW..HIGH with two dots between the ends, such as coordination.stiffness=0..6000")]
    NoRange {
        /// The text as given.
        text: String,
    },
    /// An end of the range is not a number with an optional unit, or is not finite.
    #[error("\"{end}\" in \"{text}\" is not an end of a range: expected a finite number, with a unit where the key takes one")]
    End {
        /// The text as given.
        text: String,
        /// The end of the range that cannot be read, without spaces around.
        end: String,
    },
    /// The ends have different units.
    #[error("the ends of \"{text}\" have the units \"{low}\" and \"{high}\": expected the same unit at both")]
    Units {
        /// The text as given.
        text: String,
        /// Unit of the lower end; empty for a plain number.
        low: String,
        /// Unit of the upper end; empty for a plain number.
        high: String,
    },
    /// The lower end is not below the upper one.
    #[error("{} is not below {} in \"{text}\": expected a range whose first end is below its second", SixDigits(*low), SixDigits(*high))]
    Empty {
        /// The text as given.
        text: String,
        /// The lower end.
        low: f64,
        /// The upper end.
        high: f64,
    },
}

impl KeyRange {
    /// Reads `KEY=LOW..HIGH`, such as `coordination.stiffness=0..6000` or `link.delay=0ms..50ms`. Both ends must have the same unit, or none.
    ///
    /// # Errors
    ///
    /// [`KeyRangeError`] for any other text, if LOW is not below HIGH, or if an end or the width of the range is not finite. Whether the scene has the key is
    /// checked later, by [`Family::new`](crate::Family::new).
    pub fn parse(text: &str) -> Result<Self, KeyRangeError> {
        let whole = || text.to_owned();
        let (key, range) = text
            .split_once('=')
            .map(|(key, range)| (key.trim(), range))
            .filter(|(key, _)| !key.is_empty())
            .ok_or_else(|| KeyRangeError::NoKey { text: whole() })?;
        let (low, high) = range.split_once("..").ok_or_else(|| KeyRangeError::NoRange { text: whole() })?;
        let no_end = |end: &str| KeyRangeError::End { text: whole(), end: end.trim().to_owned() };
        let (low, low_unit) = number_and_unit(low).ok_or_else(|| no_end(low))?;
        let (high, high_unit) = number_and_unit(high).ok_or_else(|| no_end(high))?;
        if low_unit != high_unit {
            return Err(KeyRangeError::Units { text: whole(), low: low_unit.to_owned(), high: high_unit.to_owned() });
        }
        if low >= high || !(high - low).is_finite() {
            return Err(KeyRangeError::Empty { text: whole(), low, high });
        }
        Ok(Self { key: key.to_owned(), low, high, unit: low_unit.to_owned() })
    }

    /// Returns the override `KEY=VALUE` that gives the key a value. The text has as many digits as are needed to read the same value back.
    #[must_use]
    pub fn text(&self, value: f64) -> String {
        format!("{}={}", self.key, text_of_quantity(value, &self.unit))
    }

    /// Returns a value inside the range that is not a round number. `number` is the index of the key, 0 or 1: the two keys take different shares of their
    /// ranges, so that a number of the scene that equals the value almost surely came from this key.
    pub fn odd(&self, number: usize) -> f64 {
        let share = if number == 0 { 0.618_033_988_749_894_9 } else { 0.414_213_562_373_095_1 };
        self.low + (self.high - self.low) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_with_and_without_a_unit() {
        let range = |key: &str, low, high, unit: &str| KeyRange { key: key.to_owned(), low, high, unit: unit.to_owned() };
        let read = |text| KeyRange::parse(text).unwrap();
        assert_eq!(read("coordination.stiffness=0..6000"), range("coordination.stiffness", 0.0, 6000.0, ""));
        assert_eq!(read(" link.delay = 0ms .. 50.5 ms"), range("link.delay", 0.0, 50.5, "ms"));
        assert_eq!(read("link.loss=0%..5%"), range("link.loss", 0.0, 5.0, "%"));
        assert_eq!(read("a=-1e-3...5"), range("a", -1e-3, 0.5, ""));
    }

    #[test]
    fn anything_else_is_refused_and_says_why() {
        let message = |text| KeyRange::parse(text).unwrap_err().to_string();
        assert!(message("coordination.stiffness").contains("no key"));
        assert!(message("=0..1").contains("no key"));
        assert!(message("a=5").contains("no range"));
        assert!(message("a=1..1").contains("1 is not below 1"));
        assert!(message("a=2..1").contains("not below"));
        assert!(message("a=0..50ms").contains("units \"\" and \"ms\""));
        for text in ["a=0..inf", "a=nan..1", "a=x..1", "a=..1", "a=0..", "a=1..2_000", "a=0..1e999", "a=-1e308..1e309"] {
            assert!(matches!(KeyRange::parse(text), Err(KeyRangeError::End { .. })), "{text}");
        }
        assert!(KeyRange::parse("a=-1.7e308..1.7e308").is_err());
    }

    #[test]
    fn a_value_is_written_so_that_it_is_read_back_the_same() {
        let range = KeyRange::parse("a=0..1").unwrap();
        assert_eq!(range.text(6000.0), "a=6000");
        assert_eq!(range.text(-0.0), "a=0");
        for value in [0.1 + 0.2, 1e-300, 1.0 / 3.0, 1e300, 5e-324, 123_456.789] {
            let text = range.text(value);
            assert_eq!(text.strip_prefix("a=").unwrap().parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        assert_eq!(KeyRange::parse("link.delay=0ms..1ms").unwrap().text(1e-7), "link.delay=0.0000001ms");
    }
}
