//! The axis of a measure, common to all panels. Runs which grow without bound do not flatten the other runs.

use cohaptic_campaign::{Comparison, Estimate};
use cohaptic_picture::Axis;

use crate::compare::figures::Shown;

/// Largest ratio of the largest usual mean to the least mean on a linear axis.
const RATIO: f64 = 100.0;
/// Bound of the axis, as a multiple of the size not exceeded by nine of ten means. Larger values are cut off.
const BEYOND: f64 = 4.0;

/// Axis of a measure.
pub(super) struct Scale {
    shown: Shown,
    low: f64,
    high: f64,
    is_logarithmic: bool,
    /// `true` if some means lie beyond the end of the axis.
    pub(super) is_cut: bool,
}

impl Scale {
    pub(super) fn of(comparison: &Comparison, measure: usize) -> Self {
        let shown = Shown::of(comparison, measure);
        let known = comparison.cells.iter().filter_map(|cell| cell.figures.get(measure)?.mean);
        let means: Vec<f64> = known.clone().map(|estimate| estimate.mean * shown.factor).collect();
        let mut sizes: Vec<f64> = means.iter().map(|mean| mean.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // The size not exceeded by nine of ten means. The remaining tenth may have grown without bound.
        let usual = sizes.get((9 * sizes.len()).div_ceil(10).saturating_sub(1)).copied().unwrap_or(1.0);
        let (least, most) = span(means.iter().copied());
        let is_logarithmic = least > 0.0 && usual > RATIO * least;
        let limit = BEYOND * usual;
        let is_cut = sizes.last().is_some_and(|largest| *largest > limit);
        let ends = known.flat_map(|estimate| [estimate.low(), estimate.high()]).map(|end| end * shown.factor);
        let (low, high) = if is_logarithmic {
            (least / 1.3, most.min(limit) * 1.3)
        } else {
            // The wide intervals of few runs are cut if they would leave no room for the means.
            let (least, most) = (least.max(-limit), most.min(limit));
            let room = (most - least).max(0.1 * most.abs().max(least.abs())).max(f64::MIN_POSITIVE);
            let (low, high) = span(ends);
            // A quantity without negative means gets no axis below zero, even if an interval reaches there.
            let low = if least >= 0.0 { low.max(0.0) } else { low };
            (low.max(least - room), high.min(most + room))
        };
        Self { shown, low, high, is_logarithmic, is_cut }
    }

    /// Returns the axis, named after the measure.
    pub(super) fn axis(&self) -> Axis {
        let axis = Axis::new(self.shown.title.as_str()).unit(self.shown.unit.as_str());
        if self.is_logarithmic {
            return axis.logarithmic().range(self.low, self.high);
        }
        let margin = 0.04 * (self.high - self.low);
        // An axis of values at zero or above does not begin below zero.
        axis.range(if self.low >= 0.0 { (self.low - margin).max(0.0) } else { self.low - margin }, self.high + margin)
    }

    /// Returns a mean in the unit of the axis.
    pub(super) fn mean(&self, estimate: &Estimate) -> f64 {
        estimate.mean * self.shown.factor
    }

    /// Returns the ends of an interval in the unit of the axis; both equal the mean without an interval.
    pub(super) fn ends(&self, estimate: &Estimate) -> (f64, f64) {
        let (low, high) = (estimate.low() * self.shown.factor, estimate.high() * self.shown.factor);
        // An interval which reaches below a logarithmic axis ends at the end of the axis.
        if self.is_logarithmic { (low.max(self.low), high) } else { (low, high) }
    }
}

/// Returns the smallest and the largest finite value; 0 and 1 if there are none.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let found =
        values.filter(|value| value.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if found.0 > found.1 { (0.0, 1.0) } else { found }
}
