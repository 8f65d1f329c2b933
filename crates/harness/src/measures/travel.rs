//! Time in which a copy travels a distance.

use std::time::Duration;

use cohaptic_scene::{Measure, MeasureTravel};
use cohaptic_units::Instant;

use super::{Accumulator, Asked, Rows};
use crate::TickRow;

/// First tick at which a copy is at least a given distance from its position at its first tick. The copy of a server's client begins at the server's copy, not
/// at the position of its peer in the scene.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Travelled {
    /// Position at the first tick \[m\]; `None` before.
    start: Option<f64>,
    /// First tick at the distance or beyond; `None` before.
    reached: Option<Instant>,
}

impl Travelled {
    /// Takes a position at a tick \[m\]. An overflowed position does not count as distant.
    pub(crate) fn see(&mut self, at: Instant, position: f64, distance: f64) {
        // The first call is at the first tick of the copy.
        let start = *self.start.get_or_insert(position);
        if self.reached.is_none() && position.is_finite() && (position - start).abs() >= distance {
            self.reached = Some(at);
        }
    }

    /// Returns the first tick at which the copy had travelled the distance; `None` if there is no such tick.
    pub(crate) const fn reached(self) -> Option<Instant> {
        self.reached
    }
}

/// Travel of the peer in `[measure]`. The figure is computed like `travel` in `[expect]`.
#[derive(Clone, Debug)]
pub(super) struct Travel {
    travel: MeasureTravel,
    travelled: Travelled,
}

impl Accumulator for Travel {
    type Figure = ();

    const GIVES: &'static [(Measure, ())] = &[(Measure::Travel, ())];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        Self { travel: asked.settings.travel, travelled: Travelled::default() }
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        // Other peers have no part in the figure: `[measure]` names the one peer.
        let MeasureTravel { peer, axis, distance } = self.travel;
        if row.peer == peer {
            self.travelled.see(row.at, row.object.position[axis], distance);
        }
    }

    fn value(&self, _figure: (), _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        self.travelled.reached().map(Instant::as_secs_f64)
    }
}
