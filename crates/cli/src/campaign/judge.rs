//! Verdicts on combinations: each is judged as `cohaptic stability point` judges it.

use std::collections::BTreeMap;
use std::sync::Arc;

use cohaptic_campaign::{Judge, Judgement, Report, Verdict};
use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Criterion, Limits, Method, has_chance, judge_watched};

use crate::analysis_watch::Interruptible;
use crate::stability::source;

/// Judges by analysis, until the user asks for the end.
pub(super) struct ByAnalysis;

/// Why a scene that changes on its way has no verdict.
const TIMELINE: &str = "its timeline changes it on its way; simulate it instead, or take the timeline away";

/// The most reasons that notes tell apart.
const MOST_REASONS: usize = 5;

impl Judge for ByAnalysis {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        if !scene.timeline.is_empty() {
            return Some(Judgement::Refused(TIMELINE.into()));
        }
        let limits = Limits { watch: &Interruptible, ..Limits::of_unknowns(usize::MAX) };
        let judgement = match judge_watched(scene, Method::Reduced, &limits) {
            Ok(judgement) => judgement,
            Err(AnalysisError::Stopped) => return None,
            Err(error) => return Some(Judgement::Refused(error.to_string().into())),
        };
        let (criterion, is_nominal, radius) = match &judgement.mean_square {
            Some(mean_square) => (Criterion::MeanSquare, false, mean_square.radius),
            // As in a map, so that it can be compared with mean-square radii.
            None if has_chance(scene) => (Criterion::MeanSquare, true, judgement.analysis.radius.over(2)),
            None => (Criterion::SpectralRadius, false, judgement.analysis.radius),
        };
        let judged = source::judged(criterion, is_nominal);
        Some(Judgement::Known(Verdict { word: judgement.verdict.word().into(), judged: judged.into(), radius: radius.value, error: radius.error }))
    }
}

/// Whether the verdict leaves out what links leave to chance.
pub(super) fn is_nominal(judgement: &Judgement) -> bool {
    is_judged(judgement, source::judged(Criterion::MeanSquare, true))
}

/// Whether the radius is that of the scene with nothing left to chance because nothing is.
pub(super) fn is_spectral(judgement: &Judgement) -> bool {
    is_judged(judgement, source::judged(Criterion::SpectralRadius, false))
}

fn is_judged(judgement: &Judgement, word: &str) -> bool {
    judgement.verdict().is_some_and(|verdict| &*verdict.judged == word)
}

/// What the verdicts leave out, and how many combinations have none, by reason.
pub(super) fn notes(report: &Report) -> Vec<String> {
    let nominal = report.judgements.iter().filter(|judgement| is_nominal(judgement)).count();
    let mut refused: BTreeMap<&Arc<str>, usize> = BTreeMap::new();
    for judgement in report.judgements.iter() {
        if let Judgement::Refused(reason) = judgement {
            *refused.entry(reason).or_default() += 1;
        }
    }
    let mut notes: Vec<String> = source::nominal(nominal, ["combination is", "combinations are"]).into_iter().collect();
    let said = refused.iter().take(MOST_REASONS);
    notes.extend(said.map(|(reason, count)| format!("{count} combination{} no verdict: {reason}", if *count == 1 { " has" } else { "s have" })));
    let more: usize = refused.values().skip(MOST_REASONS).sum();
    if more > 0 {
        notes.push(format!("{more} more combinations have no verdict: verdicts.csv says why"));
    }
    notes
}
