//! The JSON document of a comparison.

use cohaptic_campaign::{Cell, Estimate, Figures, Judgement, MeasuredColumn, Share};
use serde::Serialize;

use super::Finished;
use crate::campaign::Written;
use crate::document;

/// Returns the answer of `cohaptic compare --json`. `written`: time and files of the comparison; `None` leaves these keys out.
pub fn document(finished: &Finished, written: Option<&Written>) -> impl Serialize {
    let Finished { report, comparison, .. } = finished;
    let strategy = &finished.plan.variations()[0];
    let strategies = comparison.strategies.iter().enumerate().map(|(place, name)| document! { name: name.clone(), set: strategy.overrides(place) });
    let measures = comparison.measures.iter().map(|measure| {
        document! { name: measure.name.as_str(), unit: measure.unit.as_str(), about: measure.about.as_str() }
    });
    let cells = comparison.cells.iter().enumerate().map(|(combination, cell)| {
        let (strategy, other) = (combination / comparison.others(), combination % comparison.others());
        document! {
            strategy: comparison.strategies[strategy].as_str(),
            vary: finished.keys().iter().zip(finished.places(other)).map(|(key, place)| key.label(place)).collect::<Vec<_>>(),
            // The reason why the strategy refuses the scene; `null` if the strategy runs.
            refused: cell.refused.as_deref(),
            runs: cell.diverged.map_or(0, |share| share.of),
            // `null` if nothing was run.
            diverged: cell.diverged.map(share_and_ends),
            // Only of a scene with a task.
            #[serde(flatten)]
            done: cell.done.map(|share| document! { done: share_and_ends(share) }),
            #[serde(flatten)]
            judgement: finished.judgement(strategy, other).map(of_judgement),
            measures: measures_of(finished, cell),
        }
    });
    document! {
        title: finished.title.as_str(),
        runs: report.runs,
        runs_computed: report.computed,
        #[serde(flatten)]
        written: written.map(|written| document! {
            wall_s: written.wall_s,
            out: written.out.as_str(),
            // The table of runs, the verdicts, the table of figures, the page, and the pictures of a task.
            files: written.files.as_slice(),
        }),
        strategies: strategies.collect::<Vec<_>>(),
        measures: measures.collect::<Vec<_>>(),
        combinations: cells.collect::<Vec<_>>(),
    }
}

/// Returns a count, its share of all runs, and the ends of the interval of the share.
fn share_and_ends(share: Share) -> impl Serialize {
    document! { count: share.count, share: share.value(), low: share.low, high: share.high }
}

/// Returns the document of a judgement. All keys are `null` without a verdict; the radius is `null` for a verdict without a radius.
fn of_judgement(judgement: &Judgement) -> impl Serialize {
    let verdict = judgement.verdict();
    document! {
        verdict: verdict.map(|verdict| &*verdict.word),
        judged: verdict.map(|verdict| &*verdict.judged),
        radius: verdict.map(|verdict| verdict.radius),
    }
}

fn measures_of<'a>(finished: &'a Finished, cell: &'a Cell) -> Vec<impl Serialize + use<'a>> {
    let of = |(measure, figures): (&'a MeasuredColumn, &Figures)| {
        document! {
            name: measure.name.as_str(),
            count: figures.mean.map_or(0, |mean| mean.count),
            mean: figures.mean.map(mean_and_ends),
            difference: figures.difference.map(counted),
        }
    };
    finished.comparison.measures.iter().zip(&cell.figures).map(of).collect()
}

/// Returns a mean with the ends of its interval. The ends are `null` without an interval.
fn mean_and_ends(estimate: Estimate) -> impl Serialize {
    let known = estimate.half_width.is_some();
    document! { value: estimate.mean, low: known.then(|| estimate.low()), high: known.then(|| estimate.high()) }
}

fn counted(estimate: Estimate) -> impl Serialize {
    document! { count: estimate.count, #[serde(flatten)] mean: mean_and_ends(estimate) }
}
