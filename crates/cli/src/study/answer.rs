//! Answers of `cohaptic study` as JSON documents.

use cohaptic_campaign::Share;
use cohaptic_study::{Analysed, Analysis, Power, Study, Verified};
use serde::Serialize;

use crate::document_schema::document;

/// Returns the answer of `study run --dry-run`. `analysis` holds the figures of the first dry run, and `files` the paths of the written files.
pub(super) fn dry_run(study: &Study, analysis: &Analysis, power: &Power, files: &[String]) -> impl Serialize {
    let found = power.differences.iter().map(|difference| {
        document! {
            measure: difference.measure.as_str(),
            condition: study.conditions[difference.condition].label.as_str(),
            mean: difference.mean,
            found: share(difference.alone),
            found_after_holm: share(difference.corrected),
        }
    });
    let timed_out = power.timed_out.iter().map(|of| of.map(share));
    document! {
        title: study.title.as_str(),
        people: study.participants(),
        groups: study.groups,
        #[serde(flatten)]
        figures: figures(study, analysis),
        times: power.times,
        power: found.collect::<Vec<_>>(),
        timed_out: timed_out.collect::<Vec<_>>(),
        files: files.to_vec(),
    }
}

/// Returns the answer of `study report`.
pub(super) fn report(study: &Study, analysis: &Analysis, complete: usize, files: &[String]) -> impl Serialize {
    document! {
        title: study.title.as_str(),
        people: study.participants(),
        groups: study.groups,
        sessions_complete: complete,
        #[serde(flatten)]
        figures: figures(study, analysis),
        files: files.to_vec(),
    }
}

/// Returns the answer of `study verify`, with every difference.
pub(super) fn verify(verified: &Verified) -> impl Serialize {
    document! { trials: verified.trials, differences: verified.differences.clone() }
}

/// Returns the conditions, the warnings, and the figures of measures and questions.
fn figures(study: &Study, analysis: &Analysis) -> impl Serialize + use<> {
    let analysed = analysis.measures.iter().chain(&analysis.questions);
    document! {
        conditions: study.conditions.iter().map(|condition| condition.label.clone()).collect::<Vec<_>>(),
        warnings: analysis.warnings(study),
        measures: analysed.map(measure).collect::<Vec<_>>(),
    }
}

/// Returns the figures of a measure or of a question, in the order of the conditions; differences are those of the conditions but the first to the first.
fn measure(of: &Analysed) -> impl Serialize + use<> {
    let means = of.means.iter().enumerate().map(|(place, mean)| {
        let timed_out = of.timed_out.get(place).copied().flatten();
        document! { mean: mean.mean, half_width: mean.half_width, timed_out: timed_out.map(|share| share.count), trials: timed_out.map(|share| share.of) }
    });
    let differences = of.differences.iter().map(|difference| {
        document! {
            mean: difference.estimate.mean,
            half_width: difference.estimate.half_width,
            effect: difference.effect,
            p: difference.p,
            p_holm: difference.p_holm,
        }
    });
    document! {
        name: of.name.clone(),
        groups: of.rows.len(),
        groups_left_out: of.left_out,
        means: means.collect::<Vec<_>>(),
        differences: differences.collect::<Vec<_>>(),
    }
}

fn share(share: Share) -> impl Serialize + use<> {
    document! { count: share.count, of: share.of, low: share.low, high: share.high }
}
