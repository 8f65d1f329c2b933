//! Whether a scene does what its `[expect]` says.

use std::cell::RefCell;

use cohaptic_harness::Model;
use cohaptic_harness::check::{Finding, Judged, Outcome, check_with};
use cohaptic_scene::Scene;
use cohaptic_stability::{Verdict, Watch};
use cohaptic_units::print::Number;
use serde::Serialize;

use crate::{Quick, quick_verdict};

/// What came out of a check.
#[derive(Clone, PartialEq, Debug)]
pub struct Answered {
    /// A line for each expectation that does not hold, or why the scene could not be checked; empty if all hold.
    pub failures: Vec<String>,
    /// What came out of each expectation; empty if the scene could not be checked.
    pub expectations: Vec<OutcomeDocument>,
    /// What was told in another way than it could be with more time.
    pub notes: Vec<String>,
}

/// One expectation and what came out.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct OutcomeDocument {
    /// The section of `[expect]`.
    pub expectation: &'static str,
    /// The quantity that is compared, in words.
    pub name: String,
    /// The unit of the numbers; empty for ratios.
    pub unit: &'static str,
    /// The least value that is expected.
    pub low: Option<f64>,
    /// The greatest value that is expected.
    pub high: Option<f64>,
    /// What came out, if it is a number.
    pub measured: Option<f64>,
    /// Whether that is as expected.
    pub passed: bool,
    /// The expectation in words.
    pub expected: String,
    /// What came out, in words.
    pub found: String,
}

impl OutcomeDocument {
    /// That of a result.
    #[must_use]
    pub fn new(outcome: &Outcome) -> Self {
        let Outcome { key, name, unit, low, high, measured, passed, expected, found, .. } = outcome.clone();
        Self { expectation: key, name, unit, low, high, measured, passed, expected, found }
    }
}

/// Checks a scene. Whether it is stable is told by the analysis if that is a matter of seconds, and by a simulation otherwise. The watch may end it.
#[must_use]
pub fn check(scene: &Scene, model: Model, watch: &dyn Watch) -> Answered {
    let notes = RefCell::new(Vec::new());
    let judge = |scene: &Scene, stable: bool| judged(scene, stable, watch, |note| notes.borrow_mut().push(note));
    let checked = check_with(scene, model, judge, || !watch.stops());
    let (failures, expectations) = (checked.failures(), checked.outcomes.iter().map(OutcomeDocument::new).collect());
    Answered { failures, expectations, notes: notes.into_inner() }
}

/// How long the second moment of a scene may take, by the estimate \[s\]; what takes longer is left to a simulation.
const QUICK: f64 = 10.0;

/// Whether a scene is as stable as it is expected to be, by analysis. One that is not linear, that changes on its way, or whose chance has no second
/// moment that can be followed in seconds, is left to a simulation; of the last it is noted.
fn judged(scene: &Scene, stable: bool, watch: &dyn Watch, note: impl FnOnce(String)) -> Judged {
    let judgement = match quick_verdict(scene, QUICK, watch) {
        Quick::Known(judgement) => judgement,
        Quick::Stopped => return Judged::Found(Finding { passed: false, found: "the analysis was interrupted".to_owned(), radius: None }),
        Quick::Simulate(refused) => {
            if let Some(refused) = refused {
                note(format!("stable: told by a simulation with the seed of the scene, not in the mean square: {refused}"));
            }
            return Judged::Unknown;
        }
    };
    let (radius, what) = match &judgement.mean_square {
        Some(mean_square) => (mean_square.radius, "mean-square radius"),
        None => (judgement.analysis.radius, "spectral radius"),
    };
    let expected = if stable { Verdict::Stable } else { Verdict::Unstable };
    let found = format!("it is {}: the {what} is {} within {:.1e}", judgement.verdict.word(), Number(radius.value), radius.error);
    Judged::Found(Finding { passed: judgement.verdict == expected, found, radius: Some(radius.value).filter(|value| value.is_finite()) })
}
