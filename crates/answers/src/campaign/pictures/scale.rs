//! The scale of discrepancies along an axis, common to all panels of a picture.

use cohaptic_campaign::Quantiles;
use cohaptic_picture::Axis;

/// Largest ratio of the largest to the smallest positive quantile on a linear axis.
const RATIO: f64 = 100.0;
/// Bound below which all discrepancies are shown in millimetres \[m\].
const MILLIMETRES: f64 = 1.0;

/// Scale of discrepancies.
pub(super) struct Scale {
    /// Unit of the axis: its size \[m\] and its name.
    unit: (f64, &'static str),
    logarithmic: bool,
    /// Smallest and largest quantile \[m\]; on a logarithmic axis, of the positive quantiles.
    all: (f64, f64),
    /// Smallest and largest median \[m\].
    medians: (f64, f64),
}

impl Scale {
    pub(super) fn of(quantiles: &[Option<Quantiles>]) -> Self {
        let known = || quantiles.iter().flatten();
        let all = span(known().flat_map(|quantiles| [quantiles.p5, quantiles.p95]));
        // The ratio is taken over positive values only: with zero among the values it would be infinite.
        let positive = span(known().flat_map(|quantiles| [quantiles.p5, quantiles.p95]).filter(|value| *value > 0.0));
        let medians = span(known().map(|quantiles| quantiles.median));
        let unit = if all.1 < MILLIMETRES { (1e-3, "mm") } else { (1.0, "m") };
        Self { unit, logarithmic: positive.1 > RATIO * positive.0, all: if positive.1 > RATIO * positive.0 { positive } else { all }, medians }
    }

    /// Converts metres to the unit of the axis.
    pub(super) fn value(&self, metres: f64) -> f64 {
        metres / self.unit.0
    }

    /// Returns the axis of quantiles.
    pub(super) fn axis(&self) -> Axis {
        let (low, high) = (self.value(self.all.0), self.value(self.all.1));
        let axis = Axis::new("Largest discrepancy").unit(self.unit.1);
        if self.logarithmic {
            return axis.logarithmic().range(low / 1.2, high * 1.2);
        }
        let margin = 0.05 * (high - low);
        // Equal values get a margin on both sides. Values at zero or above never get an axis beginning below zero.
        let margin = if margin > 0.0 { margin } else { (0.05 * high).max(1e-3) };
        axis.range(if low >= 0.0 { (low - margin).max(0.0) } else { low - margin }, high + margin)
    }

    /// Returns the axis of the colours of medians.
    pub(super) fn axis_of_medians(&self) -> Axis {
        let axis = Axis::new("Median of the largest discrepancy").unit(self.unit.1);
        let (low, high) = (self.value(self.medians.0), self.value(self.medians.1));
        if !self.logarithmic {
            return axis.range(low, high);
        }
        let axis = axis.logarithmic();
        // A median of zero has no place on a logarithmic axis. The picture then chooses the range.
        if low > 0.0 { axis.range(low, high) } else { axis }
    }
}

/// Returns the smallest and the largest finite value; 0 and 0 if there are none.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let found =
        values.filter(|value| value.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if found.0 > found.1 { (0.0, 0.0) } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(p5: f64, median: f64, p95: f64) -> Option<Quantiles> {
        Some(Quantiles { p5, p25: p5, median, p75: median, p95 })
    }

    #[test]
    fn small_discrepancies_are_in_millimetres_and_two_decades_are_logarithmic() {
        let small = Scale::of(&[of(1e-3, 2e-3, 4e-3), None]);
        assert!((small.value(2e-3) - 2.0).abs() < 1e-15);
        assert_eq!(small.axis(), Axis::new("Largest discrepancy").unit("mm").range(1.0 - 0.05 * 3.0, 4.0 + 0.05 * 3.0));
        let wide = Scale::of(&[of(0.01, 0.5, 2.0)]);
        assert_eq!(wide.axis(), Axis::new("Largest discrepancy").unit("m").logarithmic().range(0.01 / 1.2, 2.4));
        // A logarithmic axis has no place for zero, and zero does not change its range.
        let with_zero = Scale::of(&[of(0.0, 0.5, 2.0), of(0.01, 0.5, 2.0)]);
        assert_eq!(with_zero.axis(), wide.axis());
        let nothing = Scale::of(&[of(0.0, 0.0, 0.0)]);
        assert_eq!(nothing.axis(), Axis::new("Largest discrepancy").unit("mm").range(0.0, 1e-3));
    }
}
