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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cohaptic_scene::Scene;

    use crate::check::check_with;
    use crate::measures::Measures;
    use crate::{Model, Observer, Simulation, TickRow};

    /// Index of a peer, and the instants \[s\] and positions \[m\] of its copy.
    struct Copy(usize, Vec<(f64, f64)>);

    impl Observer for Copy {
        type Error = std::convert::Infallible;

        fn wants_ticks(&self) -> bool {
            true
        }

        fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Self::Error> {
            if row.peer == self.0 {
                self.1.push((row.at.as_secs_f64(), row.object.position[0]));
            }
            Ok(())
        }
    }

    /// The user of a client is 5 cm away from the object, which belongs to the server and begins at 0. The client's copy travels 2 cm in the time between the
    /// recorded positions, not in no time.
    #[test]
    fn the_copy_of_a_client_travels_from_where_it_begins() {
        let text = "scene.duration = \"2s\"\nobject.mass = 0.45\nlink.delay = \"8ms\"\ncoordination = { strategy = \"client-server\", stiffness = 0.0, update = \"8ms\" }\n\
            peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 100.0, damping = 5.0 } }\n\
            peers = [{ name = \"server\", contact = \"none\" }, { name = \"left\", position = 0.05, hand = { force = 1.5 } }]\n\
            measure.names = [\"travel_s\"]\nmeasure.travel = { peer = \"left\", distance = 0.02 }\n\
            expect.travel = [{ peer = \"left\", distance = 0.02, min = \"50ms\" }]\n";
        let scene = Scene::parse(text, Path::new("client.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
        let mut copy = Copy(1, Vec::new());
        let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut copy);
        let (_, first) = copy.1[0];
        assert_eq!(first.to_bits(), 0.0_f64.to_bits(), "the copy begins where the server's does");
        let (reached, _) = copy.1.iter().find(|(_, position)| (position - first).abs() >= 0.02).unwrap();
        let measured = Measures::run(&scene, Model::Least).values;
        assert_eq!(measured.iter().map(|measure| measure.value).collect::<Vec<_>>(), [Some(*reached)]);
        let outcome = check_with(&scene, Model::Least, |_, _| unreachable!("stability is not expected"), || true).outcomes.remove(0);
        assert_eq!(outcome.measured, Some(*reached), "{outcome:?}");
        assert!(*reached > 0.05, "{reached}");
    }
}
