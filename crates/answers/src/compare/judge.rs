//! Judges the combinations of a comparison: by analysis if the analysis is quick, otherwise by two runs, one of which begins with a small disturbance.

use std::fmt;

use cohaptic_campaign::{Judge, Judgement, Verdict};
use cohaptic_harness::Model;
use cohaptic_harness::check::{Stability, stability};
use cohaptic_scene::Scene;
use cohaptic_stability::Watch;

use crate::verdict::{Quick, quick_verdict};

/// Longest time of the analysis, by its estimate \[s\]. Two runs judge instead if the analysis would take longer.
const QUICK: f64 = 0.25;

/// Word for the kind of a verdict by two runs.
pub(super) const TWO_RUNS: &str = "two-runs";
/// Verdict of two runs without a decision within the duration of the scene.
pub(super) const UNDECIDED: &str = "undecided";

/// Judge of combinations by analysis or by two runs. The watch may stop the judging.
#[derive(Clone, Copy)]
pub struct ByAnalysisOrRuns<'a>(pub &'a dyn Watch);

impl fmt::Debug for ByAnalysisOrRuns<'_> {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("ByAnalysisOrRuns")
    }
}

impl Judge for ByAnalysisOrRuns<'_> {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        match quick_verdict(scene, QUICK, self.0) {
            Quick::Known(judgement) => {
                let radius = judgement.mean_square.as_ref().map_or(judgement.analysis.radius, |mean_square| mean_square.radius);
                let judged = judgement.kind().word().into();
                Some(Judgement::Known(Verdict { word: judgement.verdict.word().into(), judged, radius: radius.value, error: radius.error }))
            }
            // The reason of the quick verdict is not kept: the word `two-runs` tells that the analysis did not decide.
            Quick::Simulate(_) => by_runs(scene, self.0),
            Quick::Stopped => None,
        }
    }
}

/// Judges by two runs with the first seed. Such a verdict has no radius.
fn by_runs(scene: &Scene, watch: &dyn Watch) -> Option<Judgement> {
    let word = match stability(scene, Model::Least, || !watch.stops()) {
        Stability::Stable => cohaptic_stability::Verdict::Stable.word(),
        Stability::Unstable => cohaptic_stability::Verdict::Unstable.word(),
        Stability::Undecided { .. } => UNDECIDED,
        Stability::Interrupted => return None,
    };
    Some(Judgement::Known(Verdict { word: word.into(), judged: TWO_RUNS.into(), radius: f64::NAN, error: f64::NAN }))
}
