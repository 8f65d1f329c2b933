//! Verdicts on combinations: each is judged as `cohaptic stability point` judges it.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use cohaptic_campaign::{Judge, Judgement, Report, Verdict};
use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Limits, Method, VerdictKind, Watch, judge_watched};

use crate::nominal;

/// Judges by analysis, until the watch ends it.
#[derive(Clone, Copy)]
pub struct ByAnalysis<'a>(pub &'a dyn Watch);

impl fmt::Debug for ByAnalysis<'_> {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("ByAnalysis")
    }
}

/// Why a scene that changes on its way has no verdict.
const TIMELINE: &str = "its timeline changes it on its way; simulate it instead, or take the timeline away";

/// The most reasons that notes tell apart.
const MOST_REASONS: usize = 5;

impl Judge for ByAnalysis<'_> {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        if !scene.timeline.is_empty() {
            return Some(Judgement::Refused(TIMELINE.into()));
        }
        let limits = Limits { watch: self.0, ..Limits::of_unknowns(usize::MAX) };
        let judgement = match judge_watched(scene, Method::Reduced, &limits) {
            Ok(judgement) => judgement,
            Err(AnalysisError::Stopped) => return None,
            Err(error) => return Some(Judgement::Refused(error.to_string().into())),
        };
        let kind = judgement.kind();
        let radius = match (&judgement.mean_square, kind) {
            (Some(mean_square), _) => mean_square.radius,
            // As in a map, so that it can be compared with mean-square radii.
            (None, VerdictKind::Nominal) => judgement.analysis.radius.over(2),
            (None, VerdictKind::Certain | VerdictKind::MeanSquare) => judgement.analysis.radius,
        };
        let (word, judged) = (judgement.verdict.word().into(), kind.word().into());
        Some(Judgement::Known(Verdict { word, judged, radius: radius.value, error: radius.error }))
    }
}

/// Whether the verdict leaves out what links leave to chance.
pub(super) fn is_nominal(judgement: &Judgement) -> bool {
    kind(judgement) == Some(VerdictKind::Nominal)
}

/// Whether the radius is that of the scene with nothing left to chance because nothing is.
pub(super) fn is_spectral(judgement: &Judgement) -> bool {
    kind(judgement) == Some(VerdictKind::Certain)
}

/// The question that the verdict answers, from the word that its file has.
fn kind(judgement: &Judgement) -> Option<VerdictKind> {
    let verdict = judgement.verdict()?;
    VerdictKind::ALL.into_iter().find(|kind| kind.word() == &*verdict.judged)
}

/// What the verdicts leave out, and how many combinations have none, by reason.
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
