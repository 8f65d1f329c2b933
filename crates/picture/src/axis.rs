//! An axis: its name, symbol and unit, its scale and range, and where its ticks are.

use crate::text::Text;

/// How values lie along an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Scale {
    Linear,
    /// Values of zero and below have no place.
    Logarithmic,
}

/// One axis of a panel.
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
    range: Option<(f64, f64)>,
    includes: Vec<f64>,
    multiples: Option<u32>,
    ends_at_ticks: bool,
    tight: bool,
}

impl Axis {
    /// A linear axis over all of the content, with a margin.
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
        }
    }

    /// With a symbol, as [`Text::math`]: `K_T`.
    #[must_use]
    pub fn symbol(self, symbol: &str) -> Self {
        Self { symbol: Text::math(symbol), ..self }
    }

    /// With a unit, which is shown in brackets.
    #[must_use]
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { unit: unit.into(), ..self }
    }

    /// With a logarithmic scale.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { scale: Scale::Logarithmic, ..self }
    }

    /// From one value to another, whatever the content; lines are cut at the ends. Ends that are equal or not finite are made different.
    #[must_use]
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some((low.min(high), low.max(high))), ..self }
    }

    /// Reaches this value at least: 0 for quantities that are compared by length.
    #[must_use]
    pub fn include(mut self, value: f64) -> Self {
        self.includes.push(value);
        self
    }

    /// Ends where the content ends, without a margin.
    #[must_use]
    pub fn tight(self) -> Self {
        Self { tight: true, ..self }
    }

    /// Has ticks at multiples of this number only: 20 for decibels, 45 for degrees, 1 for counts.
    #[must_use]
    pub fn multiples_of(self, step: u32) -> Self {
        Self { multiples: Some(step.max(1)), ..self }
    }

    /// Ends at ticks.
    #[must_use]
    pub fn ends_at_ticks(self) -> Self {
        Self { ends_at_ticks: true, ..self }
    }

    /// Name, symbol and unit, the unit with a power of ten that the numbers at the ticks are to be multiplied by.
    pub(crate) fn title(&self, exponent: i32) -> Text {
        let mut title = self.name.clone();
        if !self.symbol.is_empty() {
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

    /// From where to where it shows, if the content reaches over these values.
    pub(crate) fn shown(&self, content: Option<(f64, f64)>) -> Extent {
        let usable = |value: &f64| value.is_finite() && (self.scale == Scale::Linear || *value > 0.0);
        let limit = |value: f64| value.clamp(-1e300, 1e300);
        let (low, high) = match self.range {
            Some((low, high)) if usable(&low) && usable(&high) => (limit(low), limit(high)),
            _ => {
                let known = content.into_iter().flat_map(|(low, high)| [low, high]).chain(self.includes.iter().copied()).filter(usable);
                let (low, high) = known.map(limit).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
                if low > high {
                    (if self.scale == Scale::Linear { 0.0 } else { 1.0 }, if self.scale == Scale::Linear { 1.0 } else { 10.0 })
                } else {
                    (low, high)
                }
            }
        };
        let margin = if self.tight || self.range.is_some() { 0.0 } else { 0.05 };
        let held = |end: f64| self.includes.iter().any(|value| value.to_bits() == end.to_bits());
        let margins = (if held(low) { 0.0 } else { margin }, if held(high) { 0.0 } else { margin });
        let extent = Extent::new(self.scale, low, high, margins);
        if self.ends_at_ticks { extent.widened_to_ticks(self.multiples) } else { extent }
    }

    /// Ticks of which there are about that many at most.
    pub(crate) fn ticks(&self, extent: Extent, most: usize) -> Ticks {
        Ticks::of(extent, most, self.multiples)
    }
}

/// The range of an axis, and how values lie in it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Extent {
    pub(crate) scale: Scale,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Extent {
    fn new(scale: Scale, low: f64, high: f64, margins: (f64, f64)) -> Self {
        match scale {
            Scale::Linear => {
                let least = 1e-9 * low.abs().max(high.abs()).max(1e-290);
                let (low, high) = if high - low < least { (low - 0.05 * low.abs() - 1e-12, high + 0.05 * high.abs() + 1e-12) } else { (low, high) };
                let span = high - low;
                Self { scale, low: low - margins.0 * span, high: high + margins.1 * span }
            }
            Scale::Logarithmic => {
                let (low, high) = (low.max(1e-300), high.max(1e-300));
                let (low, high) = if high / low < 1.000_001 { (low / 2.0, high * 2.0) } else { (low, high) };
                let ratio = libm::log10(high / low);
                Self { scale, low: low * libm::pow(10.0, -margins.0 * ratio), high: high * libm::pow(10.0, margins.1 * ratio) }
            }
        }
    }

    fn widened_to_ticks(self, multiples: Option<u32>) -> Self {
        const ABOUT: usize = 7;
        match self.scale {
            Scale::Linear => {
                let (first, last, unit) = Step::of(self, ABOUT, multiples).around(self);
                Self { low: first * unit, high: last * unit, ..self }
            }
            Scale::Logarithmic => {
                Self { low: libm::pow(10.0, libm::log10(self.low).floor()), high: libm::pow(10.0, libm::log10(self.high).ceil()), ..self }
            }
        }
    }

    /// Where a value lies: 0 at the low end, 1 at the high one. Not finite if it has no place.
    pub(crate) fn place(self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic if value > 0.0 => libm::log10(value / self.low) / libm::log10(self.high / self.low),
            Scale::Logarithmic => f64::NAN,
        }
    }
}

/// The distance of ticks on a linear axis: a whole number times a power of ten.
#[derive(Clone, Copy, Debug)]
struct Step {
    mantissa: i32,
    power: i32,
}

impl Step {
    /// The least nice step with which there are no more ticks than that.
    fn of(extent: Extent, most: usize, multiples: Option<u32>) -> Self {
        let most = f64::from(u32::try_from(most.max(2)).unwrap_or(u32::MAX));
        let least = (extent.high - extent.low) / most;
        if let Some(multiple) = multiples {
            // 1, 2, 4 (a turn is 360° = 2·4·45°), then 10 times these.
            let factors = [1, 2, 4, 10, 20, 40, 100, 200, 400, 1000];
            let wanted = factors.into_iter().map(|factor| i32::try_from(multiple).unwrap_or(1).saturating_mul(factor));
            if let Some(mantissa) = wanted.into_iter().find(|step| f64::from(*step) >= least) {
                return Self { mantissa, power: 0 };
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a logarithm of a finite number is small")]
        let power = libm::log10(least).floor() as i32;
        let steps = [(1, power), (2, power), (5, power), (1, power + 1)].map(|(mantissa, power)| Self { mantissa, power });
        steps.into_iter().find(|step| step.size() >= least * (1.0 - 1e-9)).unwrap_or(Self { mantissa: 2, power: power + 1 })
    }

    fn size(self) -> f64 {
        decimal(i64::from(self.mantissa), self.power)
    }

    /// Which multiples lie around an extent, and what they are multiples of.
    fn around(self, extent: Extent) -> (f64, f64, f64) {
        let size = self.size();
        ((extent.low / size + 1e-9).floor(), (extent.high / size - 1e-9).ceil(), size)
    }
}

/// A whole number times a power of ten, to the nearest number there is.
fn decimal(number: i64, power: i32) -> f64 {
    format!("{number}e{power}").parse().unwrap_or(f64::NAN)
}

/// The ticks of an axis.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Ticks {
    /// Value and label.
    pub(crate) marks: Vec<(f64, Text)>,
    /// Values between them that have a thin line only.
    pub(crate) between: Vec<f64>,
    /// What the labels are to be multiplied by: ten to this power.
    pub(crate) exponent: i32,
}

impl Ticks {
    fn of(extent: Extent, most: usize, multiples: Option<u32>) -> Self {
        match extent.scale {
            Scale::Linear => Self::linear(extent, most, multiples),
            Scale::Logarithmic => Self::logarithmic(extent, most),
        }
    }

    fn linear(extent: Extent, most: usize, multiples: Option<u32>) -> Self {
        let step = Step::of(extent, most, multiples);
        let size = step.size();
        let (first, last) = ((extent.low / size - 1e-9).ceil(), (extent.high / size + 1e-9).floor());
        #[expect(clippy::cast_possible_truncation, reason = "at most 1e9 steps from zero: see Extent::new")]
        let numbers: Vec<i64> = (first as i64..=last as i64).take(200).map(|count| count.saturating_mul(i64::from(step.mantissa))).collect();
        let largest = numbers.iter().map(|number| number.unsigned_abs()).max().unwrap_or(0);
        let digits = i32::try_from(largest.checked_ilog10().unwrap_or(0)).unwrap_or(0) + step.power;
        // Five digits before the point, or two zeros after it, are still read at a glance.
        let exponent = if largest == 0 || (-3..5).contains(&digits) { 0 } else { digits.div_euclid(3) * 3 };
        let mark = |number: i64| (decimal(number, step.power), Text::from(written(number, step.power - exponent)));
        Self { marks: numbers.into_iter().map(mark).collect(), between: Vec::new(), exponent }
    }

    fn logarithmic(extent: Extent, most: usize) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "a logarithm of a finite number is small")]
        let (low, high) = ((libm::log10(extent.low) - 1e-9).floor() as i32, (libm::log10(extent.high) + 1e-9).ceil() as i32);
        let inside = |value: &f64| (-1e-9..=1.0 + 1e-9).contains(&extent.place(*value));
        let multiples = |of: &[i64]| -> Vec<(i64, i32)> {
            (low..=high).flat_map(|power| of.iter().map(move |of| (*of, power))).filter(|(of, power)| inside(&decimal(*of, *power))).collect()
        };
        let decades = multiples(&[1]);
        let nine: Vec<f64> =
            if high - low <= 12 { multiples(&[2, 3, 4, 5, 6, 7, 8, 9]).iter().map(|(of, power)| decimal(*of, *power)).collect() } else { Vec::new() };
        // Numbers of up to four digits are read faster than powers.
        let plain = extent.low > 0.0099 && extent.high < 10_001.0;
        let label = |(of, power): (i64, i32)| {
            let text = if plain { Text::from(written(of, power)) } else { Text::power_of_ten(&of.to_string(), power) };
            (decimal(of, power), text)
        };
        if decades.len() >= 2 {
            let every = i32::try_from(decades.len().div_ceil(most.max(2))).unwrap_or(1).max(1);
            let marks = decades.into_iter().filter(|(_, power)| power.rem_euclid(every) == 0).map(label).collect();
            return Self { marks, between: nine, exponent: 0 };
        }
        let choices = [&[1, 2, 5][..], &[1, 2, 3, 5, 7], &[1, 2, 3, 4, 5, 6, 7, 8, 9]].map(multiples);
        match choices.into_iter().find(|marks| (2..=most.max(2)).contains(&marks.len())) {
            Some(marks) => Self { marks: marks.into_iter().map(label).collect(), between: nine, exponent: 0 },
            None => Self { between: Vec::new(), ..Self::linear(Extent { scale: Scale::Linear, ..extent }, most.min(4), None) },
        }
    }
}

/// A whole number times a power of ten in digits.
fn written(number: i64, power: i32) -> String {
    let sign = if number < 0 { "\u{2212}" } else { "" };
    let digits = number.unsigned_abs().to_string();
    if number == 0 {
        return "0".to_owned();
    }
    let Ok(places) = usize::try_from(-power) else { return format!("{sign}{digits}{}", "0".repeat(usize::try_from(power).unwrap_or(0))) };
    if places == 0 {
        return format!("{sign}{digits}");
    }
    let digits = format!("{digits:0>width$}", width = places + 1);
    let (whole, part) = digits.split_at(digits.len() - places);
    format!("{sign}{whole}.{part}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, low: f64, high: f64, most: usize) -> (Vec<String>, i32) {
        let ticks = axis.ticks(axis.clone().range(low, high).shown(None), most);
        (ticks.marks.iter().map(|(_, text)| text.plain()).collect(), ticks.exponent)
    }

    #[test]
    fn ticks_are_round_numbers_with_no_more_digits_than_they_need() {
        let axis = Axis::new("x");
        assert_eq!(labels(&axis, 0.0, 1.0, 6), (["0", "0.2", "0.4", "0.6", "0.8", "1.0"].map(String::from).to_vec(), 0));
        assert_eq!(labels(&axis, -0.3, 0.3, 4).0, ["\u{2212}0.2", "0", "0.2"]);
        assert_eq!(labels(&axis, 400.0, 10_000.0, 6).0, ["2000", "4000", "6000", "8000", "10000"]);
        assert_eq!(labels(&axis, 0.0, 3e6, 4), (["0", "1", "2", "3"].map(String::from).to_vec(), 6));
        assert_eq!(labels(&axis, 0.0, 4e-5, 5), (["0", "10", "20", "30", "40"].map(String::from).to_vec(), -6));
        assert_eq!(labels(&Axis::new("phase").multiples_of(45), -200.0, 0.0, 6).0, ["\u{2212}180", "\u{2212}135", "\u{2212}90", "\u{2212}45", "0"]);
    }

    #[test]
    fn decades_are_powers_of_ten_and_a_short_axis_has_multiples() {
        let axis = Axis::new("x").logarithmic();
        assert_eq!(labels(&axis, 0.01, 100.0, 9).0, ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(&axis, 2.0, 40.0, 6).0, ["2", "5", "10", "20"]);
        let small = axis.ticks(axis.clone().range(1e-9, 1e-3).shown(None), 3);
        assert_eq!(small.marks.iter().map(|(_, text)| text.plain()).collect::<Vec<_>>(), ["10\u{2212}9", "10\u{2212}6", "10\u{2212}3"]);
        assert_eq!(small.marks[0].1, Text::power_of_ten("1", -9));
    }

    #[test]
    fn no_range_is_empty() {
        for (low, high) in [(0.0, 0.0), (5.0, 5.0), (1e300, 1e300), (-1e308, 1e308), (f64::NAN, 1.0), (1e9, 1e9 + 1e-7)] {
            for axis in [Axis::new(""), Axis::new("").logarithmic(), Axis::new("").ends_at_ticks()] {
                let extent = axis.range(low, high).shown(None);
                assert!(extent.high > extent.low && (extent.high - extent.low).is_finite(), "{low} {high}: {extent:?}");
            }
        }
    }
}
