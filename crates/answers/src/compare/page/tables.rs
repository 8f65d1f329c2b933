//! The tables of the page.

use cohaptic_campaign::{Figures, Share, Variation};
use cohaptic_picture::page::{Html, Mark, Table};

use crate::compare::Finished;
use crate::compare::figures::{self, Shown};
use crate::compare::words::{self, Sum};

/// Returns the table of strategies: description, parameters, and counts of diverged, stable and refused combinations.
pub(super) fn strategies(finished: &Finished, words: &[(&'static str, String)]) -> Html {
    let comparison = &finished.comparison;
    let has_task = comparison.has_task();
    let head = Table::new().column("strategy").column("each copy is drawn").column("parameters");
    let head = if has_task { head.number("task done") } else { head };
    let head = head.number("diverged").number("stable").number("refused");
    let table = comparison.strategies.iter().zip(words).enumerate().fold(head, |table, (place, (name, (about, parameters)))| {
        let sum = Sum::of(finished, place);
        let baseline = if place == 0 { " (baseline)" } else { "" };
        // Without a run there is no share, and a dash tells more than "0 of 0".
        let diverged = Share::of(sum.diverged, sum.runs).map_or_else(|| NOTHING.to_owned(), |share| figures::share(&share));
        let about = [Html::code(name).and(baseline), (*about).into(), parameters.as_str().into()];
        let done = has_task.then(|| Html::from(sum.done_words(NOTHING)));
        let cells = [
            diverged.into(),
            Html::text(&if sum.judged == 0 { NOTHING.to_owned() } else { format!("{} of {}", sum.stable, sum.judged) }),
            Html::text(&if sum.refused == 0 { NOTHING.to_owned() } else { format!("{} of {}", sum.refused, comparison.others()) }),
        ];
        table.row(about.into_iter().chain(done).chain(cells))
    });
    Html::table(&table)
}

/// Cell without a number.
const NOTHING: &str = "–";

/// Returns the table of differences: numbers of combinations in which each strategy is lower and higher than the baseline.
pub(super) fn overview(finished: &Finished) -> Html {
    let comparison = &finished.comparison;
    let head = comparison.strategies.iter().skip(1).fold(Table::new().column("measure"), |table, name| table.number(name.as_str()));
    let table = comparison.measures.iter().enumerate().fold(head, |table, (place, measure)| {
        let counts = (1..comparison.strategies.len()).map(|strategy| match words::sides(finished, place, strategy) {
            // Zeros are left out, so that each cell shows only the sides with a difference.
            [0, 0] => Html::text(NOTHING),
            [lower, 0] => down(&lower.to_string()),
            [0, higher] => up(&higher.to_string()),
            [lower, higher] => Html::lines([down(&lower.to_string()), up(&higher.to_string())]),
        });
        table.row(std::iter::once(Html::link(&measure.name, Shown::of(comparison, place).title)).chain(counts))
    });
    Html::table(&table)
}

fn down(words: &str) -> Html {
    Html::mark(Mark::Good, &format!("▼ {words}"))
}

fn up(words: &str) -> Html {
    Html::mark(Mark::Partly, &format!("▲ {words}"))
}

/// Returns a table with a row per combination of the other keys and a column per strategy.
fn by_strategy(finished: &Finished, cell: impl Fn(usize, usize) -> Html) -> Html {
    let comparison = &finished.comparison;
    let keys = finished.keys().iter().map(Variation::key);
    let head = keys.fold(Table::new(), |table, key| table.number(key));
    // Without other keys, an empty heading stands in place of the values of a row.
    let head = if finished.keys().is_empty() { head.column("") } else { head };
    let head = comparison.strategies.iter().fold(head, |table, name| table.number(name.as_str()));
    let table = (0..comparison.others()).fold(head, |table, other| {
        let values = finished.values(other).into_iter().map(Html::from);
        let unnamed = finished.keys().is_empty().then(Html::default);
        table.row(values.chain(unnamed).chain((0..comparison.strategies.len()).map(|strategy| cell(strategy, other))))
    });
    Html::table(&table)
}

/// Returns the table of runs whose task was done.
pub(super) fn done(finished: &Finished) -> Html {
    by_strategy(finished, |strategy, other| match finished.comparison.cell(strategy, other).done {
        Some(share) => Html::text(&figures::share(&share)),
        None => "refused".into(),
    })
}

/// Returns the table of verdicts and diverged runs.
pub(super) fn stability(finished: &Finished) -> Html {
    by_strategy(finished, |strategy, other| {
        let cell = finished.comparison.cell(strategy, other);
        if cell.refused.is_some() {
            return "refused".into();
        }
        let verdict = finished.judgement(strategy, other).map_or_else(String::new, words::verdict);
        // Most cells have no diverged run, and the verdict then stands alone.
        let diverged = cell.diverged.filter(|share| share.count > 0).map(|share| Html::text(&format!("diverged {}", figures::share(&share))));
        Html::lines(std::iter::once(verdict.into()).chain(diverged))
    })
}

/// Returns the table of a measure: means, and below each mean the difference to the baseline.
pub(super) fn measure(finished: &Finished, measure: usize, shown: &Shown) -> Html {
    let of_each = finished.plan.runs_of_each();
    by_strategy(finished, |strategy, other| {
        let cell = finished.comparison.cell(strategy, other);
        if cell.refused.is_some() {
            return "refused".into();
        }
        let figures = &cell.figures[measure];
        let [mean, difference, _] = words::cells(figures, shown, of_each);
        let difference = (!difference.is_empty()).then(|| marked(figures, &difference));
        Html::lines(std::iter::once(mean.into()).chain(difference))
    })
}

/// Marks a difference whose whole interval lies on one side of zero.
fn marked(figures: &Figures, words: &str) -> Html {
    match words::side(figures) {
        "lower" => down(words),
        "higher" => up(words),
        _ => Html::text(&format!("Δ {words}")),
    }
}
