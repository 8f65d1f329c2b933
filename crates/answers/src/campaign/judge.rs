//! Judges the combinations of a campaign by analysis, as `cohaptic stability point` judges a scene.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use cohaptic_campaign::{Judge, Judgement, Report, Verdict};
use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Limits, Method, VerdictKind, Watch, judge_watched};

use crate::words::nominal;

/// Judge of combinations by analysis. The watch may stop the analysis.
#[derive(Clone, Copy)]
pub struct ByAnalysis<'a>(pub &'a dyn Watch);

impl fmt::Debug for ByAnalysis<'_> {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("ByAnalysis")
    }
}

/// Reason for a scene with a timeline to have no verdict.
const TIMELINE: &str = "the timeline changes the scene during the run; simulate the scene instead, or remove the timeline";

/// Greatest number of reasons listed in the notes.
const MOST_REASONS: usize = 5;

impl Judge for ByAnalysis<'_> {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        // The analysis is of one fixed scene, and a timeline makes several scenes out of one.
        if !scene.timeline.is_empty() {
            return Some(Judgement::Refused(TIMELINE.into()));
        }
        // No limit on the number of unknowns: a campaign judges each combination once, and can be stopped and continued.
        let limits = Limits { watch: self.0, ..Limits::of_unknowns(usize::MAX) };
        let judgement = match judge_watched(scene, Method::Reduced, &limits) {
            Ok(judgement) => judgement,
            Err(AnalysisError::Stopped) => return None,
            Err(error) => return Some(Judgement::Refused(error.to_string().into())),
        };
        let kind = judgement.kind();
        let radius = match (&judgement.mean_square, kind) {
            (Some(mean_square), _) => mean_square.radius,
            // The square of the spectral radius, as in a map, is comparable with mean-square radii.
            (None, VerdictKind::Nominal) => judgement.analysis.radius.over(2),
            (None, VerdictKind::Certain | VerdictKind::MeanSquare) => judgement.analysis.radius,
        };
        let (word, judged) = (judgement.verdict.word().into(), kind.word().into());
        Some(Judgement::Known(Verdict { word, judged, radius: radius.value, error: radius.error }))
    }
}

/// Returns `true` if the verdict leaves random parts of the links out.
pub(super) fn is_nominal(judgement: &Judgement) -> bool {
    kind(judgement) == Some(VerdictKind::Nominal)
}

/// Returns `true` if the radius is a spectral radius, because the links of the scene have no random part.
pub(super) fn is_spectral(judgement: &Judgement) -> bool {
    kind(judgement) == Some(VerdictKind::Certain)
}

/// Returns the question answered by the verdict, found by the word in the verdict.
fn kind(judgement: &Judgement) -> Option<VerdictKind> {
    let verdict = judgement.verdict()?;
    // The judgement may come from a file, which stores the kind as a word.
    VerdictKind::ALL.into_iter().find(|kind| kind.word() == &*verdict.judged)
}

/// Returns notes on the simplifications of the verdicts, and on the number of combinations without a verdict, by reason.
#[must_use]
pub fn notes(report: &Report) -> Vec<String> {
    let count = report.judgements.iter().filter(|judgement| is_nominal(judgement)).count();
    let mut refused: BTreeMap<&Arc<str>, usize> = BTreeMap::new();
    for judgement in report.judgements.iter() {
        if let Judgement::Refused(reason) = judgement {
            *refused.entry(reason).or_default() += 1;
        }
    }
    let mut notes: Vec<String> = nominal(count, ["combination is", "combinations are"]).into_iter().collect();
    let said = refused.iter().take(MOST_REASONS);
    notes.extend(said.map(|(reason, count)| format!("{count} combination{} no verdict: {reason}", if *count == 1 { " has" } else { "s have" })));
    let more: usize = refused.values().skip(MOST_REASONS).sum();
    if more > 0 {
        notes.push(format!("{more} more combinations have no verdict: verdicts.csv says why"));
    }
    notes
}
