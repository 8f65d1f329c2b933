//! How a measure lies along an axis: one axis for all panels, on which runs that grow without bound do not flatten the others.

use cohaptic_campaign::{Comparison, Estimate};
use cohaptic_picture::Axis;

use crate::compare::figures::Shown;

/// Above this ratio of the largest to the least mean, an axis is logarithmic.
const RATIO: f64 = 100.0;
/// What lies this many times beyond the size of nine means in ten is cut off.
const BEYOND: f64 = 4.0;

/// The axis of a measure.
pub(super) struct Scale {
    shown: Shown,
    low: f64,
    high: f64,
    is_logarithmic: bool,
    /// Whether some means are beyond its end.
    pub(super) is_cut: bool,
}

impl Scale {
    pub(super) fn of(comparison: &Comparison, measure: usize) -> Self {
        let shown = Shown::of(comparison, measure);
        let known = comparison.cells.iter().filter_map(|cell| cell.figures.get(measure)?.mean);
        let means: Vec<f64> = known.clone().map(|estimate| estimate.mean * shown.factor).collect();
        let mut sizes: Vec<f64> = means.iter().map(|mean| mean.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let usual = sizes.get((9 * sizes.len()).div_ceil(10).saturating_sub(1)).copied().unwrap_or(1.0);
        let (least, most) = span(means.iter().copied());
        let is_logarithmic = least > 0.0 && usual > RATIO * least;
        let limit = BEYOND * usual;
        let is_cut = sizes.last().is_some_and(|largest| *largest > limit);
        let ends = known.flat_map(|estimate| [estimate.low(), estimate.high()]).map(|end| end * shown.factor);
        let (low, high) = if is_logarithmic {
            (least / 1.3, most.min(limit) * 1.3)
        } else {
            // Wide intervals of few runs are cut where they would leave no room for the means.
            let (least, most) = (least.max(-limit), most.min(limit));
            let room = (most - least).max(0.1 * most.abs().max(least.abs())).max(f64::MIN_POSITIVE);
            let (low, high) = span(ends);
            // Of a quantity that is never negative an interval may be.
            let low = if least >= 0.0 { low.max(0.0) } else { low };
            (low.max(least - room), high.min(most + room))
        };
        Self { shown, low, high, is_logarithmic, is_cut }
    }

    /// The axis, under the name of the measure.
    pub(super) fn axis(&self) -> Axis {
        let axis = Axis::new(self.shown.title.as_str()).unit(self.shown.unit.as_str());
        if self.is_logarithmic {
            return axis.logarithmic().range(self.low, self.high);
        }
        let margin = 0.04 * (self.high - self.low);
        // Zero is not below its end where nothing is.
        axis.range(if self.low >= 0.0 { (self.low - margin).max(0.0) } else { self.low - margin }, self.high + margin)
    }

    /// A mean in the unit of the axis.
    pub(super) fn mean(&self, estimate: &Estimate) -> f64 {
        estimate.mean * self.shown.factor
    }

    /// The ends of an interval in the unit of the axis; none has both at the mean.
    pub(super) fn ends(&self, estimate: &Estimate) -> (f64, f64) {
        let (low, high) = (estimate.low() * self.shown.factor, estimate.high() * self.shown.factor);
        // What lies below a logarithmic axis ends at its end.
        if self.is_logarithmic { (low.max(self.low), high) } else { (low, high) }
    }
}

/// The least and the largest; 0 and 1 of none.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let found =
        values.filter(|value| value.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if found.0 > found.1 { (0.0, 1.0) } else { found }
}
