//! Checks a scene against its `[expect]`.

use std::cell::RefCell;

use cohaptic_harness::Model;
use cohaptic_harness::check::{Finding, Judged, Outcome, check_with};
use cohaptic_scene::Scene;
use cohaptic_stability::{Verdict, Watch};
use cohaptic_units::print::Number;
use serde::Serialize;

use crate::verdict::{Quick, quick_verdict};

/// Result of a check.
#[derive(Clone, PartialEq, Debug)]
pub struct Answered {
    /// Lines about failed expectations, or the reason why the scene could not be checked; empty if all expectations hold.
    pub failures: Vec<String>,
    /// Results of the expectations; empty if the scene could not be checked.
    pub expectations: Vec<OutcomeDocument>,
    /// Notes on results found in a less exact way to save time.
    pub notes: Vec<String>,
}

/// An expectation and its result.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct OutcomeDocument {
    /// Section of `[expect]`.
    pub expectation: &'static str,
    /// Compared quantity, in words.
    pub name: String,
    /// Unit of the numbers; empty for ratios.
    pub unit: &'static str,
    /// Least expected value; `None` without a lower bound.
    pub low: Option<f64>,
    /// Greatest expected value; `None` without an upper bound.
    pub high: Option<f64>,
    /// Found value, if the result is a number.
    pub measured: Option<f64>,
    /// `true` if the result is as expected.
    pub passed: bool,
    /// The expectation, in words.
    pub expected: String,
    /// The result, in words.
    pub found: String,
}

impl OutcomeDocument {
    /// Returns the document of a result.
    #[must_use]
    pub fn new(outcome: &Outcome) -> Self {
        let Outcome { key, name, unit, low, high, measured, passed, expected, found, .. } = outcome.clone();
        Self { expectation: key, name, unit, low, high, measured, passed, expected, found }
    }
}

/// Checks a scene. Stability is told by analysis if the analysis takes seconds only, otherwise by a simulation. The watch may stop the check.
#[must_use]
pub fn check(scene: &Scene, model: Model, watch: &dyn Watch) -> Answered {
    let notes = RefCell::new(Vec::new());
    let judge = |scene: &Scene, stable: bool| judged(scene, stable, watch, |note| notes.borrow_mut().push(note));
    let checked = check_with(scene, model, judge, || !watch.stops());
    let (failures, expectations) = (checked.failures(), checked.outcomes.iter().map(OutcomeDocument::new).collect());
    Answered { failures, expectations, notes: notes.into_inner() }
}

/// Longest time of the analysis, by its estimate \[s\].
const QUICK: f64 = 10.0;

/// Tells by analysis whether a scene is as stable as expected. A scene without a [quick verdict](quick_verdict()) is left to a simulation; `note` is called if
/// the reason is a second moment which cannot be followed in time.
fn judged(scene: &Scene, stable: bool, watch: &dyn Watch, note: impl FnOnce(String)) -> Judged {
    let judgement = match quick_verdict(scene, QUICK, watch) {
        Quick::Known(judgement) => judgement,
        Quick::Stopped => return Judged::Found(Finding { passed: false, found: "the analysis was interrupted".to_owned(), radius: None }),
        Quick::Simulate(refused) => {
            if let Some(refused) = refused {
                note(format!("stable: judged by a simulation with the seed of the scene, not in the mean square: {refused}"));
            }
            return Judged::Unknown;
        }
    };
    let (radius, what) = match &judgement.mean_square {
        Some(mean_square) => (mean_square.radius, "mean-square radius"),
        None => (judgement.analysis.radius, "spectral radius"),
    };
    // A marginal or overflowing verdict meets neither expectation.
    let expected = if stable { Verdict::Stable } else { Verdict::Unstable };
    let found = format!("it is {}: the {what} is {} within {:.1e}", judgement.verdict.word(), Number(radius.value), radius.error);
    Judged::Found(Finding { passed: judgement.verdict == expected, found, radius: Some(radius.value).filter(|value| value.is_finite()) })
}
