//! Checks of a scene against its `[expect]`.

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

/// Runs a scene and returns one line for each failed expectation, in the order of the sections in the file. Empty if all hold.
///
/// A scene [too large](crate::too_large) for a simulation returns the one line with this reason.
///
/// A simulation decides whether the scene is stable. `keep_going` is called about every thousand instants. If it returns `false`, the check ends with a line
/// about the interruption.
#[must_use]
pub fn check(scene: &Scene, model: Model, keep_going: impl FnMut() -> bool) -> Vec<String> {
    check_with(scene, model, |_, _| Judged::Unknown, keep_going).failures()
}

/// Knowledge of the caller about the stability of a scene.
#[derive(Clone, PartialEq, Debug)]
pub enum Judged {
    /// The caller has a finding.
    Found(Finding),
    /// The caller has no finding, so a simulation decides.
    Unknown,
}

/// Result of a check.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Checked {
    /// Outcomes of all expectations, in the order of the sections in the file.
    pub outcomes: Vec<Outcome>,
    /// Reason why the scene could not be checked; `None` if the scene was checked.
    pub unchecked: Option<String>,
}

impl Checked {
    /// Returns the reason why the scene could not be checked, if any, and one line for each failed expectation.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        self.unchecked.iter().cloned().chain(self.outcomes.iter().filter_map(Outcome::failure)).collect()
    }
}

/// Like [`check`], with the outcome of each expectation. `judge` is asked about the stability of the scene before a simulation; the second argument of `judge`
/// is the expectation: `true` for stable, `false` for unstable.
#[must_use]
pub fn check_with(scene: &Scene, model: Model, judge: impl FnOnce(&Scene, bool) -> Judged, mut keep_going: impl FnMut() -> bool) -> Checked {
    let Some(expect) = &scene.expect else {
        return Checked::default();
    };
    let unchecked = |reason: String| Checked { outcomes: Vec::new(), unchecked: Some(reason) };
    if let Some(too_large) = crate::too_large(scene, model, true) {
        return unchecked(too_large.reason);
    }
    // One run serves all expectations but stability, and the second observer passes the question about going on.
    let mut observer = (Watched::new(scene, expect), Asking(&mut keep_going));
    let Ok(summary) = Simulation::new(scene, model).run(&mut observer);
    let (watched, _) = observer;
    if let Ending::Interrupted(at) = summary.ending {
        return unchecked(format!("interrupted at {at}"));
    }
    let mut outcomes = Vec::new();
    // The stability comes last of the computations: an interrupted run says nothing, and the question may need further runs.
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

/// Observer for the expectations decided by a single run: all but `stable`.
#[derive(Debug)]
pub struct ExpectationWatch<'a> {
    scene: &'a Scene,
    watched: Option<Watched>,
}

impl<'a> ExpectationWatch<'a> {
    /// Returns the observer before the run.
    #[must_use]
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene, watched: scene.expect.as_ref().map(|expect| Watched::new(scene, expect)) }
    }

    /// Returns the outcomes after the run; empty after an interrupted run.
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

/// Observer that is asked only whether the run goes on.
struct Asking<'a, F>(&'a mut F);

impl<F: FnMut() -> bool> Observer for Asking<'_, F> {
    type Error = Infallible;

    fn keep_going(&mut self, _now: Instant) -> bool {
        (self.0)()
    }
}
