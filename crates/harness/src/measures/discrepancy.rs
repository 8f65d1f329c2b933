//! Distance between copies over the instants of a run: root mean square, quantiles, and the instant from which on copies stay together.

use std::time::Duration;

use cohaptic_scene::Measure;
use cohaptic_units::Instant;

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

/// First instant from which on the discrepancy has stayed within the band.
#[derive(Clone, Debug)]
pub(super) struct Settling {
    /// Largest discrepancy of settled copies \[m\].
    band: f64,
    /// Begin of the present stay within the band; `None` while the discrepancy is above the band.
    since: Option<Instant>,
}

impl Accumulator for Settling {
    type Figure = ();

    const GIVES: &'static [(Measure, ())] = &[(Measure::Settling, ())];
    const ROWS: Rows = Rows { instants: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        Self { band: asked.settings.band, since: Some(Instant::ZERO) }
    }

    fn on_instant(&mut self, row: &InstantRow) {
        if row.discrepancy > self.band {
            // A later instant within the band begins anew.
            self.since = None;
        } else if self.since.is_none() {
            self.since = Some(row.at);
        }
    }

    fn value(&self, _figure: (), _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        self.since.map(Instant::as_secs_f64)
    }
}
