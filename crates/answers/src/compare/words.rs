//! The text about a comparison, for a terminal.

use std::cmp::Ordering;

use cohaptic_campaign::{Figures, Judgement, Share};
use cohaptic_units::print::Counted;

use super::Finished;
use super::figures::{self, Shown};

/// Greatest number of rows of a measure in the text. A larger comparison is summed up per strategy; compare.csv and compare.html have all rows.
const MOST_ROWS: usize = 24;

/// Cell without a number.
const NOTHING: &str = "-";

/// Returns the text about a comparison. `wall_s`: wall time of this call \[s\].
#[must_use]
pub fn words(finished: &Finished, wall_s: f64) -> String {
    let comparison = &finished.comparison;
    let mut lines = vec![finished.title.clone()];
    lines.extend(head(finished, wall_s));
    lines.push(String::new());
    lines.extend(table(strategies(finished)));
    for (reason, count) in refusals(finished) {
        lines.push(format!("  refused at {}: {reason}", Counted(count, "combination")));
    }
    let is_short = comparison.cells.len() <= MOST_ROWS;
    if is_short {
        for (place, measure) in comparison.measures.iter().enumerate() {
            let shown = Shown::of(comparison, place);
            lines.push(String::new());
            lines.push(format!("  {}: {}", shown.head(), measure.about));
            lines.extend(table(rows(finished, place, &shown)));
        }
    } else {
        lines.push(String::new());
        lines.push(format!(
            "  at how many of {} a strategy is lower (−) and higher (+) than {}, with the whole interval of the difference",
            Counted(comparison.others(), "combination"),
            comparison.strategies[0]
        ));
        lines.extend(table(overview(finished)));
        lines.push("  all figures are in compare.csv and compare.html".to_owned());
    }
    lines.join("\n") + "\n"
}

/// Returns the lines about the number of runs and the meaning of the numbers.
fn head(finished: &Finished, wall_s: f64) -> Vec<String> {
    let Finished { plan, report, comparison, .. } = finished;
    let keys: Vec<&str> = finished.keys().iter().map(cohaptic_campaign::Variation::key).collect();
    let over = if keys.is_empty() { String::new() } else { format!(" at {} of {}", Counted(comparison.others(), "combination"), keys.join(" and ")) };
    // The number of runs is the same for each strategy: every combination has the same seeds.
    let each = plan.runs_of_each();
    let mut lines = vec![format!("  {} of {}{over}, {each} of each", Counted(report.runs, "run"), Counted(comparison.strategies.len(), "strategy"))];
    lines.push(if report.computed == 0 {
        "  all results were in the folder already: nothing was run".to_owned()
    } else {
        format!("  {} took {wall_s:.3} s", Counted(report.computed, "run"))
    });
    lines.push(format!(
        "  ± is the interval of 95 % of the mean (Student); a difference is that to {}, over the seeds of which neither run diverged",
        comparison.strategies[0]
    ));
    lines
}

/// Returns a row per strategy: number, diverged runs, and the number of stable combinations.
fn strategies(finished: &Finished) -> Vec<Vec<String>> {
    let comparison = &finished.comparison;
    let mut rows = vec![["", "strategy", "diverged", "stable", "refused"].map(str::to_owned).to_vec()];
    let has_task = comparison.has_task();
    if has_task {
        rows[0].insert(2, "done".to_owned());
    }
    for (number, name) in comparison.strategies.iter().enumerate() {
        let sum = Sum::of(finished, number);
        let diverged = Share::of(sum.diverged, sum.runs).map_or_else(|| NOTHING.to_owned(), |share| figures::share(&share));
        let stable = if sum.judged == 0 {
            NOTHING.to_owned()
        } else if comparison.others() == 1 {
            // At a single combination, the verdict itself says more than a count.
            finished.judgement(number, 0).map_or_else(String::new, verdict)
        } else {
            format!("{} of {}", sum.stable, sum.judged)
        };
        let refused = if sum.refused == 0 { NOTHING.to_owned() } else { format!("{} of {}", sum.refused, comparison.others()) };
        let done = has_task.then(|| sum.done_words(NOTHING));
        rows.push([(number + 1).to_string(), name.clone()].into_iter().chain(done).chain([diverged, stable, refused]).collect());
    }
    rows
}

/// Sums over all combinations of a strategy.
#[derive(Default)]
pub(super) struct Sum {
    pub(super) runs: u64,
    pub(super) diverged: u64,
    /// Runs whose task was done.
    pub(super) done: u64,
    pub(super) stable: usize,
    pub(super) judged: usize,
    pub(super) refused: usize,
}

impl Sum {
    pub(super) fn of(finished: &Finished, strategy: usize) -> Self {
        let mut sum = Self::default();
        for other in 0..finished.comparison.others() {
            let cell = finished.comparison.cell(strategy, other);
            sum.runs += cell.diverged.map_or(0, |share| share.of);
            sum.diverged += cell.diverged.map_or(0, |share| share.count);
            sum.done += cell.done.map_or(0, |share| share.count);
            sum.refused += usize::from(cell.refused.is_some());
            // A refused combination and a judgement without a verdict count neither as stable nor as judged.
            if let Some(verdict) = finished.judgement(strategy, other).and_then(Judgement::verdict) {
                sum.judged += 1;
                sum.stable += usize::from(&*verdict.word == cohaptic_stability::Verdict::Stable.word());
            }
        }
        sum
    }

    /// Returns the share of runs whose task was done; `nothing` if nothing was run.
    pub(super) fn done_words(&self, nothing: &str) -> String {
        Share::of(self.done, self.runs).map_or_else(|| nothing.to_owned(), |share| figures::share(&share))
    }
}

/// Returns a verdict with the kind: `stable (mean-square)`; a dash without a verdict.
pub(super) fn verdict(judgement: &Judgement) -> String {
    judgement.verdict().map_or_else(|| NOTHING.to_owned(), |verdict| format!("{} ({})", verdict.word, verdict.judged))
}

/// Returns the reasons of refusals in order of appearance, each with the number of combinations.
pub(super) fn refusals(finished: &Finished) -> Vec<(String, usize)> {
    let comparison = &finished.comparison;
    let mut counts: Vec<(String, usize)> = Vec::new();
    for (combination, cell) in comparison.cells.iter().enumerate() {
        let Some(reason) = &cell.refused else { continue };
        let said = format!("{}: {reason}", comparison.strategies[combination / comparison.others()]);
        match counts.iter_mut().find(|(known, _)| *known == said) {
            Some((_, count)) => *count += 1,
            None => counts.push((said, 1)),
        }
    }
    counts
}

/// Returns a row per combination of the other keys and strategy.
fn rows(finished: &Finished, measure: usize, shown: &Shown) -> Vec<Vec<String>> {
    let comparison = &finished.comparison;
    let heads = finished.keys().iter().map(|key| key.key().to_owned());
    let mut rows: Vec<Vec<String>> = vec![heads.chain(["strategy", "mean", "difference", ""].map(str::to_owned)).collect()];
    for other in 0..comparison.others() {
        for (strategy, name) in comparison.strategies.iter().enumerate() {
            let figures = comparison.cell(strategy, other).figures[measure];
            let of_each = finished.plan.runs_of_each();
            // Strategies of equal other values stand below each other, to be compared by eye.
            rows.push(finished.values(other).into_iter().chain([name.clone()]).chain(cells(&figures, shown, of_each)).collect());
        }
    }
    rows
}

/// Returns the cells of a measure: mean, difference to the baseline, and side of the difference.
pub(super) fn cells(figures: &Figures, shown: &Shown, of_each: u64) -> [String; 3] {
    let text = |estimate: Option<cohaptic_campaign::Estimate>| {
        estimate.map_or_else(
            || NOTHING.to_owned(),
            |estimate| {
                // A mean over fewer runs is marked: diverged runs, and runs without a value, are missing.
                let fewer = if estimate.count < of_each { format!(" (n {})", estimate.count) } else { String::new() };
                shown.estimate(&estimate) + &fewer
            },
        )
    };
    let difference = if figures.difference.is_some() { text(figures.difference) } else { String::new() };
    [text(figures.mean), difference, side(figures).to_owned()]
}

/// Returns the word for a difference whose whole interval is on one side of zero; empty for other differences.
pub(super) fn side(figures: &Figures) -> &'static str {
    match figures.difference.map(|difference| difference.side()) {
        Some(Ordering::Less) => "lower",
        Some(Ordering::Greater) => "higher",
        // The interval contains zero, or there is no interval.
        Some(Ordering::Equal) | None => "",
    }
}

/// Returns the numbers of combinations with a lower and a higher value than the baseline: a row per measure, a column per strategy.
fn overview(finished: &Finished) -> Vec<Vec<String>> {
    let comparison = &finished.comparison;
    let numbers = (2..=comparison.strategies.len()).map(|number| number.to_string());
    let mut rows: Vec<Vec<String>> = vec![std::iter::once(String::new()).chain(numbers).collect()];
    for place in 0..comparison.measures.len() {
        let counts = (1..comparison.strategies.len()).map(|strategy| {
            let [lower, higher] = sides(finished, place, strategy);
            format!("{lower}− {higher}+")
        });
        rows.push(std::iter::once(Shown::of(comparison, place).title).chain(counts).collect());
    }
    rows
}

/// Returns the numbers of combinations in which a strategy is lower and higher than the baseline.
pub(super) fn sides(finished: &Finished, measure: usize, strategy: usize) -> [usize; 2] {
    let comparison = &finished.comparison;
    let count = |word: &str| (0..comparison.others()).filter(|other| side(&comparison.cell(strategy, *other).figures[measure]) == word).count();
    ["lower", "higher"].map(count)
}

/// Aligns the cells of rows: columns of names at the left, columns of numbers at the right.
fn table(rows: Vec<Vec<String>>) -> Vec<String> {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    // A column is at the right only if every cell with text is a number.
    let is_number = |column: usize| {
        let mut cells = rows.iter().skip(1).map(|row| row[column].as_str()).filter(|cell| !cell.is_empty() && *cell != NOTHING).peekable();
        cells.peek().is_some() && cells.all(|cell| cell.starts_with(|letter: char| letter.is_ascii_digit() || matches!(letter, '−' | '(')))
    };
    let numbers: Vec<bool> = (0..columns).map(is_number).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).zip(&numbers);
        let cells = cells.map(|((cell, width), number)| if *number { format!("  {cell:>width$}") } else { format!("  {cell:<width$}") });
        format!("  {}", cells.collect::<String>()).trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}
