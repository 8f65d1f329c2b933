//! A logarithmic scale: which decades it spans, where its marks are, and what they say.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;

/// The decimal logarithms of a scale's ends, whole numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Scale {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Scale {
    /// The whole decades that hold all numbers above zero, at least one.
    pub(crate) fn over(values: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for exponent in values.filter(|value| *value > 0.0).map(libm::log10) {
            (low, high) = (low.min(exponent.floor()), high.max(exponent.ceil()));
        }
        if low > high {
            return Self { low: -16.0, high: -15.0 };
        }
        Self { low, high: high.max(low + 1.0) }
    }

    /// The logarithms of its marks: each decade, every second, third, … of many, and 2 and 5 within each of one or two.
    fn marks(self) -> Vec<f64> {
        let decades = self.high - self.low;
        let step = (decades / 9.0).ceil();
        let mut marks = Vec::new();
        let mut decade = (self.low / step).ceil() * step;
        while decade <= self.high {
            marks.push(decade);
            if decades <= 2.0 && decade < self.high {
                marks.extend([2.0, 5.0].map(|times| decade + libm::log10(times)));
            }
            decade += step;
        }
        marks
    }

    /// What a mark says: the number, not its logarithm.
    fn label(mark: f64) -> String {
        let decade = mark.floor();
        let times = libm::exp10(mark - decade).round();
        if (-3.0..4.0).contains(&decade) { format!("{}", times * libm::exp10(decade)) } else { format!("{times}e{decade}") }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range()).map(value, limit)
    }

    fn key_points<H: KeyPointHint>(&self, _: H) -> Vec<f64> {
        self.marks()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Scale {
    fn format(mark: &f64) -> String {
        Self::label(*mark)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: &[f64]) -> Vec<String> {
        Scale::over(values.iter().copied()).marks().iter().map(|mark| Scale::label(*mark)).collect()
    }

    #[test]
    fn one_or_two_decades_have_marks_within() {
        assert_eq!(labels(&[30.0]), ["10", "20", "50", "100"]);
        assert_eq!(labels(&[0.004, 0.03]), ["0.001", "0.002", "0.005", "0.01", "0.02", "0.05", "0.1"]);
        assert_eq!(labels(&[4e-7]), ["1e-7", "2e-7", "5e-7", "1e-6"]);
    }

    #[test]
    fn many_decades_have_a_mark_for_each_or_for_some() {
        assert_eq!(labels(&[2.0, 3e4]), ["1", "10", "100", "1000", "1e4", "1e5"]);
        assert_eq!(labels(&[2e-17, 3e-5]), ["1e-16", "1e-14", "1e-12", "1e-10", "1e-8", "1e-6", "1e-4"]);
        assert!(labels(&[4.9e-324, 1.7e308]).len() <= 10);
    }

    #[test]
    fn a_number_on_a_decade_and_none_at_all_have_a_scale_too() {
        assert_eq!(labels(&[10.0]), ["10", "20", "50", "100"]);
        assert_eq!(labels(&[0.0]), ["1e-16", "2e-16", "5e-16", "1e-15"]);
    }
}
