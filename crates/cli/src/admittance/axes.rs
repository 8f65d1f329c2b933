//! The axes of a Bode plot: decades below, and steps of a size that suits decibels and angles.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;

/// A vertical axis with marks at multiples of a step.
pub(super) struct Steps {
    low: f64,
    high: f64,
    step: f64,
}

impl Steps {
    const MOST_STEPS: f64 = 8.0;

    /// An axis that shows the values between those two and ends at marks.
    pub(super) fn of((low, high): (f64, f64), step: f64) -> Self {
        let step = step * ((high - low) / (step * Self::MOST_STEPS)).ceil().max(1.0);
        // What is a multiple but for rounding is one: phases of a free mass.
        let (first, last) = ((low / step + 1e-9).floor(), (high / step - 1e-9).ceil());
        Self { low: first * step, high: last.max(first + 1.0) * step, step }
    }

    fn marks(&self) -> Vec<f64> {
        std::iter::successors(Some(self.low), |mark| Some(mark + self.step)).take_while(|mark| *mark <= self.high).collect()
    }
}

impl Ranged for Steps {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range()).map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.marks() }
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

/// A logarithmic axis with marks at powers of ten, and thin lines at the multiples between them.
pub(super) struct Decades {
    low: f64,
    high: f64,
}

impl Decades {
    /// From the lowest to the highest of what is shown; around it if there is but one.
    pub(super) fn of((low, high): (f64, f64)) -> Self {
        if low < high { Self { low, high } } else { Self { low: 0.5 * low, high: 2.0 * low } }
    }

    /// These multiples of every power of ten that are on the axis.
    fn multiples(&self, of: &[u32]) -> Vec<f64> {
        // Powers from −20 to 20: text gives the nearest number to each.
        let all = (-20..=20).flat_map(|power| of.iter().filter_map(move |multiple| format!("{multiple}e{power}").parse::<f64>().ok()));
        all.filter(|mark| self.low <= *mark && *mark <= self.high).collect()
    }

    /// Powers of ten; on a short axis more of their multiples; the ends if there are none of these.
    fn marks(&self) -> Vec<f64> {
        let found = [&[1][..], &[1, 2, 5], &[1, 2, 3, 4, 5, 6, 7, 8, 9]].into_iter().map(|of| self.multiples(of)).find(|marks| marks.len() > 1);
        found.unwrap_or_else(|| vec![self.low, self.high])
    }
}

impl Ranged for Decades {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.low.log10()..self.high.log10()).map(&value.log10(), limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { self.multiples(&[1, 2, 3, 4, 5, 6, 7, 8, 9]) } else { self.marks() }
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_multiples_of_a_step_and_have_few_marks() {
        let marks = |low, high, step| Steps::of((low, high), step).marks();
        assert_eq!(marks(-206.2, -0.03, 45.0), [-225.0, -180.0, -135.0, -90.0, -45.0, 0.0]);
        assert_eq!(marks(-90.0, -90.0, 45.0), [-90.0, -45.0]);
        assert_eq!(marks(0.0, 0.0, 20.0), [0.0, 20.0]);
        assert_eq!(marks(-1000.0, 0.0, 45.0), [-1080.0, -945.0, -810.0, -675.0, -540.0, -405.0, -270.0, -135.0, 0.0]);
    }

    #[test]
    fn frequencies_are_marked_at_powers_of_ten_the_ends_among_them() {
        let marks = |low, high| Decades::of((low, high)).marks();
        assert_eq!(marks(0.01, 100.0), [0.01, 0.1, 1.0, 10.0, 100.0]);
        assert_eq!(marks(0.3, 40.0), [1.0, 10.0]);
        assert_eq!(marks(2.0, 40.0), [2.0, 5.0, 10.0, 20.0]);
        assert_eq!(marks(4.5, 7.5), [5.0, 6.0, 7.0]);
        assert_eq!(marks(1.1, 1.2), [1.1, 1.2]);
        assert_eq!(marks(10.0, 10.0), [5.0, 10.0, 20.0]);
    }
}
