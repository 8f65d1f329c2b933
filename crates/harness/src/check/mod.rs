//! Whether a scene does what its `[expect]` says.

mod expectations;
mod outcome;
mod stability;

pub use outcome::{Finding, Outcome};
pub use stability::{Stability, stability};

use std::convert::Infallible;

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::observer::observe_by_field;
use crate::{Ending, Model, Observer, Simulation, Summary};
use expectations::Watched;

/// Runs a scene and gives one line for each expectation that does not hold, in the order of the file's sections; empty if all hold.
///
/// A scene that is [too large](crate::too_large) to be simulated gives the one line that says so.
///
/// Whether the scene is stable is told by a simulation. `keep_going` is asked about every thousand instants; when it says `false` the check ends with a
/// line that says so.
#[must_use]
pub fn check(scene: &Scene, model: Model, keep_going: impl FnMut() -> bool) -> Vec<String> {
    check_with(scene, model, |_, _| Judged::Unknown, keep_going).failures()
}

/// What a caller knows of whether a scene is as stable as it is expected to be.
#[derive(Clone, PartialEq, Debug)]
pub enum Judged {
    /// What was found.
    Found(Finding),
    /// Nothing: a simulation tells.
    Unknown,
}

/// What came out of a check.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Checked {
    /// Of each expectation, in the order of the file's sections.
    pub outcomes: Vec<Outcome>,
    /// Why the scene could not be checked; `None` if it was.
    pub unchecked: Option<String>,
}

impl Checked {
    /// One line for each expectation that does not hold, after the reason why the scene could not be checked.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        self.unchecked.iter().cloned().chain(self.outcomes.iter().filter_map(Outcome::failure)).collect()
    }
}

/// [`check`] with what came out of each expectation, where `judge` is asked first whether the scene is stable (`true`) or unstable (`false`), as expected.
#[must_use]
pub fn check_with(scene: &Scene, model: Model, judge: impl FnOnce(&Scene, bool) -> Judged, mut keep_going: impl FnMut() -> bool) -> Checked {
    let Some(expect) = &scene.expect else {
        return Checked::default();
    };
    let unchecked = |reason: String| Checked { outcomes: Vec::new(), unchecked: Some(reason) };
    if let Some(too_large) = crate::too_large(scene, model, true) {
        return unchecked(too_large.reason);
    }
    let mut observer = (Watched::new(scene, expect), Asking(&mut keep_going));
    let Ok(summary) = Simulation::new(scene, model).run(&mut observer);
    let (watched, _) = observer;
    if let Ending::Interrupted(at) = summary.ending {
        return unchecked(format!("interrupted at {at}"));
    }
    let mut outcomes = Vec::new();
    if let Some(expected) = expect.stable {
        let finding = match judge(scene, expected) {
            Judged::Found(finding) => finding,
            Judged::Unknown => stability(scene, model, &mut keep_going).finding(expected),
        };
        outcomes.push(Outcome::stability(expected, finding));
    }
    outcomes.extend(watched.outcomes(scene, expect, &summary));
    Checked { outcomes, unchecked: None }
}

/// Watches a run for the expectations that a single run can answer: all but `stable`.
#[derive(Debug)]
pub struct ExpectationWatch<'a> {
    scene: &'a Scene,
    watched: Option<Watched>,
}

impl<'a> ExpectationWatch<'a> {
    /// Before the run.
    #[must_use]
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene, watched: scene.expect.as_ref().map(|expect| Watched::new(scene, expect)) }
    }

    /// What came out; nothing of a run that was interrupted.
    #[must_use]
    pub fn outcomes(&self, summary: &Summary) -> Vec<Outcome> {
        match (&self.watched, &self.scene.expect) {
            (Some(watched), Some(expect)) if !matches!(summary.ending, Ending::Interrupted(_)) => watched.outcomes(self.scene, expect, summary),
            _ => Vec::new(),
        }
    }
}

impl Observer for ExpectationWatch<'_> {
    type Error = Infallible;

    observe_by_field! { watched }
}

/// Asks whether to go on.
struct Asking<'a, F>(&'a mut F);

impl<F: FnMut() -> bool> Observer for Asking<'_, F> {
    type Error = Infallible;

    fn keep_going(&mut self, _now: Instant) -> bool {
        (self.0)()
    }
}
