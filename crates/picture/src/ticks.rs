//! Positions and labels of ticks: round numbers, with a common power of ten for long labels.

use crate::extent::{Extent, Scale, count};
use crate::text::Text;

/// Distance of ticks on a linear axis: `mantissa`·10^`power`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    mantissa: i32,
    power: i32,
}

impl Step {
    /// Returns the smallest round step with at most `most` ticks.
    pub(crate) fn of(extent: Extent, most: usize, multiples: Option<u32>) -> Self {
        let most = f64::from(u32::try_from(most.max(2)).unwrap_or(u32::MAX));
        let least = (extent.high - extent.low) / most;
        if let Some(multiple) = multiples {
            // Factors 1, 2, 4 (a turn of 360° is 2·4·45°), and 10 times these.
            let factors = [1, 2, 4, 10, 20, 40, 100, 200, 400, 1000];
            let wanted = factors.into_iter().map(|factor| i32::try_from(multiple).unwrap_or(1).saturating_mul(factor));
            if let Some(mantissa) = wanted.into_iter().find(|step| f64::from(*step) >= least) {
                return Self { mantissa, power: 0 };
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a logarithm of a finite number is small")]
        let power = libm::log10(least).floor() as i32;
        // `least` lies between two powers of ten, so one of 1, 2, 5 and 10 times the lower power is large enough.
        let steps = [(1, power), (2, power), (5, power), (1, power + 1)].map(|(mantissa, power)| Self { mantissa, power });
        steps.into_iter().find(|step| step.size() >= least * (1.0 - 1e-9)).unwrap_or(Self { mantissa: 2, power: power + 1 })
    }

    fn size(self) -> f64 {
        decimal(i64::from(self.mantissa), self.power)
    }

    /// Returns the first and the last multiple of the step around a range, and the step.
    pub(crate) fn around(self, extent: Extent) -> (f64, f64, f64) {
        let size = self.size();
        ((extent.low / size + 1e-9).floor(), (extent.high / size - 1e-9).ceil(), size)
    }
}

/// Returns `number`·10^`power`, rounded to the nearest `f64`. Parsing rounds once, and a product would round twice.
fn decimal(number: i64, power: i32) -> f64 {
    format!("{number}e{power}").parse().unwrap_or(f64::NAN)
}

/// Ticks of an axis.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Ticks {
    /// Values with their labels.
    pub(crate) marks: Vec<(f64, Text)>,
    /// Values between the labelled ticks, with a thin line only.
    pub(crate) between: Vec<f64>,
    /// Power of ten by which labels must be multiplied.
    pub(crate) exponent: i32,
}

impl Ticks {
    pub(crate) fn of(extent: Extent, most: usize, multiples: Option<u32>) -> Self {
        match extent.scale {
            Scale::Linear => Self::linear(extent, most, multiples),
            Scale::Logarithmic => Self::logarithmic(extent, most),
        }
    }

    /// Returns ticks with names at 0, 1, 2 and so on.
    pub(crate) fn named(names: &[Text]) -> Self {
        let marks = names.iter().enumerate().map(|(place, name)| (count(place), name.clone())).collect();
        Self { marks, between: Vec::new(), exponent: 0 }
    }

    fn linear(extent: Extent, most: usize, multiples: Option<u32>) -> Self {
        let step = Step::of(extent, most, multiples);
        let size = step.size();
        let (first, last) = ((extent.low / size - 1e-9).ceil(), (extent.high / size + 1e-9).floor());
        #[expect(clippy::cast_possible_truncation, reason = "at most 1e9 steps from zero: see Extent::new")]
        let numbers: Vec<i64> = (first as i64..=last as i64).take(200).map(|count| count.saturating_mul(i64::from(step.mantissa))).collect();
        let largest = numbers.iter().map(|number| number.unsigned_abs()).max().unwrap_or(0);
        let digits = i32::try_from(largest.checked_ilog10().unwrap_or(0)).unwrap_or(0) + step.power;
        // Numbers with up to five digits before the point, or up to two zeros after it, are easy to read without a power of ten.
        let exponent = if largest == 0 || (-3..5).contains(&digits) { 0 } else { digits.div_euclid(3) * 3 };
        let mark = |number: i64| (decimal(number, step.power), Text::from(written(number, step.power - exponent)));
        Self { marks: numbers.into_iter().map(mark).collect(), between: Vec::new(), exponent }
    }

    fn logarithmic(extent: Extent, most: usize) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "a logarithm of a finite number is small")]
        let (low, high) = ((libm::log10(extent.low) - 1e-9).floor() as i32, (libm::log10(extent.high) + 1e-9).ceil() as i32);
        // Rounding may place a tick slightly outside the end of the axis at which the range was set.
        let inside = |value: &f64| (-1e-9..=1.0 + 1e-9).contains(&extent.place(*value));
        let multiples = |of: &[i64]| -> Vec<(i64, i32)> {
            (low..=high).flat_map(|power| of.iter().map(move |of| (*of, power))).filter(|(of, power)| inside(&decimal(*of, *power))).collect()
        };
        let decades = multiples(&[1]);
        // Over more than twelve decades, thin lines at all nine multiples would merge into grey.
        let nine: Vec<f64> =
            if high - low <= 12 { multiples(&[2, 3, 4, 5, 6, 7, 8, 9]).iter().map(|(of, power)| decimal(*of, *power)).collect() } else { Vec::new() };
        // Numbers of up to four digits are easier to read than powers.
        let plain = extent.low > 0.0099 && extent.high < 10_001.0;
        let label = |(of, power): (i64, i32)| {
            let text = if plain { Text::from(written(of, power)) } else { Text::power_of_ten(&of.to_string(), power) };
            (decimal(of, power), text)
        };
        // With two or more powers of ten in the range, only powers of ten have labels.
        if decades.len() >= 2 {
            let every = i32::try_from(decades.len().div_ceil(most.max(2))).unwrap_or(1).max(1);
            let marks = decades.into_iter().filter(|(_, power)| power.rem_euclid(every) == 0).map(label).collect();
            return Self { marks, between: nine, exponent: 0 };
        }
        // With fewer powers of ten, the first choice of multiples with a suitable number of ticks is used, or ticks as on a linear axis.
        let choices = [&[1, 2, 5][..], &[1, 2, 3, 5, 7], &[1, 2, 3, 4, 5, 6, 7, 8, 9]].map(multiples);
        match choices.into_iter().find(|marks| (2..=most.max(2)).contains(&marks.len())) {
            Some(marks) => Self { marks: marks.into_iter().map(label).collect(), between: nine, exponent: 0 },
            None => Self { between: Vec::new(), ..Self::linear(Extent { scale: Scale::Linear, ..extent }, most.min(4), None) },
        }
    }
}

/// Writes `number`·10^`power` in digits.
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

impl Extent {
    /// Widens the range to ticks, about seven.
    pub(crate) fn widened_to_ticks(self, multiples: Option<u32>) -> Self {
        const ABOUT: usize = 7;
        match self.scale {
            Scale::Linear => {
                let (first, last, unit) = Step::of(self, ABOUT, multiples).around(self);
                Self { low: first * unit, high: last.max(first + 1.0) * unit, ..self }
            }
            Scale::Logarithmic => {
                // A value within rounding of a power of ten counts as the power.
                let (first, last) = ((libm::log10(self.low) + 1e-9).floor(), (libm::log10(self.high) - 1e-9).ceil());
                Self { low: libm::pow(10.0, first), high: libm::pow(10.0, last.max(first + 1.0)), ..self }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Axis;

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
    fn names_stand_at_their_numbers() {
        let axis = Axis::new("strategy").categories(["ap", "pd", "other"]);
        let extent = axis.shown(Some((0.0, 9.0)));
        assert_eq!((extent.low, extent.high), (-0.5, 2.5));
        let marks: Vec<(f64, String)> = axis.ticks(extent, 2).marks.iter().map(|(place, name)| (*place, name.plain())).collect();
        assert_eq!(marks, [(0.0, "ap".to_owned()), (1.0, "pd".to_owned()), (2.0, "other".to_owned())]);
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
}
