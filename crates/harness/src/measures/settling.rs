//! Instant from which on copies stay together.

use std::time::Duration;

use cohaptic_scene::Measure;
use cohaptic_units::Instant;

use super::{Accumulator, Asked, Rows};
use crate::InstantRow;

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

    #[inline]
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
