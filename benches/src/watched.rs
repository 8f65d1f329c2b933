//! Runs that somebody watches: the least that this costs, and all measures.

use std::convert::Infallible;
use std::hint::black_box;

use cohaptic_harness::{Observer, TickRow};
use cohaptic_scene::{MeasureName, MeasureSettings, MeasureSpec, Scene};

/// Sees every tick and keeps nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Onlooker;

impl Observer for Onlooker {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        black_box(row);
        Ok(())
    }
}

/// Sees every instant and keeps nothing: the least that makes a run have events.
#[derive(Clone, Copy, Debug, Default)]
pub struct WithEvents;

impl Observer for WithEvents {
    type Error = Infallible;

    fn wants_instants(&self) -> bool {
        true
    }
}

/// The scene with every measure.
#[must_use]
pub fn with_all_measures(scene: Scene) -> Scene {
    let names = MeasureName::all(scene.peers.len());
    Scene { measure: Some(MeasureSpec { names, settings: MeasureSettings::default() }), ..scene }
}
