//! Whether a scene does what its `[expect]` says.

mod expectations;
mod stability;

pub use stability::{Stability, stability};

use std::convert::Infallible;

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::{Ending, Model, Observer, Simulation, TickRow};
use expectations::Watched;

/// Runs a scene and gives one line for each expectation that does not hold, in the order of the file's sections; empty if all hold.
///
/// A scene that is [too large](crate::too_large) to be simulated gives the one line that says so.
///
/// Whether the scene is stable is told by a simulation. `keep_going` is asked about every thousand instants; when it says `false` the check ends with a
/// line that says so.
#[must_use]
pub fn check(scene: &Scene, model: Model, keep_going: impl FnMut() -> bool) -> Vec<String> {
    check_with(scene, model, |_, _| Judged::Unknown, keep_going)
}

/// What a caller knows of whether a scene is as stable as it is expected to be.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Judged {
    /// It is.
    AsExpected,
    /// It is not, or that cannot be told: a line that says so.
    Otherwise(String),
    /// Nothing: a simulation tells.
    Unknown,
}

/// [`check`], where `judge` is asked first whether the scene is stable (`true`) or unstable (`false`), as expected.
#[must_use]
pub fn check_with(scene: &Scene, model: Model, judge: impl FnOnce(&Scene, bool) -> Judged, mut keep_going: impl FnMut() -> bool) -> Vec<String> {
    let Some(expect) = &scene.expect else {
        return Vec::new();
    };
    if let Some(reason) = crate::too_large(scene) {
        return vec![reason];
    }
    let mut observer = Watching { watched: Watched::new(scene, expect), keep_going: &mut keep_going };
    let Ok(summary) = Simulation::new(scene, model).run(&mut observer);
    let watched = observer.watched;
    let mut failures = Vec::new();
    if let Ending::Interrupted(at) = summary.ending {
        failures.push(format!("interrupted at {at}"));
        return failures;
    }
    if let Some(expected) = expect.stable {
        match judge(scene, expected) {
            Judged::AsExpected => {}
            Judged::Otherwise(failure) => failures.push(failure),
            Judged::Unknown => failures.extend(stability(scene, model, &mut keep_going).failure(expected)),
        }
    }
    failures.extend(watched.failures(scene, expect, &summary));
    failures
}

/// Watches what expectations are about.
struct Watching<'a, F> {
    watched: Watched,
    keep_going: &'a mut F,
}

impl<F: FnMut() -> bool> Observer for Watching<'_, F> {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        self.watched.wants_ticks()
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.watched.on_tick(row);
        Ok(())
    }

    fn keep_going(&mut self, _now: Instant) -> bool {
        (self.keep_going)()
    }
}
