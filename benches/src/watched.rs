//! Watched runs: rows that are seen, with events and without, a plot, and all measures.

use std::convert::Infallible;
use std::hint::black_box;

use cohaptic_harness::check::check;
use cohaptic_harness::record::Bands;
use cohaptic_harness::{Model, Observer, TickRow, Ticks};
use cohaptic_scene::{Bounds, Expect, ExpectPosition, ExpectTravel, MeasureName, MeasureSettings, MeasureSpec, Scene};
use cohaptic_units::Instant;

/// Sees every row of every tick and keeps nothing.
#[derive(Clone, Copy, Debug)]
pub struct Onlooker {
    /// Wants rows of samples held as well, for which a run has events.
    has_events: bool,
}

impl Onlooker {
    /// Of ticks alone.
    pub const OF_TICKS: Self = Self { has_events: false };
    /// Of what takes events.
    pub const OF_EVENTS: Self = Self { has_events: true };
}

impl Observer for Onlooker {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_holds(&self) -> bool {
        self.has_events
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        black_box(row);
        Ok(())
    }
}

/// Sees where copies are along the first axis, as a run in a terminal does.
#[derive(Debug)]
pub struct Plotter(Bands);

impl Plotter {
    /// Before a run of the scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self(Bands::new(scene.duration, 144, scene.peers.len()))
    }
}

impl Observer for Plotter {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.0.add(row.peer, row.at, row.object.position[0]);
        Ok(())
    }

    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Infallible> {
        self.0.add_positions(ticks, 0);
        Ok(())
    }
}

/// The scene with expectations that hold: how far apart copies are, where that of the first peer is at the end, and when it has moved a centimetre.
#[must_use]
pub fn with_expectations(scene: Scene) -> Scene {
    let (end, any) = (Instant::ZERO.saturating_add(scene.duration), Bounds { min: None, max: Some(1e9) });
    let expect = Expect {
        discrepancy: Some(any),
        positions: vec![ExpectPosition { peer: 0, axis: 0, at: end, bounds: any }],
        travel: vec![ExpectTravel { peer: 0, axis: 0, distance: 0.01, bounds: any }],
        ..Expect::default()
    };
    Scene { expect: Some(expect), ..scene }
}

/// Checks the expectations of a scene, as `cohaptic check` does.
///
/// # Panics
///
/// If one does not hold.
pub fn checked(scene: &Scene) {
    let failures = check(scene, Model::Least, || true);
    assert!(failures.is_empty(), "{failures:?}");
}

/// The scene with every measure.
#[must_use]
pub fn with_all_measures(scene: Scene) -> Scene {
    let names = MeasureName::all(scene.peers.len(), scene.task.is_some());
    Scene { measure: Some(MeasureSpec { names, settings: MeasureSettings::default() }), ..scene }
}
