//! Axes: name, symbol, unit, scale and range.

use crate::extent::{Extent, Scale, count};
use crate::text::Text;
use crate::ticks::Ticks;

/// An axis of a panel.
///
/// ```
/// use cohaptic_picture::Axis;
///
/// let along = Axis::new("Coordination stiffness").symbol("K_T").unit("N/m").range(0.0, 10_000.0);
/// let decibels = Axis::new("Admittance").unit("dB").multiples_of(20).ends_at_ticks();
/// let frequency = Axis::new("Frequency").symbol("f").unit("Hz").logarithmic();
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    name: Text,
    symbol: Text,
    unit: String,
    pub(crate) scale: Scale,
    /// Range set by the caller; `None` for the range of the content.
    range: Option<(f64, f64)>,
    /// Values that must lie in the range.
    includes: Vec<f64>,
    /// Number whose multiples are the only ticks; `None` for free ticks.
    multiples: Option<u32>,
    ends_at_ticks: bool,
    /// `true` if the axis ends at the content, without a margin.
    tight: bool,
    /// Names at 0, 1, 2 and so on; empty for a numeric axis.
    categories: Vec<Text>,
}

impl Axis {
    /// Creates a linear axis that covers all content, with a margin.
    #[must_use]
    pub fn new(name: impl Into<Text>) -> Self {
        Self {
            name: name.into(),
            symbol: Text::default(),
            unit: String::new(),
            scale: Scale::Linear,
            range: None,
            includes: Vec::new(),
            multiples: None,
            ends_at_ticks: false,
            tight: false,
            categories: Vec::new(),
        }
    }

    /// Sets the symbol, in the notation of [`Text::math`]: `K_T`.
    #[must_use]
    pub fn symbol(self, symbol: &str) -> Self {
        Self { symbol: Text::math(symbol), ..self }
    }

    /// Sets the unit, shown in brackets.
    #[must_use]
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { unit: unit.into(), ..self }
    }

    /// Makes the scale logarithmic.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { scale: Scale::Logarithmic, ..self }
    }

    /// Sets the range, whatever the content. Lines are cut at the ends. Equal or infinite ends are replaced by usable ones.
    #[must_use]
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some((low.min(high), low.max(high))), ..self }
    }

    /// Labels the axis with names: the first at 0, the second at 1, and so on. The range reaches half a step beyond the first and the last name. Meant for
    /// vertical axes, where names stand above each other.
    #[must_use]
    pub fn categories<T: Into<Text>>(self, names: impl IntoIterator<Item = T>) -> Self {
        // An axis without names has room for a single name, so that the range is never empty.
        let categories: Vec<Text> = names.into_iter().map(Into::into).collect();
        let axis = self.range(-0.5, count(categories.len().max(1)) - 0.5);
        Self { categories, ..axis }
    }

    /// Extends the range to a value, for example to 0 for quantities compared by length.
    #[must_use]
    pub fn include(mut self, value: f64) -> Self {
        self.includes.push(value);
        self
    }

    /// Ends the axis at the content, without a margin.
    #[must_use]
    pub fn tight(self) -> Self {
        Self { tight: true, ..self }
    }

    /// Restricts ticks to multiples of a number, at least 1: 20 for decibels, 45 for degrees, 1 for counts.
    #[must_use]
    pub fn multiples_of(self, step: u32) -> Self {
        Self { multiples: Some(step.max(1)), ..self }
    }

    /// Extends the range to the next ticks.
    #[must_use]
    pub fn ends_at_ticks(self) -> Self {
        Self { ends_at_ticks: true, ..self }
    }

    /// Returns the title: name, symbol and unit, with the power of ten by which the tick labels must be multiplied.
    pub(crate) fn title(&self, exponent: i32) -> Text {
        let mut title = self.name.clone();
        if !self.symbol.is_empty() {
            // The hard space U+00A0 keeps name and symbol together where the title is wrapped.
            title = if title.is_empty() { self.symbol.clone() } else { title.then("\u{a0}").then(self.symbol.clone()) };
        }
        if exponent == 0 && self.unit.is_empty() {
            return title;
        }
        title = title.then(" [");
        if exponent != 0 {
            title = title.then(Text::power_of_ten("1", exponent));
            if !self.unit.is_empty() {
                title = title.then("\u{a0}");
            }
        }
        title.then(self.unit.as_str()).then("]")
    }

    /// Returns the range shown for content between two values; `None` for no content.
    pub(crate) fn shown(&self, content: Option<(f64, f64)>) -> Extent {
        let usable = |value: &f64| value.is_finite() && (self.scale == Scale::Linear || *value > 0.0);
        // Larger values would overflow in the computation of places.
        let limit = |value: f64| value.clamp(-1e300, 1e300);
        let (low, high) = match self.range {
            // A range without a place on the axis, such as zero on a logarithmic axis, gives way to the range of the content.
            Some((low, high)) if usable(&low) && usable(&high) => (limit(low), limit(high)),
            _ => {
                let known = content.into_iter().flat_map(|(low, high)| [low, high]).chain(self.includes.iter().copied()).filter(usable);
                let (low, high) = known.map(limit).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
                // Nothing has a place on the axis. Any range will do; a unit or a decade has simple ticks.
                if low > high {
                    (if self.scale == Scale::Linear { 0.0 } else { 1.0 }, if self.scale == Scale::Linear { 1.0 } else { 10.0 })
                } else {
                    (low, high)
                }
            }
        };
        // A margin would move the ends of a range set by the caller.
        let margin = if self.tight || self.range.is_some() { 0.0 } else { 0.05 };
        // A value set by `include` is an intended end, such as 0, and gets no margin.
        let held = |end: f64| self.includes.iter().any(|value| value.to_bits() == end.to_bits());
        let margins = (if held(low) { 0.0 } else { margin }, if held(high) { 0.0 } else { margin });
        let extent = Extent::new(self.scale, low, high, margins);
        if self.ends_at_ticks { extent.widened_to_ticks(self.multiples) } else { extent }
    }

    /// Returns ticks, about `most` at most.
    pub(crate) fn ticks(&self, extent: Extent, most: usize) -> Ticks {
        if self.categories.is_empty() { Ticks::of(extent, most, self.multiples) } else { Ticks::named(&self.categories) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_range_is_empty() {
        for (low, high) in [(0.0, 0.0), (5.0, 5.0), (1e300, 1e300), (-1e308, 1e308), (f64::NAN, 1.0), (1e9, 1e9 + 1e-7), (1e-320, 1e305)] {
            for axis in [Axis::new(""), Axis::new("").logarithmic(), Axis::new("").ends_at_ticks(), Axis::new("").multiples_of(20).ends_at_ticks()] {
                let extent = axis.range(low, high).shown(None);
                assert!(extent.high > extent.low && (extent.high - extent.low).is_finite(), "{low} {high}: {extent:?}");
            }
        }
    }

    /// The decimal logarithms run from −300 to 300, so 1 lies halfway.
    #[test]
    fn hundreds_of_decades_are_an_axis_too() {
        let extent = Axis::new("").logarithmic().range(1e-300, 1e300).shown(None);
        assert_eq!([1e-300, 1.0, 1e300].map(|value| (1e9 * extent.place(value)).round()), [0.0, 5e8, 1e9]);
    }

    #[test]
    fn an_axis_that_ends_at_ticks_ends_at_the_decades_that_hold_its_values() {
        let ends = |low, high| {
            let extent = Axis::new("").logarithmic().tight().ends_at_ticks().shown(Some((low, high)));
            [extent.low, extent.high].map(|end| libm::log10(end).round())
        };
        assert_eq!(ends(2e-17, 1e-9), [-17.0, -9.0]);
        assert_eq!(ends(1e-7, 1e-3), [-7.0, -3.0]);
    }
}
