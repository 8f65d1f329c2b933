//! Distance between copies over the instants of a run: root mean square and quantiles.

use std::time::Duration;

use cohaptic_scene::Measure;

use super::quantiles::QuantileSketch;
use super::{Accumulator, Asked, Rows, mean_square_root};
use crate::InstantRow;

/// Discrepancies so far. Each instant at which any peer ticks counts once.
#[derive(Clone, Debug)]
pub(super) struct Discrepancy {
    /// Σ of the squared discrepancies \[m²\].
    squares: f64,
    count: u64,
    /// Sketch of the discrepancies \[m\]; `None` if no quantile is wanted.
    sketch: Option<QuantileSketch>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Rms,
    /// Quantile of a number of per cent.
    Quantile(u64),
}

impl Accumulator for Discrepancy {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] = &[
        (Measure::DiscrepancyRms, Figure::Rms),
        (Measure::DiscrepancyP50, Figure::Quantile(50)),
        (Measure::DiscrepancyP95, Figure::Quantile(95)),
        (Measure::DiscrepancyP99, Figure::Quantile(99)),
    ];
    const ROWS: Rows = Rows { instants: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        let has_quantile = Self::GIVES.iter().any(|(measure, figure)| matches!(figure, Figure::Quantile(_)) && asked.has(*measure));
        let sketch = has_quantile.then(QuantileSketch::default);
        Self { squares: 0.0, count: 0, sketch }
    }

    #[inline]
    fn on_instant(&mut self, row: &InstantRow) {
        self.squares += row.discrepancy * row.discrepancy;
        self.count += 1;
        if let Some(sketch) = &mut self.sketch {
            sketch.insert(row.discrepancy);
        }
    }

    fn value(&self, figure: Figure, _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        match figure {
            Figure::Rms => mean_square_root(self.squares, self.count),
            Figure::Quantile(percent) => self.sketch.as_ref()?.quantile(percent),
        }
    }
}
