//! How long a copy takes to travel a distance.

use std::time::Duration;

use cohaptic_scene::{Measure, MeasureTravel};
use cohaptic_units::Instant;

use super::{Accumulator, Asked, Rows};
use crate::TickRow;

/// As `travel` in `[expect]`: the first tick at which the copy is at least that far from where it began.
#[derive(Clone, Debug)]
pub(super) struct Travel {
    travel: MeasureTravel,
    start: f64,
    reached: Option<Instant>,
}

impl Accumulator for Travel {
    type Figure = ();

    const GIVES: &'static [(Measure, ())] = &[(Measure::Travel, ())];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        let travel = asked.settings.travel;
        Self { travel, start: asked.scene.peers[travel.peer].position[travel.axis], reached: None }
    }

    #[inline]
    fn on_tick(&mut self, row: &TickRow<'_>) {
        let MeasureTravel { peer, axis, distance } = self.travel;
        if row.peer == peer && self.reached.is_none() && (row.object.position[axis] - self.start).abs() >= distance {
            self.reached = Some(row.at);
        }
    }

    fn value(&self, _figure: (), _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        self.reached.map(Instant::as_secs_f64)
    }
}
