//! Ranges of values: `LOW..HIGH/COUNT` and `LOW..HIGH/COUNT:log`.

use cohaptic_linkfile::{number_and_unit, text_of_quantity};

use super::error::{MOST_VALUES, VaryError};
use super::varied::Varied;
use crate::value::Value;

/// A range of `count` values, including both ends.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Grid {
    low: f64,
    high: f64,
    pub(super) unit: String,
    count: usize,
    /// `true` if neighbours have equal ratios rather than equal differences.
    pub(super) logarithmic: bool,
}

impl Grid {
    /// Reads a range. `Ok(None)`: the text does not begin with a number and two dots, and is a list. `whole`: text of the user, for errors.
    pub(super) fn parse(whole: &str, text: &str) -> Result<Option<Self>, VaryError> {
        let whole = || whole.to_owned();
        let Some((low, rest)) = text.split_once("..") else { return Ok(None) };
        // A path such as `../a.trace` has two dots but no number before them.
        let Some((low, low_unit)) = number_and_unit(low) else { return Ok(None) };
        let Some((high, count)) = rest.rsplit_once('/') else { return Err(VaryError::NoCount { text: whole() }) };
        let (high, high_unit) = number_and_unit(high).ok_or_else(|| VaryError::End { text: whole(), end: high.trim().to_owned() })?;
        let (count, logarithmic) = match count.trim().split_once(':') {
            None => (count, false),
            Some((count, kind)) if kind.trim() == "log" => (count, true),
            Some(_) => return Err(VaryError::NoCount { text: whole() }),
        };
        let count: usize = count.trim().parse().map_err(|_| VaryError::NoCount { text: whole() })?;
        if count < 2 {
            return Err(VaryError::TooFew { text: whole(), count });
        }
        if count > MOST_VALUES {
            return Err(VaryError::TooMany { text: whole() });
        }
        if low_unit != high_unit {
            return Err(VaryError::Units { text: whole(), low: low_unit.to_owned(), high: high_unit.to_owned() });
        }
        // The difference of two finite ends may be infinite, and then no value between them can be computed by differences.
        if low >= high || !(high - low).is_finite() {
            return Err(VaryError::Empty { text: whole(), low, high });
        }
        if logarithmic && low <= 0.0 {
            return Err(VaryError::NoRatio { text: whole(), low });
        }
        Ok(Some(Self { low, high, unit: low_unit.to_owned(), count, logarithmic }))
    }

    pub(super) fn values(&self) -> Vec<Varied> {
        let value = |place| {
            let value = self.at(place);
            Varied::plain(text_of_quantity(value, &self.unit), Value::Number(value + 0.0))
        };
        (0..self.count).map(value).collect()
    }

    /// Returns value `place` of the range, from 0 to `count` − 1. The ends are exact. Between the ends the multiplication comes before the division, so that
    /// tenths are the `f64` nearest to the written tenths.
    #[expect(clippy::cast_precision_loss, reason = "at most a million values")]
    fn at(&self, place: usize) -> f64 {
        let Self { low, high, .. } = *self;
        let last = self.count - 1;
        if place == 0 || place == last {
            // Exactly as written, without the rounding error of the interpolation.
            return if place == 0 { low } else { high };
        }
        let (place, last) = (place as f64, last as f64);
        let between = |low: f64, high: f64| (low * (last - place) + high * place) / last;
        let value = if self.logarithmic {
            fifteen_digits(libm::exp10(between(libm::log10(low), libm::log10(high))))
        } else if (high * last).is_finite() && (low * last).is_finite() {
            between(low, high)
        } else {
            // Near the largest `f64` the products above overflow. This form has larger rounding errors but cannot overflow.
            low + (high - low) * (place / last)
        };
        // Rounding may go beyond an end by one bit.
        value.clamp(low, high)
    }
}

/// Rounds to fifteen digits: a power is no more accurate, and 5 must not become 4.999999999999999.
fn fifteen_digits(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}
